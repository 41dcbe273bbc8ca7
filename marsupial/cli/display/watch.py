"""What is going on in a mission, kept up to date from its events: the map, the clock, what every robot does."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from marsupial.mission.observer import Observer
from marsupial.mission.playback import RobotView
from marsupial.model.grid import UNKNOWN, Cell, CellArray, Mask
from marsupial.model.mission import (
    ActionEnd,
    ActionEnded,
    ActionStarted,
    DriveEnded,
    DriveStarted,
    MissionEvent,
    MissionStarted,
    PlacedRobot,
    Planned,
    Revealed,
    RobotLost,
    Triggers,
)
from marsupial.model.plan import Action, ActionName
from marsupial.model.robots import RobotType
from marsupial.paths.routes import passing_times_ms, route_of


@dataclass(slots=True)
class _Robot:
    """One robot: where it is, on whom and what it does."""

    type: RobotType
    carrier: str | None
    route: Sequence[Cell]
    times_ms: Sequence[int] = (0,)
    action: Action | None = None
    lost: bool = False

    def cell_at(self, t_ms: int) -> Cell:
        """Return the cell it has passed last."""
        return self.route[max(bisect_right(self.times_ms, t_ms) - 1, 0)]


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
    trigger: Triggers = ()
    cells: CellArray = field(init=False)
    _robots: dict[str, _Robot] = field(default_factory=dict)
    _known: int = 0
    _resolution_m: float = 1.0

    def __post_init__(self) -> None:
        self.cells = np.full(self.reachable.shape, UNKNOWN, dtype=np.uint8)

    @property
    def coverage(self) -> float:
        """Known share of the reachable cells, 0 to 1."""
        wanted = int(np.count_nonzero(self.reachable))
        return self._known / wanted if wanted else 1.0

    def views(self) -> tuple[RobotView, ...]:
        """Return every robot as it is now, in the order of the team."""
        return tuple(self._view(name, robot) for name, robot in self._robots.items())

    def event(self, event: MissionEvent) -> None:
        """Take in what happened."""
        self.t_ms = event.t_ms
        match event:
            case MissionStarted():
                kinds = {kind.name: kind for kind in event.types}
                self._robots = {robot.name: _placed(robot, kinds[robot.type]) for robot in event.robots}
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
                self._robots[event.robot].lost = True
            case Planned():
                self.revision, self.trigger = event.revision, event.trigger

    def _reveal(self, runs: Sequence[int]) -> None:
        flat, wanted = self.cells.reshape(-1), self.reachable.reshape(-1)
        for i in range(0, len(runs), 3):
            start, length, code = runs[i : i + 3]
            flat[start : start + length] = code
            self._known += int(np.count_nonzero(wanted[start : start + length]))

    def _view(self, name: str, robot: _Robot) -> RobotView:
        cell = (robot if robot.carrier is None else self._robots[robot.carrier]).cell_at(self.t_ms)
        return RobotView(
            name=name,
            type=robot.type.name,
            x=cell.x,
            y=cell.y,
            carrier=robot.carrier,
            cargo=tuple(other for other, rider in self._robots.items() if rider.carrier == name),
            action=robot.action,
            lost=robot.lost,
        )

    def _drive(self, event: DriveStarted) -> None:
        robot = self._robots[event.robot]
        robot.route = route_of(event.cell, event.steps)
        times = passing_times_ms(robot.route, self._resolution_m, robot.type.speed_mps)
        robot.times_ms = (event.t_ms + times).tolist()

    def _stand(self, robot: str, cell: Cell) -> None:
        self._robots[robot].route, self._robots[robot].times_ms = (cell,), (self.t_ms,)

    def _start(self, event: ActionStarted) -> None:
        for name in event.action.robots:
            self._robots[name].action = event.action
        if event.action.name is ActionName.UNDOCK:
            self._robots[event.action.robot].carrier = None
            self._stand(event.action.robot, event.cell)

    def _end(self, event: ActionEnded) -> None:
        for name in event.action.robots:
            self._robots[name].action = None
        docked = event.action.name is ActionName.DOCK and event.end is ActionEnd.DONE
        if docked or (event.action.name is ActionName.UNDOCK and event.end is ActionEnd.FAILED):
            self._robots[event.action.robot].carrier = event.action.carrier


def _placed(robot: PlacedRobot, kind: RobotType) -> _Robot:
    cell = Cell(0, 0) if robot.cell is None else robot.cell
    return _Robot(type=kind, carrier=robot.carrier, route=(cell,))
