"""Our simulator as a client of missions: does what it is commanded, and reports what happens."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from marsupial.mission.runs import runs_of
from marsupial.model.grid import Cell, Grid
from marsupial.model.mission import PlacedRobot
from marsupial.model.robots import RobotType
from marsupial.model.world import RobotReport
from marsupial.sim.world import SimulatedWorld


class SimulatedTeam:
    """A simulated world that takes commands and gives reports, both as JSON.

    Attributes
    ----------
    paused
        Whether the mission is; then time goes on only as long as a robot is busy.
    """

    def __init__(
        self,
        truth: Grid,
        kinds: Mapping[str, RobotType],
        robots: Sequence[PlacedRobot],
        failures: Mapping[str, int] | None = None,
    ) -> None:
        self._world = SimulatedWorld(truth, kinds, robots, failures)
        self._ids: dict[str, int] = {}
        self._n = 0
        self.paused = False

    def answer(self, batch: Mapping[str, Any]) -> dict[str, Any] | None:
        """Carry out a batch of commands until something happens, and return the report of it.

        There is none if the batch doesn't ask for one: it is the last, or answers an earlier report than the last.
        """
        for command in batch["commands"]:
            self._obey(command)
        if batch["n"] != self._n or batch["until_ms"] is None or (self.paused and not self._ids):
            return None
        before = self._state()
        news = self._world.advance(batch["until_ms"])
        self._n += 1
        ids = dict.fromkeys(self._ids.pop(name) for name in news.finished)
        for name, _ in news.lost:
            self._ids.pop(name, None)
        cells = self._world.grid.cells.ravel()
        return {
            "n": self._n,
            "t_ms": news.t_ms,
            "revealed": [{"robot": name, "runs": list(runs_of(seen, cells))} for name, seen in news.revealed],
            "robots": [
                self._note(new)
                for old, (new, driven) in zip(before, self._state(), strict=True)
                if (new, driven) != old and new.cell is not None
            ],
            "finished": list(ids),
            "lost": [{"robot": name, "reason": reason} for name, reason in news.lost],
        }

    def _state(self) -> list[tuple[RobotReport, float]]:
        return [(robot, self._world.distance_m(robot.name)) for robot in self._world.robots()]

    def _obey(self, command: Mapping[str, Any]) -> None:
        robot, name = command["robot"], command["name"]
        if name == "stop":
            self._world.stop(robot)
            return
        for one in (robot, command.get("carrier")):
            if one is not None:
                self._ids[one] = command["id"]
        if name == "drive":
            self._world.drive(robot, [Cell(*cell) for cell in command["route"]])
        elif name == "dock":
            self._world.dock(robot, command["carrier"])
        else:
            self._world.undock(robot, command["carrier"], Cell(*command["cell"]))

    def _note(self, robot: RobotReport) -> dict[str, Any]:
        return {
            "name": robot.name,
            "cell": list(robot.cell or ()),
            "free_at_ms": robot.free_at_ms,
            "distance_m": self._world.distance_m(robot.name),
            "driving_ms": self._world.driving_ms(robot.name),
        }
