"""How simulated robots drive and dock: their clock, the queue of what is due, and the rules that they ask.

A command is given to all rules (`give`), which may refuse it or keep it back, and then begins (`begin`). A robot sets
off for each cell of its route as soon as all rules let it (`next_step`), and an event tells when it is there.

The queue holds (time, sequence number, event), so events of one moment happen in the order in which they became due.
When a robot is lost or stopped, its `RobotDue` stays in the queue, but has no longer the number that the robot expects,
and is ignored; so does the one of its docking partner.
"""

import heapq
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Any, NamedTuple

import numpy as np

from marsupial.arrays import Ints
from marsupial.errors import InternalError
from marsupial.maps.territory import dock_range_cells, within_range
from marsupial.model import UNKNOWN, Cell, CellArray, Grid, PlacedRobot, RobotType
from marsupial.model.seats import has_place
from marsupial.model.world import MomentNews
from marsupial.paths.routes import Odometer, Route, passing_times_ms


class RobotActivity(StrEnum):
    """What a robot is doing."""

    NONE = "nothing"
    DRIVING = "driving"
    DOCKING = "docking"
    UNDOCKING = "undocking"


@dataclass(slots=True, eq=False)
class SimulatedRobot:
    """A robot as the simulator knows it."""

    name: str
    kind: RobotType
    cell: Cell | None
    carrier: str | None
    activity: RobotActivity = RobotActivity.NONE
    free_at_ms: int = 0
    route: Route = ()
    times_ms: Ints = field(default_factory=lambda: np.zeros(0, dtype=np.int64))
    step: int = 0
    waits: bool = False  # whether it stands on its drive, until a rule lets it go on
    partner: "SimulatedRobot | None" = None
    due: int = 0  # number of the `RobotDue` that it expects
    lost: bool = False
    lost_with: str | None = None  # the carrier with which it was lost
    speed: float = 1.0  # share of its type's speed at which it drives
    told_speed: float = 1.0  # as it last reported it
    tells_speed: bool = True  # whether it reports `speed`
    slowed_ms: int | None = None  # when `speed` changed during its drive, since the last cell
    declines: bool = False  # whether it refuses its next command
    slips: int = 0  # number of next dockings and undockings that fail
    astray: tuple[Cell, Cell] | None = None  # where its last drive ends, and the goal of that drive
    left: Cell | None = None  # where it stood before its docking began; None before an undocking
    distance_cells: float = 0.0
    driving_ms: int = 0
    odometer: Odometer = field(default_factory=Odometer)
    held: CellArray | None = None  # what it has seen since it was last in contact; None while it is

    @property
    def pair(self) -> "tuple[SimulatedRobot, ...]":
        """The robot, and the one that it docks with or is undocked by."""
        return (self,) if self.partner is None else (self, self.partner)


class SimulatedDrive(NamedTuple):
    """The command to drive along a route."""

    robots: tuple[SimulatedRobot]
    route: Sequence[Cell]


class SimulatedHandover(NamedTuple):
    """The command to dock a rover on a carrier, or to set it down on `landing`."""

    robots: tuple[SimulatedRobot, SimulatedRobot]
    landing: Cell | None


SimulatedCommand = SimulatedDrive | SimulatedHandover


@dataclass(frozen=True, slots=True)
class RobotDue:
    """A robot is at the next cell of its route, or its docking or undocking is over; or it is to look round."""

    robot: SimulatedRobot
    due: int


class Rule:
    """What a rule is asked and told; by default it allows everything and does nothing."""

    def accepts(self, command: SimulatedCommand) -> bool:
        """Return whether a command can begin when it is given; if not, the rule has refused it, or keeps it."""
        return True

    def begins(self, command: SimulatedCommand) -> SimulatedCommand | None:
        """Return a command that begins now as its robots carry it out; None if it fails at once."""
        return command

    def may_set_off(self, robot: SimulatedRobot) -> bool:
        """Return whether a robot can set off for its next cell; if not, the rule has halted it, or asks again later."""
        return True

    def before_change(self, robot: SimulatedRobot) -> None:
        """Take note that a robot begins or ends a command now, or is lost."""

    def after_change(self, robot: SimulatedRobot) -> None:
        """Take note that a robot has begun a drive, was set down, has taken a rover aboard, or can act again."""

    def on_step(self, robot: SimulatedRobot, *, ended: bool) -> bool:
        """Return whether the command of a robot that is at a cell is complete, if the motion has `ended`."""
        return ended

    def may_stop(self, robot: SimulatedRobot) -> bool:
        """Return whether a drive that is to be stopped ends early."""
        return True

    def on_halt(self, robot: SimulatedRobot) -> None:
        """Take note that a fault stops a robot where it stands now, or that it was lost."""

    def look(self, robot: SimulatedRobot) -> None:
        """Let a robot on the ground look round."""

    def on_time(self, event: object) -> None:
        """Let an event happen that a rule has put into the queue."""

    def on_moment(self) -> None:
        """Take note that all events of a moment have happened."""

    def settle(self) -> None:
        """Let robots go on that have waited, after the events of a moment and before time passes."""

    def report(self, robot: SimulatedRobot, fields: dict[str, Any]) -> None:
        """Change the fields of a robot's `RobotReport`."""


class Motion:
    """The robots of a world, what they know of it, and what they do.

    `truth` is the true map, whose unknown cells are obstacles, and `grid` the known one, whose cells are written to as
    `known`; `moment` gathers news.
    """

    def __init__(self, truth: Grid, kinds: Mapping[str, RobotType], robots: Iterable[PlacedRobot]) -> None:
        self.truth = truth.solid()
        self.known = np.full_like(self.truth.cells, UNKNOWN)
        self.grid = Grid(
            cells=self.known,
            resolution_m=truth.resolution_m,
            origin_m=truth.origin_m,
            terrains=truth.terrains,
            chargers=truth.chargers,
        )
        self.team = {
            r.name: SimulatedRobot(name=r.name, kind=kinds[r.type], cell=r.cell, carrier=r.carrier) for r in robots
        }
        self.changes = 0  # how often known cells got another code
        self.rules: list[Rule] = []
        self.now_ms = 0
        self.moment = MomentNews()
        self._queue: list[tuple[int, int, object]] = []
        self._count = 0
        for robot in self.team.values():
            if robot.cell is not None:
                self.at(0, RobotDue(robot, robot.due))  # its first look

    def note_change(self, robot: str, cells: Ints) -> None:
        """Take note that a robot reported known cells (row-major indices) to be different now, if there are any."""
        if len(cells):
            self.moment.changed.append((robot, cells))
            self.changes += 1

    # time

    def at(self, t_ms: int, event: object) -> None:
        """Let an event happen at a time."""
        self._count += 1
        heapq.heappush(self._queue, (t_ms, self._count, event))

    def is_due(self, until_ms: int) -> bool:
        """Return whether an event happens by a time."""
        return bool(self._queue) and self._queue[0][0] <= until_ms

    def pass_moment(self) -> None:
        """Let time pass to the next events, and let them happen."""
        self.now_ms = self._queue[0][0]
        while self._queue and self._queue[0][0] == self.now_ms:
            _, _, event = heapq.heappop(self._queue)
            if not isinstance(event, RobotDue):
                for rule in self.rules:
                    rule.on_time(event)
            elif event.due == event.robot.due and not event.robot.lost:
                self._arrive(event.robot)
        for rule in self.rules:
            rule.on_moment()
        self.settle()

    def settle(self) -> None:
        """Let robots go on that have waited."""
        for rule in self.rules:
            rule.settle()

    # commands

    def give(self, command: SimulatedCommand) -> None:
        """Give a command to robots; it begins now, unless a rule refuses it or keeps it for later."""
        if all(rule.accepts(command) for rule in self.rules):
            self.begin(command)

    def begin(self, command: SimulatedCommand) -> None:
        """Let a command begin that all rules have accepted."""
        for rule in self.rules:
            carried_out = rule.begins(command)
            if carried_out is None:
                return
            command = carried_out
        for robot in command.robots:
            if robot.activity is not RobotActivity.NONE or robot.lost or robot.free_at_ms > self.now_ms:
                raise InternalError(f"{robot.name} is not free: {'lost' if robot.lost else robot.activity}")
        if isinstance(command, SimulatedDrive):
            self._set_out(*command.robots, tuple(command.route))
        else:
            self._hand_over(*command.robots, command.landing)

    def end_drive(self, robot: SimulatedRobot) -> None:
        """Let a drive end at the next cell, or where its robot stands if it waits."""
        if robot.activity is RobotActivity.DRIVING and all(rule.may_stop(robot) for rule in self.rules):
            robot.route = robot.route[: robot.step + 1]
            if robot.waits:
                self.next_step(robot)

    def _set_out(self, robot: SimulatedRobot, route: Route) -> None:
        if robot.cell is None or route[0] != robot.cell:
            raise InternalError(f"{robot.name} can't drive from {route[0]}: it is at {robot.cell}")
        self._before_change(robot)
        self.follow(robot, route)
        self.after_change(robot)

    def _hand_over(self, rover: SimulatedRobot, carrier: SimulatedRobot, landing: Cell | None) -> None:
        """Begin a docking or undocking of both robots; its event is the rover's."""
        docks = landing is None
        if docks and (rover.cell is None or carrier.cell is None or not self.has_place(carrier, rover)):
            raise InternalError(f"{rover.name} can't dock on {carrier.name}")
        if not docks and rover.carrier != carrier.name:
            raise InternalError(f"{rover.name} is not on {carrier.name}")
        self._before_change(rover, carrier)
        rover.left, rover.cell, rover.carrier = rover.cell, landing, carrier.name if docks else None
        rover.odometer.lift()
        activity = RobotActivity.DOCKING if docks else RobotActivity.UNDOCKING
        for robot, partner in ((rover, carrier), (carrier, rover)):
            robot.activity, robot.partner = activity, partner
            robot.free_at_ms = self.now_ms + (rover.kind.dock_ms if docks else rover.kind.undock_ms)
            robot.due += 1
        self.at(rover.free_at_ms, RobotDue(rover, rover.due))
        if not docks:
            self.after_change(rover)

    def is_stuck(self, robot: SimulatedRobot) -> bool:
        """Return whether a robot that does nothing can't act yet."""
        return robot.activity is RobotActivity.NONE and robot.free_at_ms > self.now_ms

    def has_place(self, carrier: SimulatedRobot, rover: SimulatedRobot) -> bool:
        """Return whether a place for a rover is free; an undocking may fail, so its rover keeps its place."""
        undocked = carrier.partner if carrier.activity is RobotActivity.UNDOCKING else None
        others = (r for r in self.team.values() if (r.carrier == carrier.name and not r.lost) or r is undocked)
        return has_place(carrier.kind, rover.kind.name, [other.kind.name for other in others])

    def in_reach(self, rover: SimulatedRobot, carrier: SimulatedRobot, at: Cell | None) -> bool:
        """Return whether a rover at a cell is near enough to its carrier to dock, or to be set down there."""
        limit = dock_range_cells(carrier.kind, rover.kind, self.grid.resolution_m)
        see_through = self.grid.opaque_codes()[self.grid.cells] == 0
        return at is None or carrier.cell is None or within_range(at, carrier.cell, limit, see_through)

    # from cell to cell

    def follow(self, robot: SimulatedRobot, route: Route) -> None:
        """Send a robot along a route from its cell."""
        if robot.activity is not RobotActivity.DRIVING:
            robot.activity = RobotActivity.DRIVING
            robot.odometer.set_off(self.now_ms)
        robot.route, robot.step, robot.times_ms = route, 0, self._times_ms(robot, route)
        self.next_step(robot)

    def next_step(self, robot: SimulatedRobot) -> None:
        """Let a robot set off for the next cell of its route, if all rules let it."""
        robot.waits = True
        if not all(rule.may_set_off(robot) for rule in self.rules):
            return
        robot.waits = False
        robot.due += 1
        if robot.slowed_ms is not None and robot.slowed_ms < self.now_ms:
            left, robot.slowed_ms = robot.route[robot.step :], None
            robot.times_ms = np.concatenate([robot.times_ms[: robot.step], self._times_ms(robot, left)])
            if robot.tells_speed:
                self.moment.passages.append((robot.name, left))
        # the route may have one cell only: a drive to where the robot stands ends at once
        before, robot.step = robot.step, min(robot.step + 1, len(robot.route) - 1)
        if robot.step > before:
            robot.odometer.step(robot.route[before], robot.route[robot.step])
        self.at(int(robot.times_ms[robot.step]), RobotDue(robot, robot.due))

    def _times_ms(self, robot: SimulatedRobot, route: Sequence[Cell]) -> Ints:
        """Return when a robot that sets off now passes the cells of a route."""
        kind, speed_mps = robot.kind, robot.kind.speed_mps * robot.speed
        return self.now_ms + passing_times_ms(route, self.grid.resolution_m, speed_mps, kind.diagonal)

    def _arrive(self, robot: SimulatedRobot) -> None:
        """Process the event that a robot expects."""
        ended = self._move(robot)
        for rule in self.rules:
            ended = rule.on_step(robot, ended=ended)
        if ended:
            self.moment.finished += sorted(one.name for one in robot.pair)
            self.end_command(robot)
            if robot.carrier is not None:
                self.after_change(self.team[robot.carrier])
        if robot.cell is not None:  # it passed a cell, or was just set down on one
            self.look(robot)

    def _move(self, robot: SimulatedRobot) -> bool:
        """Let a robot be where its motion has brought it; return whether the motion has ended."""
        if robot.activity is not RobotActivity.DRIVING:
            return robot.activity is not RobotActivity.NONE
        there = robot.route[robot.step]
        if robot.cell is not None and there != robot.cell:
            robot.distance_cells += 1.0 if there.x == robot.cell.x or there.y == robot.cell.y else robot.kind.diagonal
            robot.driving_ms += int(robot.times_ms[robot.step] - robot.times_ms[robot.step - 1])
        robot.cell = there
        if robot.step == len(robot.route) - 1:
            robot.odometer.arrive(self.now_ms)
            return True
        self.next_step(robot)
        return False

    def look(self, robot: SimulatedRobot) -> None:
        """Let a robot on the ground look round."""
        for rule in self.rules:
            rule.look(robot)

    # the end of commands

    def halt(self, robot: SimulatedRobot) -> None:
        """Stop a robot where it stands, without an end of its command."""
        for rule in self.rules:
            rule.on_halt(robot)
        robot.odometer.arrive(self.now_ms)
        robot.due += 1
        self.end_command(robot)

    def fail(self, robot: SimulatedRobot, what: str) -> None:
        """Let a robot be lost, with all rovers aboard; a rover that docks stays where it stands."""
        if robot.lost:
            return
        self._before_change(*robot.pair)
        docks = robot.activity is RobotActivity.DOCKING
        for one in robot.pair:  # the event of a docking is the rover's, so both numbers have to change
            one.due += 1
            if docks and one.carrier is not None:
                one.cell, one.carrier = one.left, None
        self.end_command(robot)
        aboard = [other for other in self.team.values() if other.carrier == robot.name and not other.lost]
        robot.lost = True
        for other in aboard:
            other.lost, other.lost_with = True, robot.name
        lost = {robot.name: what} | {other.name: f"aboard {robot.name}, which {what}" for other in aboard}
        self.moment.lost += lost.items()
        self.moment.returned = [name for name in self.moment.returned if name not in lost]  # lost again
        for rule in self.rules:
            for one in (robot, *aboard):
                rule.on_halt(one)

    def end_command(self, robot: SimulatedRobot) -> None:
        """End what a robot and its partner do."""
        if robot.activity is not RobotActivity.NONE:
            self._before_change(*robot.pair)
        for one in robot.pair:
            one.activity, one.partner, one.route, one.step = RobotActivity.NONE, None, (), 0
            one.waits, one.free_at_ms, one.slowed_ms = False, self.now_ms, None

    def _before_change(self, *robots: SimulatedRobot) -> None:
        for rule in self.rules:
            for robot in robots:
                rule.before_change(robot)

    def after_change(self, robot: SimulatedRobot) -> None:
        """Tell all rules of a change of what a robot does."""
        for rule in self.rules:
            rule.after_change(robot)
