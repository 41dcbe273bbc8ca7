"""Plays a mission back from its events: robots and known map at any moment.

Films, figures and the replay page ask a `Playback`. The state at a moment includes all events of that moment.
"""

from bisect import bisect_right
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from marsupial.mission.state import MissionTracker, RobotView, Tracks, views
from marsupial.model import OBSTACLE, UNKNOWN, Action, CellArray
from marsupial.model import mission as log
from marsupial.model.frames import in_last_frame
from marsupial.model.runs import drawn, paint, triples


@dataclass(frozen=True, slots=True, kw_only=True)
class Segment:
    """One action in a robot's timeline; `end` is None if it was still running when the log stopped."""

    start_ms: int
    end_ms: int
    revision: int
    action: Action
    end: log.ActionEnd | None


@dataclass(frozen=True, slots=True, kw_only=True)
class CoveragePoint:
    """The known area from `t_ms` on, in m2: of all cells seen, and of those that are no obstacles."""

    t_ms: int
    seen_m2: float
    open_m2: float


CellEvent = log.Revealed | log.Changed


class Playback:
    """The state of a mission at any moment, with cells in the last frame; a mission may be unfinished."""

    def __init__(self, events: Sequence[log.MissionEvent]) -> None:
        events = in_last_frame(events)
        mission = log.started(events)
        self.mission = mission
        self.events = events
        self.start_ms = mission.t_ms
        self.end_ms = events[-1].t_ms
        self.plans = tuple(event for event in events if isinstance(event, log.Planned))
        self.ended = events[-1] if isinstance(events[-1], log.MissionEnded) else None
        reveals = tuple(event for event in events if isinstance(event, log.Revealed | log.Changed))
        # the known map after this number of reveals
        self._cells, self._reveals, self._painted = drawn((), (mission.height, mission.width)), reveals, 0
        self.coverage = _coverage(mission, reveals)
        self.timeline = _timeline(events)
        self.moments = _moments(events)

    @property
    def duration_ms(self) -> int:
        """Time from the first to the last event."""
        return self.end_ms - self.start_ms

    def robots_at(self, t_ms: int) -> tuple[RobotView, ...]:
        """Return all robots in team order; a moment outside the mission counts as its start or end."""
        t_ms = min(max(t_ms, self.start_ms), self.end_ms)
        return views(self.tracks_at(t_ms), t_ms)

    def tracks_at(self, t_ms: int) -> Tracks:
        """Return the robots with their drives; a moment before the mission counts as its start."""
        index = bisect_right(self.moments, t_ms, key=lambda moment: self.events[moment[0]].t_ms) - 1
        return self.moments[max(index, 0)][1]

    def cells_at(self, t_ms: int) -> CellArray:
        """Return the known map (height, width) at `t_ms`; going back in time rebuilds it from the start."""
        wanted = bisect_right(self._reveals, t_ms, key=lambda event: event.t_ms)
        if wanted < self._painted:
            self._cells.fill(UNKNOWN)
            self._painted = 0
        for event in self._reveals[self._painted : wanted]:
            paint(self._cells, event.runs)
        self._painted = wanted
        return self._cells.copy()

    def coverage_at(self, t_ms: int) -> CoveragePoint:
        """Return how much was known at `t_ms`."""
        index = bisect_right(self.coverage, t_ms, key=lambda point: point.t_ms) - 1
        return self.coverage[max(index, 0)]

    def plan_at(self, t_ms: int) -> log.Planned | None:
        """Return the plan followed at `t_ms`, or None before the first."""
        index = bisect_right(self.plans, t_ms, key=lambda plan: plan.t_ms) - 1
        return self.plans[index] if index >= 0 else None


def _moments(events: Sequence[log.MissionEvent]) -> tuple[tuple[int, Tracks], ...]:
    """Return the number of each event that changes robots, and the robots after it."""
    state = MissionTracker()
    moments: list[tuple[int, Tracks]] = []
    for number, event in enumerate(events):
        before = state.tracks
        state.event(event)
        if state.tracks is not before:
            moments.append((number, state.tracks))
    return tuple(moments)


def _timeline(events: Sequence[log.MissionEvent]) -> dict[str, tuple[Segment, ...]]:
    """Return each robot's actions; one without an end lasts until the next starts or the log stops."""
    mission = log.started(events)
    segments: dict[str, list[Segment]] = {robot.name: [] for robot in mission.robots}
    running: dict[str, log.ActionStarted] = {}

    def finish(robot: str, t_ms: int, end: log.ActionEnd | None) -> None:
        started = running.pop(robot, None)
        if started is not None:
            segment = Segment(
                start_ms=started.t_ms, end_ms=t_ms, revision=started.revision, action=started.action, end=end
            )
            segments[robot].append(segment)

    for event in events:
        if isinstance(event, log.ActionStarted | log.ActionEnded):
            for robot in event.action.robots:
                finish(robot, event.t_ms, event.end if isinstance(event, log.ActionEnded) else None)
                if isinstance(event, log.ActionStarted):
                    running[robot] = event
    for robot in list(running):
        finish(robot, events[-1].t_ms, None)
    return {name: tuple(found) for name, found in segments.items()}


def _coverage(mission: log.MissionStarted, reveals: Sequence[CellEvent]) -> tuple[CoveragePoint, ...]:
    """Return the known area after each moment at which it changed, starting with none."""
    area_m2 = mission.resolution_m * mission.resolution_m
    points = {mission.t_ms: (0, 0)}
    seen = open_cells = 0
    # the map itself is needed only if known cells change: otherwise areas just add up
    changes = any(isinstance(event, log.Changed) for event in reveals)
    cells = drawn((), (mission.height, mission.width)) if changes else None
    for event in reveals:
        known = sum(length for _, length, code in triples(event.runs) if code != UNKNOWN)
        now = known, known - sum(length for _, length, code in triples(event.runs) if code == OBSTACLE)
        before = (0, 0) if cells is None else _counts_before(cells, event)
        seen, open_cells = seen + now[0] - before[0], open_cells + now[1] - before[1]
        # the last count of a moment replaces the earlier ones
        points[event.t_ms] = (seen, open_cells)
    return tuple(
        CoveragePoint(t_ms=t_ms, seen_m2=seen * area_m2, open_m2=open_cells * area_m2)
        for t_ms, (seen, open_cells) in points.items()
    )


def _counts_before(cells: CellArray, event: CellEvent) -> tuple[int, int]:
    """Return how many of the event's cells were known, and how many of these free, before; write it to the map."""
    flat = cells.reshape(-1)
    parts = [flat[start : start + length] for start, length, _ in triples(event.runs)]
    known = sum(int(np.count_nonzero(part != UNKNOWN)) for part in parts)
    barred = sum(int(np.count_nonzero(part == OBSTACLE)) for part in parts)
    paint(cells, event.runs)
    return known, known - barred
