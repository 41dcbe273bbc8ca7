"""The world of a mission as its client reports it: commands go out, reports of their results come in.

Mission time is the client's: it advances with each report. Data that a report omits about a robot is as predicted when
its command was sent.
"""

import math
from collections.abc import Mapping, Sequence, Set
from dataclasses import replace
from typing import Protocol

import numpy as np

from marsupial.errors import InternalError
from marsupial.maps.discs import fits
from marsupial.mission.goals import homes_of
from marsupial.model.charges import BatteryUse, TeamCharges
from marsupial.model.frames import FrameShift
from marsupial.model.grid import UNKNOWN, Cell, Grid
from marsupial.model.mission import ActionEnd
from marsupial.model.missionframe import MissionFrame, embedded
from marsupial.model.plan import ActionName
from marsupial.model.team import Whereabouts
from marsupial.model.world import Manoeuvres, News, RobotReport
from marsupial.model.zones import ZoneChange
from marsupial.paths.routes import passed_cells, passing_times_ms
from marsupial_service.missions.commanded import CommandedRobot
from marsupial_service.missions.contact import ReportedContact
from marsupial_service.missions.pending import PendingNews
from marsupial_service.missions.reported import ReportedMap, ReportedTeam, RobotCommand
from marsupial_service.missions.values import Control, Input, MissionBrief, MissionReport
from marsupial_service.schemas.missions import RobotNoteBody

# a robot that fails this many commands in a row counts as lost; one that met changed ground has not failed
MOST_FAILURES = 3
# a robot whose reports take this share of charge from the estimates, in all, needs a new plan: plans keep a tenth
DRAINED = 0.05
PAUSED = "paused"
# the least time until the next report is due during a pause: nothing needs a check until the pause ends
PAUSE_MS = 60_000


class Exchange(Protocol):
    """Where commands go out and reports come in."""

    def order(self, order: RobotCommand, *, stop: bool = False) -> None:
        """Add a command, or the one to stop it, to those sent next."""

    def exchange(self, until_ms: int) -> Input:
        """Send everything pending, with an answer due by `until_ms`, and wait for the next input."""


class RemoteWorld:
    """A `World` made of reports; `cancelled` once the client wants the mission to end."""

    def __init__(self, brief: MissionBrief, process: Exchange) -> None:
        self._process = process
        self._first = brief.grid
        self._limit_ms = brief.limits.time_ms
        kinds = {kind.name: kind for kind in brief.kinds}
        first = MissionFrame.of(brief.grid)
        self._map = ReportedMap(np.full_like(brief.grid.cells, UNKNOWN), first, brief.margin)
        starts = {r.name: r.cell and first.shift_to(self._map.frame).cell(r.cell) for r in brief.robots}
        self._team = ReportedTeam(
            {
                r.name: CommandedRobot(kind=kinds[r.type], where=Whereabouts(starts[r.name], r.carrier))
                for r in brief.robots
            },
            brief.kind_of,
        )
        self._robots = self._team.robots
        self._charges = TeamCharges(brief.kind_of, self._use, lambda name: self._robots[name].where.aboard)
        self._grid = self._map.frame.grid(brief.grid, self._map.cells)
        self._count = self._now_ms = 0
        self._paused = self._begun = False
        self._contact = ReportedContact()
        self._pending = PendingNews()
        self._pending.add(
            next(iter(self._robots)), self._map.redraw(embedded(brief.grid.cells, first, self._map.frame))
        )
        self.cancelled = self.called_back = False
        self.homes = homes_of(self.robots(), kinds)

    @property
    def grid(self) -> Grid:
        return self._grid

    @property
    def now_ms(self) -> int:
        return self._now_ms

    def robots(self) -> tuple[RobotReport, ...]:
        return tuple(
            RobotReport(
                name=name,
                type=robot.kind.name,
                cell=robot.cell,
                carrier=robot.where.carrier,
                free_at_ms=max(robot.free_at_ms, self._now_ms),
                lost=robot.lost,
                returns=robot.lost and self._robots[robot.lost_with or name].returns,
                heading=robot.odometer.heading,
                speed=robot.speed,
                charge=None if robot.kind.battery is None else self._charges.reported(name, self._now_ms),
            )
            for name, robot in self._robots.items()
        )

    def distance_m(self, robot: str) -> float:
        return self._robots[robot].distance_m

    def driving_ms(self, robot: str) -> int:
        return self._robots[robot].driving_ms

    def manoeuvres(self, robot: str) -> Manoeuvres:
        # manoeuvres off its routes are unknown
        return self._robots[robot].odometer.manoeuvres

    def drive(self, robot: str, route: Sequence[Cell]) -> None:
        mover = self._free(robot)
        kind = mover.kind
        self._charges.settle(self._now_ms, robot)
        times = passing_times_ms(route, self._grid.resolution_m, kind.speed_mps * mover.speed, kind.diagonal)
        step = min(1, len(route) - 1)
        mover.where, mover.free_at_ms = Whereabouts(route[step]), self._now_ms + int(times[step])
        mover.before_ms = mover.driving_ms - self._now_ms
        mover.odometer.set_off(self._now_ms)
        self._send(RobotCommand(id=self._count + 1, name="drive", robot=robot, route=tuple(route)))
        mover.advance(route[step])
        mover.step_m = mover.step_cells() * self._grid.resolution_m

    def stop(self, robot: str) -> None:
        order = self._robots[robot].order
        if order is not None and order.name == "drive" and not order.stopped and robot not in self._contact:
            order.stopped = True
            self._process.order(order, stop=True)

    def dock(self, rover: str, carrier: str) -> None:
        self._hand_over(ActionName.DOCK, rover, carrier, self._robots[rover].cell)

    def undock(self, rover: str, carrier: str, cell: Cell) -> None:
        self._hand_over(ActionName.UNDOCK, rover, carrier, cell)

    def advance(self, until_ms: int) -> News:
        """Wait for the next report and return its news; while paused, for all reports until the pause ends."""
        self._apply_next(until_ms)
        # a mission begins with a report, even if it was paused and resumed before, or else it ends
        while not self.cancelled and (self._paused or not (self._begun or self.called_back)):
            self._apply_next(max(self._limit_ms, self._now_ms + PAUSE_MS) if self._paused else until_ms)
        self._contact.note(self._robots, self._pending)
        news, self._pending = self._pending.at(self._now_ms, self._map.cells.reshape(-1)), PendingNews()
        return news

    def stop_all(self, *, halted: bool = False) -> None:
        """Stop all driving robots: until a pause ends if `halted`, else for good."""
        for name, robot in self._robots.items():
            if robot.order is not None and robot.driving and not robot.order.stopped:
                robot.order.halted = halted
                self.stop(name)

    def _free(self, name: str) -> CommandedRobot:
        robot = self._robots[name]
        if robot.order is not None or robot.lost:
            raise InternalError(f"{name} is not free: {'lost' if robot.lost else robot.order}")
        return robot

    def _hand_over(self, name: ActionName, rover: str, carrier: str, cell: Cell | None) -> None:
        rover_robot, carrier_robot = self._free(rover), self._free(carrier)
        if cell is None:
            raise InternalError(f"{rover} is aboard {rover_robot.where.carrier}")
        self._charges.settle(self._now_ms, rover, carrier)
        if name is ActionName.DOCK:
            rover_robot.odometer.lift()
        took_ms = rover_robot.kind.dock_ms if name is ActionName.DOCK else rover_robot.kind.undock_ms
        rover_robot.free_at_ms = carrier_robot.free_at_ms = self._now_ms + took_ms
        self._send(RobotCommand(id=self._count + 1, name=name, robot=rover, carrier=carrier, cell=cell))

    def _send(self, order: RobotCommand) -> None:
        self._count, order.clear = order.id, self._clear(order)
        self._team.begin(order, order.cell)
        for name in order.robots:
            self._robots[name].order = order
        self._process.order(order)

    def _use(self, name: str) -> BatteryUse:
        robot = self._robots[name]
        return robot.battery_use(at_charger=robot.cell in self._grid.chargers)

    def _apply_next(self, until_ms: int) -> None:
        match self._process.exchange(until_ms):
            case MissionReport() as report:
                self._apply(report)
                if self._paused and report.in_contact:  # they could not be stopped before
                    self.stop_all(halted=True)
            case Control.PAUSE:
                self._paused = True
                self.stop_all(halted=True)
            case Control.RESUME:
                self._paused = False
            case Control.WIND_DOWN:
                self.called_back, self._paused = True, False
            case Control.CANCEL:
                self.cancelled = True
            case ZoneChange() as change:
                self._pending.zones.append(change)

    def _apply(self, report: MissionReport) -> None:
        since_ms, self._now_ms, self._begun = self._now_ms, max(self._now_ms, report.t_ms), True
        if report.robot is not None:
            reporter, self._pending.partial = self._robots[report.robot], True
            since_ms, reporter.reported_ms = reporter.reported_ms, self._now_ms
        if (shift := self._map.grow(report)) is not None:
            self._grow(shift)
        for change in self._map.draw(report):
            self._pending.add(change.robot or report.robot or next(iter(self._robots)), change)
        of = report.frame or self._map.first_frame
        shift = None if of == self._map.frame else of.shift_to(self._map.frame)
        for name in report.returned:
            for one in self._team.mark_returned(name):
                self._charges.resume(self._now_ms, one)
                self._robots[one].failures = 0
                self._pending.returned.append(one)
        for note in report.robots:
            if not self._robots[note.name].lost:
                cell = note.cell if shift is None or note.cell is None else shift.cell(note.cell)
                self._update_robot(self._robots[note.name], note, cell, since_ms)
        for number in report.finished:
            self._finish(number)
        for failed in report.failed:
            self._fail(failed.id, failed.reason)
        placed = {note.name for note in report.robots if note.cell is not None}
        for declined in report.declined:
            self._decline(declined.id, declined.reason, placed)
        for note in report.robots:
            if note.free_at_ms is not None:  # a robot whose command has just failed may need some time
                self._robots[note.name].free_at_ms = note.free_at_ms
            if note.charge is not None:
                self._correct_charge(note.name, note.charge)
        reasons = {lost.robot: lost.reason for lost in report.lost}
        for lost in report.lost:
            self._mark_lost(lost.robot, reasons)
            self._robots[lost.robot].returns = lost.returns
        self._contact.apply(report, self._robots)

    def _grow(self, shift: FrameShift) -> None:
        """Re-index all places after the map has grown."""
        self._grid = self._map.frame.grid(self._first, self._map.cells)
        self._pending.reindex(shift)
        for robot in self._robots.values():
            if robot.where.at is not None:
                robot.where = replace(robot.where, at=shift.cell(robot.where.at))
        for order in self._team.commands.values():
            order.route = tuple(map(shift.cell, order.route))
            order.cell = None if order.cell is None else shift.cell(order.cell)

    def _update_robot(self, robot: CommandedRobot, note: RobotNoteBody, cell: Cell | None, since_ms: int) -> None:
        drives, moved_m = robot.driving, 0.0
        if cell is not None and robot.cell is not None:
            moved_m = math.dist(robot.cell, cell) * self._grid.resolution_m
            if moved_m:
                robot.where = replace(robot.where, at=cell)
            robot.free_at_ms = self._now_ms
            passed = 0 if robot.order is None else robot.order.passed
            robot.advance(cell)
            if drives and robot.slowed and robot.order is not None and robot.order.passed > passed:
                robot.slowed = False
                self._pending.passages.append((note.name, robot.order.route[robot.order.passed - 1 :]))
        robot.distance_m = robot.distance_m + moved_m if note.distance_m is None else note.distance_m
        # a position counts as passed, but a given distance is that to the cell before
        robot.step_m = 0.0 if note.distance_m is None else robot.step_cells() * self._grid.resolution_m
        if note.speed_share is not None and note.speed_share != robot.speed:
            robot.speed, robot.slowed = note.speed_share, drives
            self._pending.slowed.append((note.name, robot.speed))
        if note.driving_ms is not None:
            robot.driving_ms = note.driving_ms
        elif drives:
            robot.driving_ms += self._now_ms - since_ms

    def _correct_charge(self, name: str, share: float) -> None:
        """Take over the charge that a robot reports; one that is clearly lower than estimated needs a new plan."""
        robot = self._robots[name]
        robot.behind += self._charges.share(name, self._now_ms) - share
        self._charges.correct(self._now_ms, name, share)
        if robot.behind > DRAINED:
            robot.behind = 0.0
            self._pending.drained.append(name)

    def _finish(self, number: int) -> None:
        order = self._end(number, ActionEnd.DONE)
        if order is None:
            return
        if order.halted and self._robots[order.robot].cell != order.route[-1]:
            self._pending.failed.append((order.robot, PAUSED))
            return
        for name in order.robots:
            self._robots[name].failures = 0
        self._pending.finished += order.robots

    def _fail(self, number: int, reason: str) -> None:
        order = self._end(number, ActionEnd.FAILED)
        if order is None:
            return
        self._pending.failed += [(name, reason) for name in order.robots]
        if order.clear and not self._clear(order):  # its robots met changed ground: they have not failed
            return
        for name in order.robots:
            self._robots[name].failures += 1
            if self._robots[name].failures >= MOST_FAILURES:
                self._mark_lost(name, {name: f"failed {MOST_FAILURES} times in a row: {reason}"})
                self._robots[name].returns = False

    def _clear(self, order: RobotCommand) -> bool:
        """Return whether the robot of a command can stand on all cells that are left of it, as the map is known now."""
        left = passed_cells(order.route[max(0, order.passed - 1) :]) if order.cell is None else (order.cell,)
        return fits(self._grid, self._robots[order.robot].kind, *left)

    def _decline(self, number: int, reason: str, placed: Set[str]) -> None:
        """End a command that its robots refused: unlike one that failed, it does not count against them.

        A robot that refuses a drive stands where the drive begins, unless it is among `placed`, whose place is known.
        """
        order = self._end(number, ActionEnd.FAILED)
        if order is not None:
            if order.route and order.robot not in placed:
                self._robots[order.robot].where = Whereabouts(order.route[0])
            self._pending.declined += [(name, reason or "declined") for name in order.robots]

    def _end(self, number: int, end: ActionEnd) -> RobotCommand | None:
        if (running := self._team.commands.get(number)) is not None:
            self._charges.settle(self._now_ms, *running.robots)
        order = self._team.end(number, end)  # None: the command ended when one of its robots was lost
        if order is not None:
            for name in order.robots:
                self._robots[name].order, self._robots[name].slowed = None, False
                self._robots[name].free_at_ms, self._robots[name].step_m = self._now_ms, 0.0
            if order.name == "drive":
                self._robots[order.robot].odometer.arrive(self._now_ms)
        return order

    def _mark_lost(self, name: str, reasons: Mapping[str, str]) -> None:
        self._charges.settle(self._now_ms, name)
        for one in self._team.mark_lost(name):
            order = self._robots[one].order
            if order is not None:
                self._end(order.id, ActionEnd.LOST)
            if one in self._pending.returned:  # lost again
                self._pending.returned.remove(one)
            self._pending.lost.append((one, reasons.get(one, f"aboard {name}, which is lost")))
