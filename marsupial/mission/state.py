"""Tracks the state of a mission from its events: robots and their actions, the known map, the current plan.

`MissionTracker` is an observer that keeps the state after the latest event; `views` interpolates it to any moment until
the next one. Positions are in cells: (x, y) is the centre of cell (x, y). A driving robot is between two cells of its
route, as the passing times of `DriveStarted` say.
"""

from bisect import bisect_right
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from marsupial.mission.observer import Observer
from marsupial.model import UNKNOWN, Action, Cell, CellArray, FrameShift, RobotType, Whereabouts
from marsupial.model import mission as log
from marsupial.model.frames import moved_plan
from marsupial.model.runs import drawn, paint
from marsupial.model.zones import ZoneChange, Zones, changed
from marsupial.paths.routes import heading_of, passing_times_ms, route_of


@dataclass(frozen=True, slots=True, kw_only=True)
class RobotView:
    """One robot at one moment."""

    name: str
    type: str
    x: float  # in cells
    y: float
    carrier: str | None  # the carrier it is aboard, or None
    cargo: tuple[str, ...]  # the rovers aboard it, in team order
    action: Action | None  # the running action
    lost: bool


@dataclass(frozen=True, slots=True)
class Leg:
    """A drive: the cells of its route and their passing times. A standing robot has a route of one cell."""

    cells: tuple[Cell, ...]
    times_ms: tuple[int, ...] = (0,)

    def passed(self, t_ms: int) -> Cell:
        """Return the last cell passed."""
        return self.cells[max(bisect_right(self.times_ms, t_ms) - 1, 0)]

    def ahead(self, t_ms: int) -> tuple[Cell, int]:
        """Return the next cell, or else the last, and its passing time."""
        step = min(bisect_right(self.times_ms, t_ms), len(self.cells) - 1)
        return self.cells[step], self.times_ms[step]

    def heading(self, t_ms: int) -> int | None:
        """Return the digit of the step to that cell; None for a standing robot."""
        step = min(bisect_right(self.times_ms, t_ms), len(self.cells) - 1)
        return heading_of(self.cells[step - 1], self.cells[step]) if step else None

    def at(self, t_ms: int) -> tuple[float, float]:
        """Return the position, interpolated between two cells."""
        x, y = (float(np.interp(t_ms, self.times_ms, [cell[axis] for cell in self.cells])) for axis in (0, 1))
        return x, y


@dataclass(frozen=True, slots=True, kw_only=True)
class Track:
    """One robot after an event."""

    kind: RobotType
    where: Whereabouts[Leg]
    heading: int | None = None  # its heading while it stands; None if undefined
    running: log.ActionStarted | None = None  # the event that started its running action
    lost: bool = False
    speed: float = 1.0  # share of its type's speed at which it drives
    away: log.ContactLost | None = None  # since when it is out of contact, and where it is expected


Tracks = Mapping[str, Track]  # all robots by name, in team order


class MissionTracker(Observer):
    """Keeps the state after the events so far."""

    def __init__(self) -> None:
        self.t_ms = 0
        self.tracks: Tracks = {}  # replaced at each change, so old ones can be kept
        self.cells: CellArray = np.zeros((0, 0), dtype=np.uint8)  # the known map (height, width)
        self.plan: log.Planned | None = None
        self.zones: Zones = {}  # that hold
        self._resolution_m = 1.0

    def event(self, event: log.MissionEvent) -> None:
        self.t_ms = event.t_ms
        match event:
            case log.MissionStarted():
                self._start(event)
            case log.Revealed() | log.Changed():
                paint(self.cells, event.runs)
            case log.FrameGrown():
                self._grow(event)
            case log.ZoneChanged():
                self.zones = changed(self.zones, [ZoneChange(name=event.name, zone=event.zone)])
            case log.Planned():
                self.plan = event
            case log.DriveStarted():
                self._place(event.robot, self._drive(event), self.tracks[event.robot].heading)
            case log.DriveEnded():
                self._place(event.robot, Leg((event.cell,)), self._heading_after(event))
            case log.ActionStarted():
                self._action_started(event)
            case log.ActionEnded():
                self._action_ended(event)
            case log.RobotLost():
                self._change(event.robot, replace(self.tracks[event.robot], lost=True))
            case log.RobotReturned():
                self._change(event.robot, replace(self.tracks[event.robot], lost=False))
            case log.ContactLost():
                self._change(event.robot, replace(self.tracks[event.robot], away=event))
            case log.ContactRegained():
                self._change(event.robot, replace(self.tracks[event.robot], away=None))
            case log.SpeedChanged():
                self._change(event.robot, replace(self.tracks[event.robot], speed=event.share))

    def _start(self, mission: log.MissionStarted) -> None:
        kinds = {kind.name: kind for kind in mission.types}
        self.cells = drawn((), (mission.height, mission.width))
        self._resolution_m = mission.resolution_m
        self.tracks = {
            robot.name: Track(
                kind=kinds[robot.type],
                where=Whereabouts(None if robot.cell is None else Leg((robot.cell,)), robot.carrier),
            )
            for robot in mission.robots
        }

    def _grow(self, event: log.FrameGrown) -> None:
        shift = FrameShift(event.shift, self.cells.shape[1], event.width, event.height)
        self.cells = shift.laid_out(self.cells, UNKNOWN)
        self.plan = None if self.plan is None else moved_plan(self.plan, shift)
        self.tracks = {name: _moved(track, shift) for name, track in self.tracks.items()}

    def _drive(self, event: log.DriveStarted) -> Leg:
        route = route_of(event.cell, event.steps)
        track = self.tracks[event.robot]
        speed_mps = track.kind.speed_mps * track.speed
        times = passing_times_ms(route, self._resolution_m, speed_mps, track.kind.diagonal)
        return Leg(tuple(route), tuple((event.t_ms + times).tolist()))

    def _heading_after(self, event: log.DriveEnded) -> int | None:
        """Return the heading of a robot at the end of its drive."""
        track = self.tracks[event.robot]
        leg = track.where.at
        # a robot that was stopped before its first step keeps its former heading
        if leg is None or event.cell not in leg.cells[1:]:
            return track.heading
        step = leg.cells.index(event.cell, 1)
        return heading_of(leg.cells[step - 1], leg.cells[step])

    def _action_started(self, event: log.ActionStarted) -> None:
        action = event.action
        for name in action.robots:
            self._change(name, replace(self.tracks[name], running=event))
        if action.carrier is not None:
            track = self.tracks[action.robot]
            where = track.where.begun(action.name, Leg((event.cell,)), action.carrier)
            self._change(action.robot, replace(track, where=where, heading=None))

    def _action_ended(self, event: log.ActionEnded) -> None:
        action = event.action
        for name in action.robots:
            self._change(name, replace(self.tracks[name], running=None))
        if action.carrier is not None:
            track = self.tracks[action.robot]
            self._change(action.robot, replace(track, where=track.where.ended(action.name, event.end)))

    def _place(self, name: str, leg: Leg, heading: int | None) -> None:
        # a rover may still drive to its docking cell after its docking has begun
        where = Whereabouts(leg, self.tracks[name].where.carrier)
        self._change(name, replace(self.tracks[name], where=where, heading=heading))

    def _change(self, name: str, track: Track) -> None:
        # copy: playback keeps the mappings of all moments
        self.tracks = {**self.tracks, name: track}


def views(tracks: Tracks, t_ms: int, *, whole_cells: bool = False) -> tuple[RobotView, ...]:
    """Return the robots at a moment after the latest event; with `whole_cells` at the last cell they passed."""
    seen = []
    for name, track in tracks.items():
        aboard = track.where.aboard
        # a rover aboard is where its carrier is
        leg = (track if aboard is None else tracks[aboard]).where.at
        assert leg is not None, "carriers are never carried"
        x, y = leg.passed(t_ms) if whole_cells else leg.at(t_ms)
        cargo = tuple(other for other, rover in tracks.items() if rover.where.aboard == name)
        action = None if track.running is None else track.running.action
        view = RobotView(
            name=name, type=track.kind.name, x=x, y=y, carrier=aboard, cargo=cargo, action=action, lost=track.lost
        )
        seen.append(view)
    return tuple(seen)


def _moved(track: Track, shift: FrameShift) -> Track:
    at, running = track.where.at, track.running
    if at is not None:
        at = Leg(tuple(map(shift.cell, at.cells)), at.times_ms)
    if running is not None:
        running = replace(running, cell=shift.cell(running.cell))
    return replace(track, where=replace(track.where, at=at), running=running)
