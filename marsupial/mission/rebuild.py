"""The moment of a mission again, from its log: the known map, the robots, and the survey a planner would be given.

A log holds all that a survey is made from: what was revealed, who drove where, which docking runs, and which meeting
points are in use. A moment at which a plan was made is taken as it was before that plan, so what is surveyed there is
the very situation the plan was made for; any other moment is taken after all that happened at it.
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from marsupial.errors import UsageError
from marsupial.maps.survey import Survey, Surveyor
from marsupial.maps.territory import Territory
from marsupial.model.grid import UNKNOWN, Cell, Grid
from marsupial.model.mission import (
    ActionEnd,
    ActionEnded,
    ActionStarted,
    DriveEnded,
    DriveStarted,
    MapMeeting,
    MissionEvent,
    MissionStarted,
    PlacedRobot,
    Planned,
    Revealed,
    RobotLost,
)
from marsupial.model.plan import Action, ActionName
from marsupial.model.robots import RobotType
from marsupial.model.world import RobotReport
from marsupial.paths.routes import passing_times_ms, route_of


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Moment:
    """A mission at one moment.

    Parameters
    ----------
    robots
        What the world would report of every robot.
    meetings
        The meeting points in use.
    """

    mission: MissionStarted
    t_ms: int
    grid: Grid
    robots: tuple[RobotReport, ...]
    meetings: tuple[MapMeeting, ...]

    def survey(self) -> Survey:
        """Return the situation of the robots and what it means on the map."""
        homes = {robot.name: robot.cell for robot in self.mission.robots if robot.cell is not None}
        surveyor = Surveyor(Territory(self.grid, self.mission.types), homes, self.mission.goal)
        return surveyor.survey(self.robots, self.t_ms, self.meetings)


def moment_at(events: Sequence[MissionEvent], t_ms: int) -> Moment:
    """Return the mission of these events (all of it up to then) at `t_ms`.

    Raises
    ------
    UsageError
        If the mission was over before.
    """
    mission = events[0]
    assert isinstance(mission, MissionStarted)
    if not mission.t_ms <= t_ms <= events[-1].t_ms:
        raise UsageError(
            f"there is nothing at {t_ms / 1000:g} s: the mission goes from {mission.t_ms / 1000:g} s "
            f"to {events[-1].t_ms / 1000:g} s"
        )
    rebuilt = _Rebuilt(mission)
    for event in events[: _cut(events, t_ms)]:
        rebuilt.take(event)
    return rebuilt.at(t_ms)


def _cut(events: Sequence[MissionEvent], t_ms: int) -> int:
    """Return how many events come before the moment: before the last plan made at it, else all up to it."""
    end = bisect_right(events, t_ms, key=lambda event: event.t_ms)
    plans = [i for i in range(end) if isinstance(events[i], Planned) and events[i].t_ms == t_ms]
    return plans[-1] if plans else end


@dataclass(slots=True)
class _Robot:
    """One robot: `route` and `times_ms` while it drives, `free_at_ms` while it docks."""

    kind: RobotType
    cell: Cell | None
    carrier: str | None
    route: Sequence[Cell] = ()
    times_ms: Sequence[int] = ()
    free_at_ms: int = 0
    lost: bool = False
    docked_from: Cell | None = None

    def stand(self, cell: Cell | None) -> None:
        self.cell, self.route, self.times_ms = cell, (), ()

    def report(self, name: str, t_ms: int, stranded: bool) -> RobotReport:
        cell, free_at_ms = self.cell, max(self.free_at_ms, t_ms)
        if self.route:
            step = min(bisect_right(self.times_ms, t_ms), len(self.route) - 1)
            cell, free_at_ms = self.route[step], self.times_ms[step]
        return RobotReport(
            name=name,
            type=self.kind.name,
            cell=cell,
            carrier=self.carrier,
            free_at_ms=free_at_ms,
            lost=self.lost or stranded,
        )


@dataclass(slots=True)
class _Work:
    """What is left of the plan, and where rovers were set down; says which meeting points are in use."""

    meetings: tuple[MapMeeting, ...] = ()
    left: list[Action] = field(default_factory=list)
    docking: list[Action] = field(default_factory=list)
    deployed_at: dict[str, str] = field(default_factory=dict)

    def planned(self, event: Planned) -> None:
        self.meetings, self.left = event.meetings, list(event.actions)

    def started(self, action: Action) -> None:
        if action.carrier is not None:
            self.docking.append(action)

    def ended(self, action: Action, end: ActionEnd) -> None:
        self.left = [other for other in self.left if other != action]
        self.docking = [other for other in self.docking if other != action]
        if end is ActionEnd.BLOCKED:
            self.dropped(action.robot)
        elif end is ActionEnd.FAILED:
            self.dropped(*action.robots)
        elif end is ActionEnd.DONE and action.name is ActionName.UNDOCK:
            self.deployed_at[action.robot] = action.place
        elif end is ActionEnd.DONE and action.name is ActionName.DOCK:
            self.deployed_at.pop(action.robot, None)

    def dropped(self, *robots: str) -> None:
        """Forget what only `robots` were to do."""
        self.left = [action for action in self.left if not set(action.robots) <= set(robots)]

    def in_use(self) -> tuple[MapMeeting, ...]:
        used = {action.place for action in (*self.left, *self.docking)} | set(self.deployed_at.values())
        return tuple(point for point in self.meetings if point.name in used)


class _Rebuilt:
    """A mission carried forward, event by event."""

    def __init__(self, mission: MissionStarted) -> None:
        self._mission = mission
        kinds = {kind.name: kind for kind in mission.types}
        self._robots = {robot.name: _start(robot, kinds) for robot in mission.robots}
        self._cells = np.full(mission.width * mission.height, UNKNOWN, dtype=np.uint8)
        self._work = _Work()

    def at(self, t_ms: int) -> Moment:
        lost = {name for name, robot in self._robots.items() if robot.lost}
        mission = self._mission
        return Moment(
            mission=mission,
            t_ms=t_ms,
            grid=Grid(
                cells=self._cells.reshape(mission.height, mission.width),
                resolution_m=mission.resolution_m,
                origin_m=mission.origin_m,
                terrains=mission.terrains,
            ),
            robots=tuple(robot.report(name, t_ms, robot.carrier in lost) for name, robot in self._robots.items()),
            meetings=self._work.in_use(),
        )

    def take(self, event: MissionEvent) -> None:
        match event:
            case Revealed():
                for i in range(0, len(event.runs), 3):
                    start, length, code = event.runs[i : i + 3]
                    self._cells[start : start + length] = code
            case DriveStarted():
                self._drive(event)
            case DriveEnded():
                self._robots[event.robot].stand(event.cell)
            case Planned():
                self._work.planned(event)
            case ActionStarted():
                self._work.started(event.action)
                self._dock(event)
            case ActionEnded():
                self._work.ended(event.action, event.end)
                if event.end is ActionEnd.FAILED:
                    self._undo(event.action)
                for name in event.action.robots:
                    self._robots[name].free_at_ms = event.t_ms
            case RobotLost():
                self._robots[event.robot].lost = True
                self._work.dropped(event.robot)

    def _drive(self, event: DriveStarted) -> None:
        robot = self._robots[event.robot]
        robot.route = route_of(event.cell, event.steps)
        times = event.t_ms + passing_times_ms(robot.route, self._mission.resolution_m, robot.kind.speed_mps)
        robot.times_ms = times.tolist()

    def _dock(self, event: ActionStarted) -> None:
        action = event.action
        if action.carrier is None:
            return
        rover = self._robots[action.robot]
        docks = action.name is ActionName.DOCK
        rover.docked_from = event.cell
        rover.stand(None if docks else event.cell)
        rover.carrier = action.carrier if docks else None
        for name in action.robots:
            self._robots[name].free_at_ms = event.t_ms + (rover.kind.dock_ms if docks else rover.kind.undock_ms)

    def _undo(self, action: Action) -> None:
        """Put a rover back to where it was before a docking or undocking that failed."""
        if action.carrier is not None:
            rover, docks = self._robots[action.robot], action.name is ActionName.DOCK
            rover.stand(rover.docked_from if docks else None)
            rover.carrier = None if docks else action.carrier


def _start(robot: PlacedRobot, kinds: Mapping[str, RobotType]) -> _Robot:
    return _Robot(kind=kinds[robot.type], cell=robot.cell, carrier=robot.carrier)
