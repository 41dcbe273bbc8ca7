"""A simulated world in which robots wait for each other: one half of interference (`marsupial.sim.interference`).

A standing robot claims its cell, a driving one the line to its next cell, and a rover that docks keeps its cell until
it is aboard. A robot sets off for the next cell only if that line keeps clear of all other claims by the sum of the
radii; otherwise it waits. So no two robots overlap at any moment, not even between cells.

Some pairs may be nearer: a rover and a carrier that meet in the current plan, if both are at the meeting point or on
their last drive to it; and robots that overlap already, at their starts or after undocking, which may only move apart.
Lost robots claim nothing.
"""

import math
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, replace

import numpy as np

from marsupial.arrays import Ints
from marsupial.maps.footprint import footprint_of
from marsupial.maps.targets import cell_at
from marsupial.model import UNKNOWN, Action, Cell, Grid, MapMeeting, Mask, News, RobotReport, RobotType, Role
from marsupial.model.mission import Interference
from marsupial.model.zones import ZoneChange, Zones, changed, zoned
from marsupial.paths.fields import PathSearch
from marsupial.paths.routes import Route
from marsupial.sim.batteries import BatteryWorld
from marsupial.sim.world import RobotActivity, SimulatedRobot

PATIENCE_MS = 2_000
"""How long a robot waits before the world searches for a route for it, and then between searches."""

_WAKE = -2
"""Event number of times at which only waiting robots are checked."""

ClaimedCells = tuple[Cell, Cell]
"""The ends of the line that a robot is on: a cell twice, or two neighbouring ones."""

_ROUNDING = 1e-9  # how much nearer than the sum of their radii robots count as touching: sums of radii are rounded


class Clearance:
    """Finds room and ways for robots on a known map; `change_ground` says that known cells have changed."""

    def __init__(self, grid: Grid, kinds: Mapping[str, RobotType]) -> None:
        self.grid = grid
        self.zones: Zones = {}  # that hold
        self._apart = {
            (a.name, b.name): (a.radius_m + b.radius_m) / grid.resolution_m - _ROUNDING
            for a in kinds.values()
            for b in kinds.values()
        }
        self._standable: dict[str, tuple[int, Mask]] = {}  # by type: the number of known cells, and the resulting mask

    def apart(self, kind: RobotType, other: RobotType) -> float:
        """Return the minimum distance of two robots in cells: the sum of their radii."""
        return self._apart[kind.name, other.name]

    def change_zone(self, change: ZoneChange) -> None:
        """Take note that a zone holds from now on, or no more."""
        self.zones = changed(self.zones, [change])
        self.change_ground()

    def change_ground(self) -> None:
        """Take note that robots can now stand elsewhere."""
        self._standable.clear()

    def ground(self, kind: RobotType) -> Mask:
        """Return the mask of known cells on which a robot can stand; it must not be changed."""
        known = int(np.count_nonzero(self.grid.cells != UNKNOWN))
        if self._standable.get(kind.name, (0,))[0] != known:
            self._standable[kind.name] = known, footprint_of(zoned(self.grid, self.zones), kind).standable
        return self._standable[kind.name][1]

    def room(self, kind: RobotType, here: Cell, others: Iterable[tuple[RobotType, ClaimedCells]]) -> Mask:
        """Return the mask of the cells on which a robot can stand clear of these others, and of its own cell."""
        room = self.ground(kind).copy()
        for other, claim in others:
            _bar(room, claim, self.apart(kind, other))
        room[here.y, here.x] = True
        return room

    def route(self, kind: RobotType, start: Cell, goal: Cell, room: Mask | None = None) -> Route | None:
        """Return the shortest route, in a room or else anywhere on known ground."""
        return PathSearch(self.ground(kind) if room is None else room, kind.diagonal).route(start, goal)

    def refuge(self, kind: RobotType, here: Cell, room: Mask, way: Iterable[Cell], other: RobotType) -> Route | None:
        """Return the route to the nearest cell in a room that is clear of another robot's route."""
        lengths = PathSearch(room, kind.diagonal).field(here)
        free = room.copy()
        free[here.y, here.x] = False
        _bar(free, way, self.apart(kind, other))
        lengths[~free] = math.inf
        nearest = int(lengths.argmin())
        if not math.isfinite(lengths.flat[nearest]):
            return None
        return self.route(kind, here, cell_at(nearest, room.shape[1]), room)


def gap(one: ClaimedCells, other: ClaimedCells) -> float:
    """Return the distance in cells between two claims."""
    (p, q), (a, b) = one, other
    if (p.x + q.x, p.y + q.y) == (a.x + b.x, a.y + b.y) and p != q and a != b:
        return 0.0  # they swap cells, or cross: diagonals of one square are the only lines that cross
    return min(_off(p, other), _off(q, other), _off(a, one), _off(b, one))


def _off(cell: Cell, claim: ClaimedCells) -> float:
    """Return the distance of a cell from a claim."""
    a, b = claim
    x, y, dx, dy = cell.x - a.x, cell.y - a.y, b.x - a.x, b.y - a.y
    share = 0.0 if a == b else min(max((x * dx + y * dy) / (dx * dx + dy * dy), 0.0), 1.0)
    return math.hypot(x - share * dx, y - share * dy)


def _bar(mask: Mask, cells: Iterable[Cell], apart: float) -> None:
    """Remove from a mask all cells nearer than `apart` to one of these claims."""
    reach = math.ceil(apart)
    span = np.arange(-reach, reach + 1)
    near = np.hypot(span[:, None], span[None, :]) < apart
    height, width = mask.shape
    for cell in cells:
        top, left = max(0, cell.y - reach), max(0, cell.x - reach)
        bottom, right = min(height, cell.y + reach + 1), min(width, cell.x + reach + 1)
        x, y = cell.x - reach, cell.y - reach
        mask[top:bottom, left:right] &= ~near[top - y : bottom - y, left - x : right - x]


@dataclass(slots=True)
class Wait:
    """When a robot began to wait (None if it has just been stopped), and when to handle the wait."""

    since_ms: int | None
    look_ms: int

    def due(self, now_ms: int) -> bool:
        """Return whether to handle the wait now; if so, set the next time."""
        if now_ms < self.look_ms:
            return False
        self.look_ms = now_ms + PATIENCE_MS
        return True


class WaitingWorld(BatteryWorld):
    """A simulated `World` in which robots wait until there is room for their next step."""

    def _set_up(self, kinds: Mapping[str, RobotType]) -> None:
        super()._set_up(kinds)
        self._clearance = Clearance(self.grid, kinds)
        self._blocked: dict[str, Wait] = {}  # robots that can't set off
        self._docking: dict[str, Cell] = {}  # where rovers stand until they are aboard
        self._meetings: frozenset[tuple[str, str, Cell, Cell]] = frozenset()
        self._waits = self._waited_ms = self._deadlocks = 0

    def interference(self) -> Interference:
        """Return how often and how long robots have waited for each other so far."""
        return Interference(waits=self._waits, waited_s=self._waited_ms / 1000, deadlocks=self._deadlocks)

    def plan(self, meetings: Iterable[MapMeeting], actions: Iterable[Action]) -> None:
        """Store which rover and carrier meet where in the current plan."""
        cells = {point.name: (point.rover_cell, point.carrier_cell) for point in meetings}
        self._meetings = frozenset(
            (action.robot, action.carrier, *cells[action.place])
            for action in actions
            if action.carrier is not None and action.place in cells
        )

    def change_zone(self, change: ZoneChange) -> None:
        """Take note that a zone holds from now on, or no more: robots make no room and no detours in no-go zones."""
        self._clearance.change_zone(change)

    def stop(self, robot: str) -> None:
        super().stop(robot)
        if robot in self._blocked:
            self._next_step(self._robots[robot])  # it stands: its drive ends here

    def advance(self, until_ms: int) -> News:
        self._settle(commanded=True)
        return super().advance(until_ms)

    def _next_moment(self) -> News | None:
        news = super()._next_moment()
        # a robot that has arrived may continue at once: its next command comes before others use its place
        self._settle(commanded=news is None or not news.finished)
        more = self._gathered()
        if news is None or more is None:
            return news or more
        return replace(news, passages=news.passages + more.passages, failed=news.failed + more.failed)

    def _report(self, robot: SimulatedRobot) -> RobotReport:
        report = super()._report(robot)
        return report if report.free_at_ms >= self.now_ms else replace(report, free_at_ms=self.now_ms)

    def _next_step(self, robot: SimulatedRobot) -> None:
        robot.times_ms = robot.times_ms + (self.now_ms - robot.times_ms[robot.step])
        ends = robot.step == len(robot.route) - 1
        if not ends and any(self._in_the_way(robot, robot.route[robot.step + 1])):
            self._blocked.setdefault(robot.name, Wait(None, self.now_ms + PATIENCE_MS))
            return
        if self._stop_waiting(robot) and not ends:
            self._moment.passages.append((robot.name, robot.route[robot.step :]))
        super()._next_step(robot)

    def _lose(self, robot: SimulatedRobot, what: str = "failed") -> list[tuple[str, str]]:
        lost = super()._lose(robot, what)
        for name, _ in lost:
            self._blocked.pop(name, None)
        return lost

    def _learn(self, robot: SimulatedRobot, seen: Ints, touched: Ints) -> None:
        changes = len(self._moment.changed)
        super()._learn(robot, seen, touched)
        if len(self._moment.changed) > changes:
            self._clearance.change_ground()

    def _halt(self, robot: SimulatedRobot) -> None:
        self._stop_waiting(robot)
        super()._halt(robot)

    def _end_command(self, robot: SimulatedRobot) -> None:
        self._docking.pop(robot.name, None)
        super()._end_command(robot)

    def _stop_waiting(self, robot: SimulatedRobot) -> bool:
        """Count the wait of a robot that ends now; return whether it waited."""
        wait = self._blocked.pop(robot.name, None)
        if wait is None or wait.since_ms is None:
            return False
        self._waited_ms += self.now_ms - wait.since_ms
        robot.odometer.set_off(self.now_ms)
        return True

    def _settle(self, *, commanded: bool) -> None:
        """Start all robots that can set off, and find routes for those that have waited for some time.

        `commanded` says whether all robots have received their commands for the latest events.
        """
        order = [name for name in self._robots if name in self._blocked]
        waiting = len(order) + 1
        while len(self._blocked) < waiting:  # a robot that sets off may make room for the next
            waiting = len(self._blocked)
            for name in order:
                if name in self._blocked:
                    self._next_step(self._robots[name])
        for name, wait in list(self._blocked.items()):
            if self._blocked.get(name) is not wait:  # it just got another route
                continue
            robot = self._robots[name]
            if wait.since_ms is None:
                wait.since_ms = self.now_ms
                self._waits += 1
                robot.odometer.arrive(self.now_ms)
                self._moment.passages.append((name, robot.route[robot.step : robot.step + 1]))
                self._wake(wait, name)
            elif wait.due(self.now_ms):
                self._wake(wait, name)
                self._resolve(robot, self.now_ms - wait.since_ms)

    def _wake(self, wait: Wait, robot: str) -> None:
        self._push(wait.look_ms, robot, _WAKE)

    def _resolve(self, robot: SimulatedRobot, waited_ms: int) -> None:
        """Find a route for a robot that has waited."""

    def _claim(self, robot: SimulatedRobot) -> ClaimedCells | None:
        """Return the line that a robot occupies; None if it is aboard or lost."""
        here = self._docking.get(robot.name) if robot.cell is None else robot.cell
        if here is None or robot.lost:
            return None
        return here, robot.route[robot.step] if robot.activity is RobotActivity.DRIVING else here

    def _in_the_way(self, robot: SimulatedRobot, ahead: Cell) -> Iterator[SimulatedRobot]:
        """Yield the robots whose claims block a robot's drive to, or its landing on, a neighbouring cell."""
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
        """Return the goal of a driving robot, or else its cell."""
        end = robot.route[-1] if robot.activity is RobotActivity.DRIVING else robot.cell
        return robot.astray[1] if robot.astray is not None and end == robot.astray[0] else end
