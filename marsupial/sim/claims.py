"""Robots on the ground claim the room that they take, and wait for each other.

A standing robot claims its cell, a driving one the line to its next cell, and a rover that docks keeps its cell until
it is aboard. A robot sets off for the next cell only if that line keeps clear of all other claims by the sum of the
radii; otherwise it waits. So no two robots overlap at any moment, not even between cells.

Some pairs may be nearer: a rover and a carrier that meet in the current plan, if both are at the meeting point or on
their last drive to it, or that are to dock now; and robots that overlap already, at their starts or after undocking,
which may only move apart. Lost robots claim nothing.
"""

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass

from marsupial.model import Action, Cell, MapMeeting, Mask, RobotType, Role
from marsupial.model.mission import Interference
from marsupial.sim.clearance import ClaimedCells, Clearance, gap
from marsupial.sim.motion import Motion, RobotActivity, Rule, SimulatedHandover, SimulatedRobot

PATIENCE_MS = 2_000
"""How long a robot waits before the world searches for a route for it, and then between searches."""


@dataclass(frozen=True, slots=True)
class Wake:
    """Robots that wait are looked at; nothing else happens."""


@dataclass(slots=True)
class Wait:
    """When a robot began to wait (None if it has just been stopped), and when to handle the wait."""

    since_ms: int | None
    look_ms: int


@dataclass(slots=True)
class Aside:
    """A robot makes room."""

    winner: SimulatedRobot | None  # the robot it makes room for; None while it returns to its docking cell
    spot: Cell  # where it stood
    goal: Cell | None  # goal of its own drive, if any
    until_ms: int  # end of its wait
    arrived: bool = False


class Claims(Rule):
    """Lets robots wait until there is room for their next step; knows which robot is in whose way.

    `asides` and `handovers` are kept by `Deadlocks` and `Handovers`.
    """

    def __init__(self, motion: Motion, kinds: Mapping[str, RobotType]) -> None:
        self._motion = motion
        self.clearance = Clearance(motion, kinds)
        self.blocked: dict[SimulatedRobot, Wait] = {}  # robots that can't set off
        self.asides: dict[SimulatedRobot, Aside] = {}
        self.handovers: dict[SimulatedHandover, Wait] = {}  # dockings and undockings that can't begin yet
        self._meetings: frozenset[tuple[str, str, Cell, Cell]] = frozenset()
        self.waits = self.waited_ms = self.deadlocks = 0

    def interference(self) -> Interference:
        """Return how often and how long robots have waited for each other so far."""
        return Interference(waits=self.waits, waited_s=self.waited_ms / 1000, deadlocks=self.deadlocks)

    def plan(self, meetings: Iterable[MapMeeting], actions: Iterable[Action]) -> None:
        """Store which rover and carrier meet where in the current plan."""
        cells = {point.name: (point.rover_cell, point.carrier_cell) for point in meetings}
        self._meetings = frozenset(
            (action.robot, action.carrier, *cells[action.place])
            for action in actions
            if action.carrier is not None and action.place in cells
        )

    # waiting

    def may_set_off(self, robot: SimulatedRobot) -> bool:
        now_ms = self._motion.now_ms
        robot.times_ms = robot.times_ms + (now_ms - robot.times_ms[robot.step])
        ends = robot.step == len(robot.route) - 1
        if not ends and any(self.in_the_way(robot, robot.route[robot.step + 1])):
            self.blocked.setdefault(robot, Wait(None, now_ms + PATIENCE_MS))
            return False
        if self.stop_waiting(robot) and not ends:
            self._motion.moment.passages.append((robot.name, robot.route[robot.step :]))
        return True

    def begin_waiting(self, robot: SimulatedRobot, wait: Wait) -> None:
        """Count the wait of a robot that can't set off, from now on."""
        wait.since_ms = self._motion.now_ms
        self.waits += 1
        robot.odometer.arrive(self._motion.now_ms)
        self._motion.moment.passages.append((robot.name, robot.route[robot.step : robot.step + 1]))
        self._motion.at(wait.look_ms, Wake())

    def stop_waiting(self, robot: SimulatedRobot) -> bool:
        """Count the wait of a robot that ends now; return whether it waited."""
        wait = self.blocked.pop(robot, None)
        if wait is None or wait.since_ms is None:
            return False
        self.waited_ms += self._motion.now_ms - wait.since_ms
        robot.odometer.set_off(self._motion.now_ms)
        return True

    def is_due(self, wait: Wait) -> bool:
        """Return whether to handle a wait now; if so, it is handled again after some time."""
        now_ms = self._motion.now_ms
        if now_ms < wait.look_ms:
            return False
        wait.look_ms = now_ms + PATIENCE_MS
        self._motion.at(wait.look_ms, Wake())
        return True

    def on_halt(self, robot: SimulatedRobot) -> None:
        if robot.lost:
            self.blocked.pop(robot, None)
        else:
            self.stop_waiting(robot)

    # which robot blocks which

    def in_the_way(self, robot: SimulatedRobot, ahead: Cell) -> Iterator[SimulatedRobot]:
        """Yield the robots whose claims block a robot's drive to, or its landing on, a neighbouring cell."""
        for other in self._motion.team.values():
            claim = self.claim(other)
            if other is robot or claim is None:
                continue
            here, apart = robot.cell or ahead, self.clearance.apart(robot.kind, other.kind)
            far = max(abs(here.x - claim[0].x), abs(here.y - claim[0].y)) > apart + 3
            if far or gap((here, ahead), claim) >= apart:
                continue
            now = gap((here, here), claim)
            leaves = robot.cell is not None and now < apart and gap((ahead, ahead), claim) >= now
            if not leaves and not self.meet(robot, other):
                yield other

    def claim(self, robot: SimulatedRobot) -> ClaimedCells | None:
        """Return the line that a robot occupies; None if it is aboard or lost."""
        here = robot.left if robot.cell is None and robot.activity is RobotActivity.DOCKING else robot.cell
        if here is None or robot.lost:
            return None
        return here, robot.route[robot.step] if robot.activity is RobotActivity.DRIVING else here

    def is_busy(self, robot: SimulatedRobot) -> bool:
        """Return whether a robot moves, docks, or is off the ground."""
        claim = self.claim(robot)
        return robot.partner is not None or claim is None or claim[0] != claim[1]

    def meet(self, robot: SimulatedRobot, other: SimulatedRobot) -> bool:
        """Return whether two robots may be near each other, to dock or after undocking: now, or where the plan says."""
        rover, carrier = (robot, other) if robot.kind.role is Role.ROVER else (other, robot)
        if (rover.name, carrier.name, self.goal(rover), self.goal(carrier)) in self._meetings:
            return True
        return any(asked.robots == (rover, carrier) for asked in self.handovers)

    def goal(self, robot: SimulatedRobot) -> Cell | None:
        """Return the goal of a driving robot, or else its cell."""
        if robot in self.asides:
            return self.asides[robot].goal
        end = robot.route[-1] if robot.activity is RobotActivity.DRIVING else robot.cell
        return robot.astray[1] if robot.astray is not None and end == robot.astray[0] else end

    def way(self, robot: SimulatedRobot) -> tuple[Cell, ...]:
        """Return the cells that a robot will pass or set a rover down on, its own cell first."""
        ahead = robot.route[robot.step :] if robot.activity is RobotActivity.DRIVING else ()
        landings = [each.landing for each in self.handovers if robot is each.robots[1] and each.landing is not None]
        here = () if robot.cell is None else (robot.cell,)
        return (*here, *ahead, *landings)

    def room(self, robot: SimulatedRobot, others: Iterable[SimulatedRobot]) -> Mask:
        """Return the mask of known cells on which a robot stands clear of these robots, except those that it meets."""
        assert robot.cell is not None
        claims = [
            (other.kind, claim)
            for other in others
            if other is not robot and (claim := self.claim(other)) is not None and not self.meet(robot, other)
        ]
        return self.clearance.room(robot.kind, robot.cell, claims)
