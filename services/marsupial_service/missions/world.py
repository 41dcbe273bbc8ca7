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
from marsupial.mission.loop import homes_of
from marsupial.model.grid import UNKNOWN, Cell, Grid
from marsupial.model.mission import ActionEnd, PlacedRobot
from marsupial.model.plan import ActionName
from marsupial.model.robots import RobotType
from marsupial.model.team import Whereabouts
from marsupial.model.world import Manoeuvres, News, RobotReport
from marsupial.paths.headings import Odometer
from marsupial.paths.routes import passing_times_ms
from marsupial_service.missions.values import Brief, Input, Report, RobotNote, Wish, expand

MOST_FAILURES = 3
"""A robot that fails so often, one command after the other, counts as lost."""

PAUSED = "paused"


class MapChanged(Exception):
    """Cells that were known are different now: what was planned and analysed is worth nothing."""


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


@dataclass(slots=True)
class _Gathered:
    """News in the making."""

    revealed: list[tuple[str, npt.NDArray[np.int64]]] = field(default_factory=list)
    finished: list[str] = field(default_factory=list)
    failed: list[tuple[str, str]] = field(default_factory=list)
    lost: list[tuple[str, str]] = field(default_factory=list)

    def at(self, t_ms: int) -> News:
        return News(
            t_ms=t_ms,
            revealed=tuple(self.revealed),
            finished=tuple(self.finished),
            failed=tuple(self.failed),
            lost=tuple(self.lost),
        )


class RemoteWorld:
    """A `World` made of reports.

    Attributes
    ----------
    cancelled
        Whether the client wants the mission to end.
    """

    def __init__(self, brief: Brief, desk: Exchange) -> None:
        self._desk = desk
        kinds = {kind.name: kind for kind in brief.kinds}
        self._robots = {r.name: _Robot(kind=kinds[r.type], where=Whereabouts(r.cell, r.carrier)) for r in brief.robots}
        self._cells = np.full_like(brief.grid.cells, UNKNOWN)
        self._grid = replace(brief.grid, cells=self._cells)
        self._orders: dict[int, RobotCommand] = {}
        self._count = 0
        self._now_ms = 0
        self._paused = self._begun = False
        self._gathered = _Gathered()
        self._reveal(brief.grid.cells)
        self._settled = False
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

        A mission begins with a report, even if it was paused and resumed before. Raises MapChanged.
        """
        if not self._settled:
            changed = self._next(until_ms)
            while not changed and not self.cancelled and (self._paused or not self._begun):
                changed = self._next(until_ms)
            if changed:
                raise MapChanged
        self._settled = False
        news, self._gathered = self._gathered.at(self._now_ms), _Gathered()
        return news

    def settle(self, until_ms: int) -> None:
        """After `MapChanged`: let all robots stop, and begin with nothing but what is known now."""
        self.stop_all()
        while (self._paused or self._orders) and not self.cancelled:
            self._next(until_ms)
        known, self._cells = self._cells, np.full_like(self._cells, UNKNOWN)
        self._grid = replace(self._grid, cells=self._cells)
        self._gathered = _Gathered()
        self._reveal(known)
        self._settled = True

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

    def _next(self, until_ms: int) -> bool:
        """Take the next input in; return whether the map has changed."""
        match self._desk.exchange(until_ms):
            case Report() as report:
                return self._take(report)
            case Wish.PAUSE:
                self._paused = True
                self.stop_all(halted=True)
            case Wish.RESUME:
                self._paused = False
            case Wish.CANCEL:
                self.cancelled = True
        return False

    def _take(self, report: Report) -> bool:
        since_ms, self._now_ms, self._begun = self._now_ms, report.t_ms, True
        changed = False
        for name, runs in report.revealed:
            indices, codes = expand(runs)
            self._see(name, indices, codes)
        if report.map is not None:
            known = self._cells != UNKNOWN
            changed = bool(np.any(report.map[known] != self._cells[known]))
            if changed:
                self._cells = report.map.copy()
            else:
                self._reveal(report.map)
        for note in report.robots:
            if not self._robots[note.name].lost:
                self._note(self._robots[note.name], note, since_ms)
        for number in report.finished:
            self._finish(number)
        for number, reason in report.failed:
            self._fail(number, reason)
        for name, reason in report.lost:
            self._lose(name, reason)
        return changed

    def _reveal(self, cells: npt.NDArray[np.uint8]) -> None:
        """Take in cells as if the first robot had seen them."""
        flat = cells.ravel()
        indices = np.flatnonzero(flat != UNKNOWN)
        self._see(next(iter(self._robots)), indices, flat[indices])

    def _see(self, name: str, indices: npt.NDArray[np.int64], codes: npt.NDArray[np.uint8]) -> None:
        flat = self._cells.reshape(-1)
        new = flat[indices] == UNKNOWN
        if new.any():
            flat[indices[new]] = codes[new]
            self._gathered.revealed.append((name, indices[new]))

    def _note(self, robot: _Robot, note: RobotNote, since_ms: int) -> None:
        drives = robot.order is not None and robot.order.name == "drive"
        moved_m = 0.0
        if note.cell is not None and robot.cell is not None:
            moved_m = math.dist(robot.cell, note.cell) * self._grid.resolution_m
            robot.where, robot.free_at_ms = replace(robot.where, at=note.cell), self._now_ms
            robot.passes(note.cell)
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
