"""A mission seen again from its events: where everybody was, and what was known, at any moment.

Positions are in cells, the centre of cell (x, y) being exactly (x, y); a robot on a drive is between the cells it
passes, at the times `DriveStarted` gives for them. A rover is aboard from the end of a dock that was done to the
start of its next undock (one that fails puts it back aboard), and is then wherever its carrier is. What happens at a
moment counts at that moment.
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Generic, TypeVar

import numpy as np
import numpy.typing as npt

from marsupial.model.grid import OBSTACLE, UNKNOWN, Cell, CellArray
from marsupial.model.mission import (
    ActionEnd,
    ActionEnded,
    ActionStarted,
    DriveEnded,
    DriveStarted,
    MissionEnded,
    MissionEvent,
    MissionStarted,
    Planned,
    Revealed,
    RobotLost,
)
from marsupial.model.plan import Action, ActionName
from marsupial.paths.routes import passing_times_ms, route_of

T = TypeVar("T")


@dataclass(frozen=True, slots=True, kw_only=True)
class RobotView:
    """One robot at one moment.

    Parameters
    ----------
    x, y
        Where it is, in cells.
    carrier
        The carrier it is aboard, or None.
    cargo
        The rovers aboard it, in the order of the team.
    action
        The action it takes part in, or None.
    """

    name: str
    type: str
    x: float
    y: float
    carrier: str | None
    cargo: tuple[str, ...]
    action: Action | None
    lost: bool


@dataclass(frozen=True, slots=True, kw_only=True)
class FleetState:
    """All robots at one moment, in the order of the team."""

    t_ms: int
    robots: tuple[RobotView, ...]

    def robot(self, name: str) -> RobotView:
        """Return the robot with that name."""
        return next(robot for robot in self.robots if robot.name == name)


@dataclass(frozen=True, slots=True, kw_only=True)
class Segment:
    """A piece of a robot's timeline: one action from its start to its end.

    `end` is None for an action still running when the log stops.
    """

    start_ms: int
    end_ms: int
    revision: int
    action: Action
    end: ActionEnd | None


@dataclass(frozen=True, slots=True, kw_only=True)
class CoveragePoint:
    """How much was known from `t_ms` on: area (m2) of all cells seen, and of those that are no obstacles."""

    t_ms: int
    seen_m2: float
    open_m2: float


@dataclass(frozen=True, slots=True)
class _Leg:
    """What a robot does from one moment on: drive along cells passed at `times`, stand (one cell), or be carried."""

    times: npt.NDArray[np.float64]
    cells: npt.NDArray[np.float64]
    carrier: str | None = None

    def at(self, t_ms: int) -> tuple[float, float]:
        x, y = (float(np.interp(t_ms, self.times, self.cells[:, axis])) for axis in (0, 1))
        return x, y


class _History(Generic[T]):
    """Values that hold from a moment on, added in order of time."""

    def __init__(self) -> None:
        self._times: list[int] = []
        self._values: list[T] = []

    def add(self, t_ms: int, value: T) -> None:
        self._times.append(t_ms)
        self._values.append(value)

    def at(self, t_ms: int) -> T | None:
        index = bisect_right(self._times, t_ms) - 1
        return self._values[index] if index >= 0 else None


class _Map:
    """The known map, carried forward from reveal to reveal and begun anew to go back."""

    def __init__(self, mission: MissionStarted, reveals: Sequence[Revealed]) -> None:
        self._cells = np.full((mission.height, mission.width), UNKNOWN, dtype=np.uint8)
        self._reveals = reveals
        self._times = [event.t_ms for event in reveals]
        self._done = 0

    def at(self, t_ms: int) -> CellArray:
        wanted = bisect_right(self._times, t_ms)
        if wanted < self._done:
            self._cells.fill(UNKNOWN)
            self._done = 0
        flat = self._cells.reshape(-1)
        for event in self._reveals[self._done : wanted]:
            for i in range(0, len(event.runs), 3):
                start, length, code = event.runs[i : i + 3]
                flat[start : start + length] = code
        self._done = wanted
        return self._cells.copy()


class Playback:
    """Answers what was the case at any moment of a mission.

    Parameters
    ----------
    events
        As `marsupial.formats.missionlog.read_log` checks them; a mission whose end is missing plays to its last event.
    """

    def __init__(self, events: Sequence[MissionEvent]) -> None:
        mission = events[0]
        assert isinstance(mission, MissionStarted)
        self.mission = mission
        self.events = tuple(events)
        self.start_ms = mission.t_ms
        self.end_ms = events[-1].t_ms
        self.plans = tuple(event for event in events if isinstance(event, Planned))
        self.ended = events[-1] if isinstance(events[-1], MissionEnded) else None
        reveals = tuple(event for event in events if isinstance(event, Revealed))
        self._map = _Map(mission, reveals)
        self.coverage = _coverage(mission, reveals)
        recorder = _Recorder(mission)
        for event in events:
            recorder.record(event)
        recorder.close(self.end_ms)
        self._legs, self._actions, self._lost = recorder.legs, recorder.actions, recorder.lost
        self.timeline = {name: tuple(segments) for name, segments in recorder.segments.items()}

    @property
    def duration_ms(self) -> int:
        """Time from the first event to the last."""
        return self.end_ms - self.start_ms

    def state_at(self, t_ms: int) -> FleetState:
        """Return the team at `t_ms`; a moment outside the mission counts as its start or end."""
        t_ms = min(max(t_ms, self.start_ms), self.end_ms)
        names = [robot.name for robot in self.mission.robots]
        carriers = {name: self._leg(name, t_ms).carrier for name in names}
        views = []
        for robot in self.mission.robots:
            x, y = self._leg(carriers[robot.name] or robot.name, t_ms).at(t_ms)
            view = RobotView(
                name=robot.name,
                type=robot.type,
                x=x,
                y=y,
                carrier=carriers[robot.name],
                cargo=tuple(name for name in names if carriers[name] == robot.name),
                action=self._actions[robot.name].at(t_ms),
                lost=t_ms >= self._lost.get(robot.name, self.end_ms + 1),
            )
            views.append(view)
        return FleetState(t_ms=t_ms, robots=tuple(views))

    def cells_at(self, t_ms: int) -> CellArray:
        """Return the known map at `t_ms`, uint8 (height, width).

        Moments in growing order cost only what is new between them; going back costs the way from the start.
        """
        return self._map.at(t_ms)

    def coverage_at(self, t_ms: int) -> CoveragePoint:
        """Return how much was known at `t_ms`."""
        index = bisect_right(self.coverage, t_ms, key=lambda point: point.t_ms) - 1
        return self.coverage[max(index, 0)]

    def plan_at(self, t_ms: int) -> Planned | None:
        """Return the plan followed at `t_ms`, or None before the first."""
        index = bisect_right(self.plans, t_ms, key=lambda plan: plan.t_ms) - 1
        return self.plans[index] if index >= 0 else None

    def _leg(self, robot: str, t_ms: int) -> _Leg:
        leg = self._legs[robot].at(t_ms)
        assert leg is not None, "every robot has a leg from the start of the mission"
        return leg


class _Recorder:
    """Turns the events, one after the other, into each robot's legs, actions and timeline."""

    def __init__(self, mission: MissionStarted) -> None:
        self.legs: dict[str, _History[_Leg]] = {robot.name: _History() for robot in mission.robots}
        self.actions: dict[str, _History[Action | None]] = {robot.name: _History() for robot in mission.robots}
        self.segments: dict[str, list[Segment]] = {robot.name: [] for robot in mission.robots}
        self.lost: dict[str, int] = {}
        self._resolution_m = mission.resolution_m
        speeds = {kind.name: kind.speed_mps for kind in mission.types}
        self._speeds = {robot.name: speeds[robot.type] for robot in mission.robots}
        self._running: dict[str, ActionStarted] = {}
        for robot in mission.robots:
            leg = _aboard(robot.carrier) if robot.cell is None else _standing(robot.cell)
            self.legs[robot.name].add(mission.t_ms, leg)

    def record(self, event: MissionEvent) -> None:
        if isinstance(event, DriveStarted):
            leg = _driving(event, self._resolution_m, self._speeds[event.robot])
            self.legs[event.robot].add(event.t_ms, leg)
        elif isinstance(event, DriveEnded):
            self.legs[event.robot].add(event.t_ms, _standing(event.cell))
        elif isinstance(event, ActionStarted):
            self._start(event)
        elif isinstance(event, ActionEnded):
            self._end(event)
        elif isinstance(event, RobotLost):
            self.lost[event.robot] = event.t_ms

    def close(self, t_ms: int) -> None:
        """End the timeline where the log stops."""
        for robot in list(self._running):
            self._finish(robot, t_ms, None)

    def _start(self, event: ActionStarted) -> None:
        for robot in event.action.robots:
            if robot in self._running:
                self._finish(robot, event.t_ms, None)
            self._running[robot] = event
            self.actions[robot].add(event.t_ms, event.action)
        if event.action.name in (ActionName.DOCK, ActionName.UNDOCK):
            self.legs[event.action.robot].add(event.t_ms, _standing(event.cell))

    def _end(self, event: ActionEnded) -> None:
        for robot in event.action.robots:
            if robot in self._running:
                self._finish(robot, event.t_ms, event.end)
                self.actions[robot].add(event.t_ms, None)
        if (event.action.name, event.end) in _LEAVES_ABOARD:
            self.legs[event.action.robot].add(event.t_ms, _aboard(event.action.carrier))

    def _finish(self, robot: str, t_ms: int, end: ActionEnd | None) -> None:
        started = self._running.pop(robot)
        segment = Segment(start_ms=started.t_ms, end_ms=t_ms, revision=started.revision, action=started.action, end=end)
        self.segments[robot].append(segment)


_LEAVES_ABOARD = {(ActionName.DOCK, ActionEnd.DONE), (ActionName.UNDOCK, ActionEnd.FAILED)}


def _standing(cell: Cell) -> _Leg:
    return _Leg(np.zeros(1), np.array([cell], dtype=np.float64))


def _aboard(carrier: str | None) -> _Leg:
    return _Leg(np.zeros(1), np.zeros((1, 2)), carrier)


def _driving(event: DriveStarted, resolution_m: float, speed_mps: float) -> _Leg:
    route = route_of(event.cell, event.steps)
    times = event.t_ms + passing_times_ms(route, resolution_m, speed_mps)
    return _Leg(times.astype(np.float64), np.array(route, dtype=np.float64))


def _coverage(mission: MissionStarted, reveals: Sequence[Revealed]) -> tuple[CoveragePoint, ...]:
    """Return the area known after each moment of news, from nothing at the start."""
    area_m2 = mission.resolution_m * mission.resolution_m
    points = {mission.t_ms: (0, 0)}
    seen = open_cells = 0
    for event in reveals:
        lengths = event.runs[1::3]
        seen += sum(lengths)
        open_cells += sum(n for n, code in zip(lengths, event.runs[2::3], strict=True) if code != OBSTACLE)
        points[event.t_ms] = (seen, open_cells)
    return tuple(
        CoveragePoint(t_ms=t_ms, seen_m2=seen * area_m2, open_m2=open_cells * area_m2)
        for t_ms, (seen, open_cells) in points.items()
    )
