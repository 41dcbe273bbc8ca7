"""What is going on in a mission, kept up to date from its events: the map, the clock, what every robot does."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from marsupial.mission.observer import Observer
from marsupial.model.grid import UNKNOWN, Cell, CellArray, Mask
from marsupial.model.mission import (
    ActionEnd,
    ActionEnded,
    ActionStarted,
    DriveEnded,
    DriveStarted,
    MissionEnded,
    MissionEvent,
    MissionStarted,
    PlacedRobot,
    Planned,
    Revealed,
    RobotLost,
)
from marsupial.model.plan import Action, ActionName
from marsupial.model.robots import RobotType
from marsupial.paths.routes import passing_times_ms, route_of

_DOING = {
    ActionName.MOVE: "driving to {place}",
    ActionName.EXPLORE: "exploring {place}",
    ActionName.DOCK: "docking on {partner}",
    ActionName.UNDOCK: "leaving {partner}",
}
_DOING_AS_CARRIER = {ActionName.DOCK: "picking up {partner}", ActionName.UNDOCK: "setting down {partner}"}


@dataclass(slots=True)
class WatchedRobot:
    """One robot: where it is, on whom and what it does."""

    kind: RobotType
    carrier: str | None
    route: Sequence[Cell]
    times_ms: Sequence[int] = (0,)
    action: Action | None = None
    lost: bool = False


@dataclass(slots=True)
class Watch(Observer):
    """The state of a mission.

    Parameters
    ----------
    reachable
        Cells (height, width) that there are to explore.
    """

    reachable: Mask
    t_ms: int = 0
    revision: int = 0
    trigger: str = ""
    targets: int = 0
    ended: MissionEnded | None = None
    robots: dict[str, WatchedRobot] = field(default_factory=dict)
    cells: CellArray = field(init=False)
    _known: int = 0

    def __post_init__(self) -> None:
        self.cells = np.full(self.reachable.shape, UNKNOWN, dtype=np.uint8)

    @property
    def coverage(self) -> float:
        """Known share of the reachable cells, 0 to 1."""
        wanted = int(np.count_nonzero(self.reachable))
        return self._known / wanted if wanted else 1.0

    def cell_of(self, robot: str) -> Cell:
        """Return the cell that a robot, or who carries it, has passed last."""
        watched = self.robots[robot]
        if watched.carrier is not None:
            return self.cell_of(watched.carrier)
        return watched.route[max(bisect_right(watched.times_ms, self.t_ms) - 1, 0)]

    def doing(self, robot: str) -> str:
        """Return what a robot does, in words."""
        watched = self.robots[robot]
        action = watched.action
        if watched.lost:
            return "lost"
        if action is None:
            return "waiting" if watched.carrier is None else f"aboard {watched.carrier}"
        words, partner = (
            (_DOING_AS_CARRIER, action.robot) if robot == action.carrier else (_DOING, action.carrier or "")
        )
        return words[action.name].format(place=action.place, partner=partner)

    def aboard(self, carrier: str) -> list[str]:
        """Return the robots on a carrier."""
        return [name for name, robot in self.robots.items() if robot.carrier == carrier]

    def event(self, event: MissionEvent) -> None:
        """Take in what happened."""
        self.t_ms = event.t_ms
        match event:
            case MissionStarted():
                kinds = {kind.name: kind for kind in event.types}
                self.robots = {robot.name: _placed(robot, kinds[robot.type]) for robot in event.robots}
                self._resolution_m = event.resolution_m
            case Revealed():
                self._reveal(event.runs)
            case DriveStarted():
                self._drive(event)
            case DriveEnded():
                self._stand(event.robot, event.cell)
            case ActionStarted():
                self._start(event)
            case ActionEnded():
                self._end(event)
            case RobotLost():
                self.robots[event.robot].lost = True
            case Planned():
                self.revision, self.trigger, self.targets = event.revision, event.trigger, len(event.targets)
            case MissionEnded():
                self.ended = event

    _resolution_m: float = 1.0

    def _reveal(self, runs: Sequence[int]) -> None:
        flat, wanted = self.cells.reshape(-1), self.reachable.reshape(-1)
        for i in range(0, len(runs), 3):
            start, length, code = runs[i : i + 3]
            flat[start : start + length] = code
            self._known += int(np.count_nonzero(wanted[start : start + length]))

    def _drive(self, event: DriveStarted) -> None:
        robot = self.robots[event.robot]
        robot.route = route_of(event.cell, event.steps)
        times = passing_times_ms(robot.route, self._resolution_m, robot.kind.speed_mps)
        robot.times_ms = (event.t_ms + times).tolist()

    def _stand(self, robot: str, cell: Cell) -> None:
        self.robots[robot].route, self.robots[robot].times_ms = (cell,), (self.t_ms,)

    def _start(self, event: ActionStarted) -> None:
        for name in event.action.robots:
            self.robots[name].action = event.action
        if event.action.name is ActionName.UNDOCK:
            self.robots[event.action.robot].carrier = None
            self._stand(event.action.robot, event.cell)

    def _end(self, event: ActionEnded) -> None:
        for name in event.action.robots:
            self.robots[name].action = None
        if event.action.name is ActionName.DOCK and event.end is ActionEnd.DONE:
            self.robots[event.action.robot].carrier = event.action.carrier


def _placed(robot: PlacedRobot, kind: RobotType) -> WatchedRobot:
    cell = Cell(0, 0) if robot.cell is None else robot.cell
    return WatchedRobot(kind=kind, carrier=robot.carrier, route=(cell,))
