"""A simulated world in which robots wait for each other: one half of interference (`marsupial.sim.interference`).

A standing robot claims its cell, a driving one the line to its next cell, and a rover that docks keeps its cell until
it is aboard. A robot sets off for the next cell only if that line keeps clear of all other claims by the sum of the
radii; if not, it waits until it does. So no two robots overlap at any moment, on the way included.

Some pairs may be nearer: a rover and a carrier that the plan in force has meet, if both are at the meeting point or on
their last drive to it; and robots that overlap already, at their starts or after undocking, which may only move apart.
Lost robots are taken to be out of the way.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

from marsupial.model import Action, Cell, Grid, MapMeeting, News, PlacedRobot, RobotReport, RobotType, Role
from marsupial.model.mission import Interference
from marsupial.paths.routes import Route
from marsupial.sim.clearance import Claim, Clearance, gap
from marsupial.sim.sensors import Sensor
from marsupial.sim.world import RobotActivity, SimulatedRobot, SimulatedWorld

PATIENCE_MS = 2_000
"""How long a robot waits before something is done about it; and then until it is looked after again."""

_WAKE = -2
"""Event number of times at which nothing happens but that waiting robots are looked after."""


@dataclass(slots=True)
class Wait:
    """Since when a robot waits, None if it has just been stopped, and when something is to be done about it."""

    since_ms: int | None
    look_ms: int

    def due(self, now_ms: int) -> bool:
        """Return whether something is to be done now; the next time is set then."""
        if now_ms < self.look_ms:
            return False
        self.look_ms = now_ms + PATIENCE_MS
        return True


class WaitingWorld(SimulatedWorld):
    """A simulated `World` in which robots wait until there is room for their next step."""

    def __init__(
        self,
        truth: Grid,
        kinds: Mapping[str, RobotType],
        robots: Sequence[PlacedRobot],
        failures: Mapping[str, int] | None = None,
        sensor: Sensor | None = None,
    ) -> None:
        super().__init__(truth, kinds, robots, failures, sensor)
        self._clearance = Clearance(self._grid, kinds)
        self._blocked: dict[str, Wait] = {}  # robots that can't set off
        self._docking: dict[str, Cell] = {}  # where rovers stand until they are aboard
        self._meetings: frozenset[tuple[str, str, Cell, Cell]] = frozenset()
        self._passages: list[tuple[str, Route]] = []
        self._failed: list[tuple[str, str]] = []
        self._waits = self._waited_ms = self._deadlocks = 0

    def interference(self) -> Interference:
        """Return how often and how long robots have waited for each other so far."""
        return Interference(waits=self._waits, waited_s=self._waited_ms / 1000, deadlocks=self._deadlocks)

    def plan(self, meetings: Iterable[MapMeeting], actions: Iterable[Action]) -> None:
        """Take in which rover and carrier meet where in the plan in force."""
        cells = {point.name: (point.rover_cell, point.carrier_cell) for point in meetings}
        self._meetings = frozenset(
            (action.robot, action.carrier, *cells[action.place])
            for action in actions
            if action.carrier is not None and action.place in cells
        )

    def stop(self, robot: str) -> None:
        super().stop(robot)
        if robot in self._blocked:
            self._next_step(self._robots[robot])  # it stands: its drive ends here

    def advance(self, until_ms: int) -> News:
        self._settle(commanded=True)
        return self._told(None) or super().advance(until_ms)

    def _next_moment(self) -> News | None:
        news = super()._next_moment()
        # who has arrived may be sent on at once: its next command comes before others use its place
        self._settle(commanded=news is None or not news.finished)
        return self._told(news)

    def _told(self, news: News | None) -> News | None:
        """Return the news with what happened between robots."""
        if not self._passages and not self._failed:
            return news
        passages, failed = tuple(self._passages), tuple(self._failed)
        self._passages, self._failed = [], []
        return replace(news or News(t_ms=self._now_ms), passages=passages, failed=failed)

    def _report(self, robot: SimulatedRobot) -> RobotReport:
        report = super()._report(robot)
        return report if report.free_at_ms >= self._now_ms else replace(report, free_at_ms=self._now_ms)

    def _next_step(self, robot: SimulatedRobot) -> None:
        robot.times_ms = robot.times_ms + (self._now_ms - robot.times_ms[robot.step])
        ends = robot.step == len(robot.route) - 1
        if not ends and any(self._in_the_way(robot, robot.route[robot.step + 1])):
            self._blocked.setdefault(robot.name, Wait(None, self._now_ms + PATIENCE_MS))
            return
        if self._stop_waiting(robot) and not ends:
            self._passages.append((robot.name, robot.route[robot.step :]))
        super()._next_step(robot)

    def _lose(self, robot: SimulatedRobot) -> list[tuple[str, str]]:
        lost = super()._lose(robot)
        for name, _ in lost:
            self._blocked.pop(name, None)
        return lost

    def _end_command(self, robot: SimulatedRobot) -> None:
        self._docking.pop(robot.name, None)
        super()._end_command(robot)

    def _stop_waiting(self, robot: SimulatedRobot) -> bool:
        """Count the wait of a robot that ends now; return whether it waited."""
        wait = self._blocked.pop(robot.name, None)
        if wait is None or wait.since_ms is None:
            return False
        self._waited_ms += self._now_ms - wait.since_ms
        robot.odometer.set_off(self._now_ms)
        return True

    def _settle(self, *, commanded: bool) -> None:
        """Let everybody set off who can, and look after those who have waited for some time.

        `commanded` says whether all robots have had the commands that follow from what happened.
        """
        order = [name for name in self._robots if name in self._blocked]
        waiting = len(order) + 1
        while len(self._blocked) < waiting:  # who sets off may make room for the next
            waiting = len(self._blocked)
            for name in order:
                if name in self._blocked:
                    self._next_step(self._robots[name])
        for name, wait in list(self._blocked.items()):
            if self._blocked.get(name) is not wait:  # it was just sent another way
                continue
            robot = self._robots[name]
            if wait.since_ms is None:
                wait.since_ms = self._now_ms
                self._waits += 1
                robot.odometer.arrive(self._now_ms)
                self._passages.append((name, robot.route[robot.step : robot.step + 1]))
                self._wake(wait, name)
            elif wait.due(self._now_ms):
                self._wake(wait, name)
                self._resolve(robot, self._now_ms - wait.since_ms)

    def _wake(self, wait: Wait, robot: str) -> None:
        self._push(wait.look_ms, robot, _WAKE)

    def _resolve(self, robot: SimulatedRobot, waited_ms: int) -> None:
        """Find a way for a robot that has waited."""

    def _claim(self, robot: SimulatedRobot) -> Claim | None:
        """Return the line that a robot is on; None if it is aboard or lost."""
        here = self._docking.get(robot.name) if robot.cell is None else robot.cell
        if here is None or robot.lost:
            return None
        return here, robot.route[robot.step] if robot.activity is RobotActivity.DRIVING else here

    def _in_the_way(self, robot: SimulatedRobot, ahead: Cell) -> Iterator[SimulatedRobot]:
        """Yield the robots whose claims keep a robot from driving to a neighbouring cell, or from being set there."""
        for other in self._robots.values():
            claim = self._claim(other)
            if other is robot or claim is None:
                continue
            here, apart = robot.cell or ahead, self._clearance.apart(robot.kind, other.kind)
            far = max(abs(here.x - claim[0].x), abs(here.y - claim[0].y)) > apart + 3
            if far or gap((here, ahead), claim) >= apart:
                continue
            now = gap((here, here), claim)
            leaves = robot.cell is not None and now < apart and gap((ahead, ahead), claim) >= now
            if not leaves and not self._meet(robot, other):
                yield other

    def _meet(self, robot: SimulatedRobot, other: SimulatedRobot) -> bool:
        """Return whether two robots are at a meeting point or on their way to it, to dock there or after undocking."""
        rover, carrier = (robot, other) if robot.kind.role is Role.ROVER else (other, robot)
        return (rover.name, carrier.name, self._goal(rover), self._goal(carrier)) in self._meetings

    def _goal(self, robot: SimulatedRobot) -> Cell | None:
        """Return where a robot drives to, or else where it stands."""
        return robot.route[-1] if robot.activity is RobotActivity.DRIVING else robot.cell
