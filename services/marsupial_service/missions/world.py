"""The world of a mission as its client reports it: robots that are told what to do, and news when they have done it.

Mission time is the client's: it advances with each report. What a report does not say of a robot is as it was foreseen
when its command was given.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Protocol

import numpy as np
import numpy.typing as npt

from marsupial.errors import InternalError
from marsupial.mission.goals import homes_of
from marsupial.model.grid import UNKNOWN, Cell, CellArray, Grid
from marsupial.model.mission import ActionEnd, PlacedRobot
from marsupial.model.plan import ActionName
from marsupial.model.robots import RobotType
from marsupial.model.team import Whereabouts
from marsupial.model.world import Manoeuvres, News, RobotReport
from marsupial.paths.headings import Odometer
from marsupial.paths.routes import passing_times_ms
from marsupial_service.missions.frames import Frame, laid_out, placed
from marsupial_service.missions.gathered import Gathered
from marsupial_service.missions.values import Brief, Input, Report, RobotNote, Wish, expand

MOST_FAILURES = 3
"""A robot that fails so often, one command after the other, counts as lost."""

PAUSED = "paused"


PAUSE_MS = 60_000
"""How far ahead, at least, the next report is asked for during a pause: nothing is to be looked at till it is over."""


@dataclass(slots=True, kw_only=True)
class RobotCommand:
    """A command that was given and has not ended.

    Parameters
    ----------
    route, passed
        Of a drive: its cells, and the index of the one the robot is at or next at.
    cell
        Where the rover docks, or where it is put by an undocking.
    stopped, halted
        Whether it was told to stop, and whether that was because of a pause.
    """

    id: int
    name: str
    robot: str
    carrier: str | None = None
    route: tuple[Cell, ...] = ()
    cell: Cell | None = None
    passed: int = 0
    stopped: bool = False
    halted: bool = False

    @property
    def robots(self) -> tuple[str, ...]:
        """The robots in it, in the order of their names."""
        return (self.robot,) if self.carrier is None else tuple(sorted((self.robot, self.carrier)))


class Exchange(Protocol):
    """Where commands go out and reports come in."""

    def order(self, order: RobotCommand, *, stop: bool = False) -> None:
        """Put a command among those to be sent next, or that it is to stop."""
        ...

    def exchange(self, until_ms: int) -> Input:
        """Send everything there is, to be answered by `until_ms`, and wait for the next input."""
        ...


@dataclass(slots=True)
class _Robot:
    kind: RobotType
    where: Whereabouts[Cell]
    free_at_ms: int = 0
    lost: bool = False
    order: RobotCommand | None = None
    failures: int = 0
    distance_m: float = 0.0
    driving_ms: int = 0
    odometer: Odometer = field(default_factory=Odometer)
    told_ms: int = 0

    @property
    def cell(self) -> Cell | None:
        return None if self.where.carrier is not None else self.where.at

    @property
    def carrier(self) -> str | None:
        return self.where.carrier

    def passes(self, cell: Cell) -> None:
        """Count the turns of the route up to a cell of it; off the route nobody knows which way the robot faces."""
        order = self.order
        if order is None or not order.route or cell == order.route[order.passed]:
            return
        if cell not in order.route[order.passed :]:
            self.odometer.heading = None
            return
        while order.route[order.passed] != cell:
            self.odometer.step(order.route[order.passed], order.route[order.passed + 1])
            order.passed += 1


class RemoteWorld:
    """A `World` made of reports.

    Attributes
    ----------
    cancelled
        Whether the client wants the mission to end.
    """

    def __init__(self, brief: Brief, desk: Exchange) -> None:
        self._desk = desk
        self._first = brief.grid
        self._frame = Frame.of(brief.grid)
        self._limit_ms = brief.limits.time_ms
        kinds = {kind.name: kind for kind in brief.kinds}
        self._robots = {r.name: _Robot(kind=kinds[r.type], where=Whereabouts(r.cell, r.carrier)) for r in brief.robots}
        self._cells = np.full_like(brief.grid.cells, UNKNOWN)
        self._grid = replace(brief.grid, cells=self._cells)
        self._orders: dict[int, RobotCommand] = {}
        self._count = 0
        self._now_ms = 0
        self._paused = self._begun = False
        self._gathered = Gathered()
        self._redraw(next(iter(self._robots)), brief.grid.cells)
        self.cancelled = False
        self.homes = homes_of(self.robots(), kinds)

    @property
    def grid(self) -> Grid:
        """The known map."""
        return self._grid

    @property
    def now_ms(self) -> int:
        """The time of the last report."""
        return self._now_ms

    def robots(self) -> tuple[RobotReport, ...]:
        """Return every robot of the team."""
        return tuple(
            RobotReport(
                name=name,
                type=robot.kind.name,
                cell=robot.cell,
                carrier=robot.carrier,
                free_at_ms=max(robot.free_at_ms, self._now_ms),
                lost=robot.lost,
                heading=robot.odometer.heading,
            )
            for name, robot in self._robots.items()
        )

    def placed(self) -> tuple[PlacedRobot, ...]:
        """Return where the robots are, for the first line of a log."""
        return tuple(PlacedRobot(name=r.name, type=r.type, cell=r.cell, carrier=r.carrier) for r in self.robots())

    def distance_m(self, robot: str) -> float:
        """Return how far a robot has driven."""
        return self._robots[robot].distance_m

    def driving_ms(self, robot: str) -> int:
        """Return how long a robot has been driving."""
        return self._robots[robot].driving_ms

    def manoeuvres(self, robot: str) -> Manoeuvres:
        """Return how often a robot has stopped and turned, as far as it kept to its routes."""
        return self._robots[robot].odometer.manoeuvres

    def drive(self, robot: str, route: Sequence[Cell]) -> None:
        """Send a free robot along `route`."""
        mover = self._free(robot)
        kind = mover.kind
        times = passing_times_ms(route, self._grid.resolution_m, kind.speed_mps, kind.diagonal)
        step = min(1, len(route) - 1)
        mover.where, mover.free_at_ms = Whereabouts(route[step]), self._now_ms + int(times[step])
        mover.odometer.set_off(self._now_ms)
        self._give(RobotCommand(id=self._count + 1, name="drive", robot=robot, route=tuple(route)))
        mover.passes(route[step])

    def stop(self, robot: str) -> None:
        """Let a driving robot stop."""
        order = self._robots[robot].order
        if order is not None and order.name == "drive" and not order.stopped:
            order.stopped = True
            self._desk.order(order, stop=True)

    def dock(self, rover: str, carrier: str) -> None:
        """Let a free rover dock on a free carrier."""
        self._together(ActionName.DOCK, rover, carrier, self._robots[rover].cell)

    def undock(self, rover: str, carrier: str, cell: Cell) -> None:
        """Let a free carrier set down one of its rovers."""
        self._together(ActionName.UNDOCK, rover, carrier, cell)

    def advance(self, until_ms: int) -> News:
        """Wait for the next report and say what is new; while paused, for all until that ends.

        A mission begins with a report, even if it was paused and resumed before.
        """
        self._next(until_ms)
        while not self.cancelled and (self._paused or not self._begun):
            self._next(max(self._limit_ms, self._now_ms + PAUSE_MS) if self._paused else until_ms)
        news, self._gathered = self._gathered.at(self._now_ms, self._cells.reshape(-1)), Gathered()
        return news

    def stop_all(self, *, halted: bool = False) -> None:
        """Let all robots that drive stop: until a pause ends if `halted`, else for good."""
        for name, robot in self._robots.items():
            if robot.order is not None and robot.order.name == "drive" and not robot.order.stopped:
                robot.order.halted = halted
                self.stop(name)

    def _free(self, name: str) -> _Robot:
        robot = self._robots[name]
        if robot.order is not None or robot.lost:
            raise InternalError(f"{name} is not free: {'lost' if robot.lost else robot.order}")
        return robot

    def _together(self, name: ActionName, rover: str, carrier: str, cell: Cell | None) -> None:
        guest, host = self._free(rover), self._free(carrier)
        if cell is None:
            raise InternalError(f"{rover} is aboard {guest.carrier}")
        guest.where = guest.where.begun(name, cell, carrier)
        if name is ActionName.DOCK:
            guest.odometer.lift()
        took_ms = guest.kind.dock_ms if name is ActionName.DOCK else guest.kind.undock_ms
        guest.free_at_ms = host.free_at_ms = self._now_ms + took_ms
        self._give(RobotCommand(id=self._count + 1, name=name, robot=rover, carrier=carrier, cell=cell))

    def _give(self, order: RobotCommand) -> None:
        self._count = order.id
        self._orders[order.id] = order
        for name in order.robots:
            self._robots[name].order = order
        self._desk.order(order)

    def _next(self, until_ms: int) -> None:
        """Take the next input in."""
        match self._desk.exchange(until_ms):
            case Report() as report:
                self._take(report)
            case Wish.PAUSE:
                self._paused = True
                self.stop_all(halted=True)
            case Wish.RESUME:
                self._paused = False
            case Wish.CANCEL:
                self.cancelled = True

    def _take(self, report: Report) -> None:
        since_ms, self._now_ms, self._begun = self._now_ms, max(self._now_ms, report.t_ms), True
        if report.robot is not None:
            teller, self._gathered.partial = self._robots[report.robot], True
            since_ms, teller.told_ms = teller.told_ms, self._now_ms
        of = Frame.of(self._first) if report.frame is None else report.frame
        self._grow(self._frame.grown(of))
        for name, runs in report.revealed:
            indices, codes = expand(runs)
            self._see(name, placed(indices, of, self._frame), codes)
        if report.map is not None:
            self._redraw(report.robot or next(iter(self._robots)), laid_out(report.map, of, self._frame))
        shift = None if of == self._frame else of.shift_to(self._frame)
        for note in report.robots:
            if not self._robots[note.name].lost:
                cell = note.cell if shift is None or note.cell is None else shift.cell(note.cell)
                self._note(self._robots[note.name], note, cell, since_ms)
        for number in report.finished:
            self._finish(number)
        for number, reason in report.failed:
            self._fail(number, reason)
        for name, reason in report.lost:
            self._lose(name, reason)

    def _grow(self, frame: Frame) -> None:
        """Let the map have a frame that holds the one it has."""
        if frame == self._frame:
            return
        shift = self._frame.shift_to(frame)
        self._cells, self._frame = laid_out(self._cells, self._frame, frame), frame
        self._grid = frame.grid(self._first, self._cells)
        self._gathered.move(shift)
        for robot in self._robots.values():
            if robot.where.at is not None:
                robot.where = replace(robot.where, at=shift.cell(robot.where.at))
        for order in self._orders.values():
            order.route = tuple(map(shift.cell, order.route))
            order.cell = None if order.cell is None else shift.cell(order.cell)

    def _redraw(self, name: str, cells: CellArray) -> None:
        """Take in a whole map (height, width) as if a robot had seen it."""
        flat = cells.ravel()
        indices = np.flatnonzero(flat != self._cells.ravel())
        self._see(name, indices, flat[indices])

    def _see(self, name: str, indices: npt.NDArray[np.int64], codes: npt.NDArray[np.uint8]) -> None:
        """Take in cells by their row-major indices."""
        flat = self._cells.reshape(-1)
        before = flat[indices]
        flat[indices] = codes
        self._gathered.see(name, indices, before, codes)

    def _note(self, robot: _Robot, note: RobotNote, cell: Cell | None, since_ms: int) -> None:
        drives = robot.order is not None and robot.order.name == "drive"
        moved_m = 0.0
        if cell is not None and robot.cell is not None:
            moved_m = math.dist(robot.cell, cell) * self._grid.resolution_m
            if moved_m:
                robot.where = replace(robot.where, at=cell)
            robot.free_at_ms = self._now_ms
            robot.passes(cell)
        if note.free_at_ms is not None:
            robot.free_at_ms = note.free_at_ms
        robot.distance_m = robot.distance_m + moved_m if note.distance_m is None else note.distance_m
        if note.driving_ms is not None:
            robot.driving_ms = note.driving_ms
        elif drives:
            robot.driving_ms += self._now_ms - since_ms

    def _finish(self, number: int) -> None:
        order = self._end(number)
        if order is None:
            return
        if order.halted and self._robots[order.robot].cell != order.route[-1]:
            self._gathered.failed.append((order.robot, PAUSED))
            return
        for name in order.robots:
            self._robots[name].failures = 0
        self._enter(order, ActionEnd.DONE)
        self._gathered.finished += order.robots

    def _fail(self, number: int, reason: str) -> None:
        order = self._end(number)
        if order is None:
            return
        self._enter(order, ActionEnd.FAILED)
        self._gathered.failed += [(name, reason) for name in order.robots]
        for name in order.robots:
            self._robots[name].failures += 1
            if self._robots[name].failures >= MOST_FAILURES:
                self._lose(name, f"failed {MOST_FAILURES} times in a row: {reason}")

    def _enter(self, order: RobotCommand, end: ActionEnd) -> None:
        if order.carrier is not None:
            rover = self._robots[order.robot]
            rover.where = rover.where.ended(ActionName(order.name), end)

    def _end(self, number: int) -> RobotCommand | None:
        order = self._orders.pop(number, None)  # None: it ended when one of its robots was lost
        if order is not None:
            for name in order.robots:
                self._robots[name].order = None
                self._robots[name].free_at_ms = self._now_ms
            if order.name == "drive":
                self._robots[order.robot].odometer.arrive(self._now_ms)
        return order

    def _lose(self, name: str, reason: str) -> None:
        robot = self._robots[name]
        if robot.lost:
            return
        robot.lost = True
        if robot.order is not None:
            order = self._end(robot.order.id)
            if order is not None and order.name == ActionName.DOCK and order.carrier == name:
                self._enter(order, ActionEnd.FAILED)
        self._gathered.lost.append((name, reason))
        for rider, other in self._robots.items():
            if other.carrier == name:
                self._lose(rider, f"aboard {name}, which is lost")
