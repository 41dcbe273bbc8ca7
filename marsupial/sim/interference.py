"""A simulated world in which robots keep out of each other's footprints (`--interference`).

`SimulatedWorld` lets robots share cells and pass through each other. Here two robots on the ground are never nearer
than the sum of their radii. The mission loop is not told: it sees robots that arrive later, or take another way.

How it works
------------
A standing robot claims its cell, a driving one the line to its next cell. It sets off for the next cell only if that
line keeps clear of all other claims; if not, it waits. So no two robots overlap at any moment, on the way included.

::

    wait: the next line is claimed ──► set off as soon as it is clear
      │ after `PATIENCE_MS`, if no robot in the way moves or docks: a deadlock
      ▼
    1. a detour around the robots that stand, if it is at most `DETOUR_M` longer
    2. one robot steps aside, off the way of the other, and goes on once that one has passed:
       a robot without a command before one with a command, then the last in the order of the team
    3. the same, though others stand in the way aside: they will have to step aside in turn
      │ none of it for `GIVE_UP_MS`
      ▼
    the drive fails, and the strategy plans anew

A robot that was asked aside while it had nothing to do stays there. It comes back if it is to dock there.

Three pairs may be nearer: a rover and a carrier that the plan in force has meet, if both are at the meeting point or on
their last drive to it; a rover and the carrier that are about to dock; and robots that overlap already, at their starts
or after undocking, which may only move apart. Lost robots are taken to be out of the way.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from marsupial.maps.footprint import standable
from marsupial.maps.territory import dock_range_cells
from marsupial.model import (
    UNKNOWN,
    Action,
    Cell,
    Grid,
    MapMeeting,
    Mask,
    News,
    PlacedRobot,
    RobotReport,
    RobotType,
    Role,
)
from marsupial.model.mission import Interference
from marsupial.paths.fields import PathSearch
from marsupial.paths.routes import Route, passing_times_ms, route_length
from marsupial.sim.sensors import Sensor
from marsupial.sim.world import Activity, SimulatedRobot, SimulatedWorld

PATIENCE_MS = 2_000
"""How long a robot waits for others that stand before something is done about it; and then until it is tried again."""

DETOUR_M = 10.0
"""How much longer a way around may be than the way through: others are asked aside instead of longer ones."""

LET_PASS_MS = 60_000
"""How long a robot waits aside at most for another one to pass."""

GIVE_UP_MS = 60_000
"""How long a robot waits until its drive fails."""

_WAKE = -2
"""Event number of times at which nothing happens but that waiting robots are looked after."""

_CLOSE = 1e-9


@dataclass(slots=True)
class _Aside:
    """A robot that makes room: for whom, where it stood, where its own drive leads, if any, and how long it waits.

    `winner` is None while it returns to where it is to dock.
    """

    winner: str | None
    spot: Cell
    goal: Cell | None
    until_ms: int
    arrived: bool = False


@dataclass(slots=True)
class _Wait:
    """Since when a robot waits, None if it has just been stopped, and when something is to be done about it."""

    since_ms: int | None
    look_ms: int

    def due(self, now_ms: int) -> bool:
        """Return whether something is to be done now; the next time is set then."""
        if now_ms < self.look_ms:
            return False
        self.look_ms = now_ms + PATIENCE_MS
        return True


@dataclass(frozen=True, slots=True)
class _Handover:
    """A docking, or an undocking onto `landing`, that can't begin yet."""

    rover: str
    carrier: str
    landing: Cell | None
    wait: _Wait


class CrowdedWorld(SimulatedWorld):
    """A simulated `World` in which robots keep out of each other's footprints."""

    def __init__(
        self,
        truth: Grid,
        kinds: Mapping[str, RobotType],
        robots: Sequence[PlacedRobot],
        failures: Mapping[str, int] | None = None,
        sensor: Sensor | None = None,
    ) -> None:
        super().__init__(truth, kinds, robots, failures, sensor)
        self._apart = {
            (a.name, b.name): (a.radius_m + b.radius_m) / truth.resolution_m - _CLOSE
            for a in kinds.values()
            for b in kinds.values()
        }
        self._posts = {robot.name: robot.cell for robot in robots}  # where commands have left them
        self._blocked: dict[str, _Wait] = {}  # robots that can't set off
        self._aside: dict[str, _Aside] = {}
        self._handovers: list[_Handover] = []
        self._docking: dict[str, Cell] = {}  # where rovers stand until they are aboard
        self._meetings: frozenset[tuple[str, str, Cell, Cell]] = frozenset()
        self._standable: dict[str, tuple[int, Mask]] = {}  # by type: how many cells were known, and what follows
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

    # commands

    def drive(self, robot: str, route: Sequence[Cell]) -> None:
        self._posts[robot] = route[-1]
        errand = self._aside.get(robot)
        if errand is None:
            super().drive(robot, route)
        else:  # it makes room, and goes on from there
            errand.goal = route[-1]
            mover = self._robots[robot]
            self._passages.append((robot, mover.route[mover.step :]))

    def stop(self, robot: str) -> None:
        mover, errand = self._robots[robot], self._aside.get(robot)
        if errand is not None and errand.goal is None:
            return
        if errand is not None:
            del self._aside[robot]
        super().stop(robot)
        if robot in self._blocked or (errand is not None and errand.arrived):
            self._next_step(mover)  # it stands: its drive ends here

    def dock(self, rover: str, carrier: str) -> None:
        self._hand_over(rover, carrier, None)

    def undock(self, rover: str, carrier: str, cell: Cell) -> None:
        self._hand_over(rover, carrier, cell)

    def _hand_over(self, rover: str, carrier: str, landing: Cell | None) -> None:
        wait = _Wait(self._now_ms, self._now_ms + PATIENCE_MS)
        self._handovers.append(_Handover(rover, carrier, landing, wait))
        self._push(wait.look_ms, carrier, _WAKE)
        for robot in (self._robots[rover], self._robots[carrier]):
            if robot.cell is not None and robot.cell != self._posts[robot.name]:  # it made room since
                self._passages.append((robot.name, (robot.cell,)))
        self._begin_handovers()

    def advance(self, until_ms: int) -> News:
        self._settle(commanded=True)
        return self._told(None) or super().advance(until_ms)

    def _next_moment(self) -> News | None:
        news = super()._next_moment()
        # who has arrived may be sent on at once, so nobody is let back into its way before the next commands
        self._settle(commanded=news is None or not news.finished)
        return self._told(news)

    def _told(self, news: News | None) -> News | None:
        """Return the news with what happened between robots."""
        if not self._passages and not self._failed:
            return news
        passages, failed = tuple(self._passages), tuple(self._failed)
        self._passages, self._failed = [], []
        return replace(news or News(t_ms=self._now_ms), passages=passages, failed=failed)

    # what robots report

    def _report(self, robot: SimulatedRobot) -> RobotReport:
        report = super()._report(robot)
        for asked in self._handovers:  # as the simulator reports those that have begun
            if robot.name in (asked.rover, asked.carrier):
                rover = self._robots[asked.rover].kind
                took_ms = rover.dock_ms if asked.landing is None else rover.undock_ms
                report = replace(report, free_at_ms=self._now_ms + took_ms)
            if robot.name == asked.rover:
                carrier = asked.carrier if asked.landing is None else None
                report = replace(report, cell=asked.landing, carrier=carrier)
        return report if report.free_at_ms >= self._now_ms else replace(report, free_at_ms=self._now_ms)

    # motion

    def _next_step(self, robot: SimulatedRobot) -> None:
        robot.times_ms = robot.times_ms + (self._now_ms - robot.times_ms[robot.step])
        ends = robot.step == len(robot.route) - 1
        if not ends and any(self._in_the_way(robot, robot.route[robot.step + 1])):
            self._blocked.setdefault(robot.name, _Wait(None, self._now_ms + PATIENCE_MS))
            return
        if self._stop_waiting(robot) and not ends:
            self._passages.append((robot.name, robot.route[robot.step :]))
        super()._next_step(robot)

    def _step(self, robot: SimulatedRobot) -> bool:
        done, errand = super()._step(robot), self._aside.get(robot.name)
        if not done or errand is None:
            return done
        self._passages.append((robot.name, robot.route[-1:]))
        if errand.goal is None:
            self._rest(robot)
        else:
            errand.arrived = True
        return False

    def _lose(self, robot: SimulatedRobot) -> list[tuple[str, str]]:
        lost = super()._lose(robot)
        for name, _ in lost:
            self._aside.pop(name, None)
            self._blocked.pop(name, None)
            self._handovers = [each for each in self._handovers if name not in (each.rover, each.carrier)]
        return lost

    def _end_command(self, robot: SimulatedRobot) -> None:
        self._docking.pop(robot.name, None)
        super()._end_command(robot)

    def _rest(self, robot: SimulatedRobot) -> None:
        """Let a robot stand that has no command."""
        self._aside.pop(robot.name, None)
        self._stop_waiting(robot)
        robot.due += 1
        self._end_command(robot)

    def _stop_waiting(self, robot: SimulatedRobot) -> bool:
        """Count the wait of a robot that ends now; return whether it waited."""
        wait = self._blocked.pop(robot.name, None)
        if wait is None or wait.since_ms is None:
            return False
        self._waited_ms += self._now_ms - wait.since_ms
        robot.odometer.set_off(self._now_ms)
        return True

    def _set_out(self, robot: SimulatedRobot, route: Route) -> None:
        """Send a standing robot another way than it was commanded."""
        self._stop_waiting(robot)
        if robot.activity is not Activity.DRIVING:
            robot.activity = Activity.DRIVING
            robot.odometer.set_off(self._now_ms)
        times_ms = passing_times_ms(route, self._grid.resolution_m, robot.kind.speed_mps, robot.kind.diagonal)
        robot.route, robot.step, robot.times_ms = route, 0, self._now_ms + times_ms
        self._passages.append((robot.name, route))
        self._next_step(robot)

    # who is in whose way

    def _claim(self, robot: SimulatedRobot) -> tuple[Cell, Cell] | None:
        """Return the ends of the line that a robot is on; None if it is aboard or lost."""
        here = self._docking.get(robot.name) if robot.cell is None else robot.cell
        if here is None or robot.lost:
            return None
        return here, robot.route[robot.step] if robot.activity is Activity.DRIVING else here

    def _in_the_way(self, robot: SimulatedRobot, ahead: Cell) -> Iterator[SimulatedRobot]:
        """Yield the robots whose claims keep a robot from driving to a neighbouring cell, or from being set there."""
        for other in self._robots.values():
            claim = self._claim(other)
            if other is robot or claim is None:
                continue
            (a, b), here, apart = claim, robot.cell or ahead, self._apart[robot.kind.name, other.kind.name]
            if max(abs(here.x - a.x), abs(here.y - a.y)) > apart + 3 or _gap(here, ahead, a, b) >= apart:
                continue
            now = _gap(here, here, a, b)
            leaves = robot.cell is not None and now < apart and _gap(ahead, ahead, a, b) >= now
            if not leaves and not self._meet(robot, other):
                yield other

    def _meet(self, robot: SimulatedRobot, other: SimulatedRobot) -> bool:
        """Return whether two robots are at a meeting point or on their way to it, to dock there or after undocking."""
        rover, carrier = (robot, other) if robot.kind.role is Role.ROVER else (other, robot)
        docking = any((each.rover, each.carrier) == (rover.name, carrier.name) for each in self._handovers)
        return docking or (rover.name, carrier.name, self._goal(rover), self._goal(carrier)) in self._meetings

    def _goal(self, robot: SimulatedRobot) -> Cell | None:
        errand = self._aside.get(robot.name)
        if errand is not None:
            return errand.goal
        return robot.route[-1] if robot.activity is Activity.DRIVING else robot.cell

    def _way(self, robot: SimulatedRobot) -> tuple[Cell, ...]:
        """Return the cells that a robot is to pass."""
        ahead = robot.route[robot.step :] if robot.activity is Activity.DRIVING else ()
        landings = [each.landing for each in self._handovers if robot.name == each.carrier and each.landing is not None]
        here = () if robot.cell is None else (robot.cell,)
        return (*here, *ahead, *landings)

    # deadlocks

    def _settle(self, *, commanded: bool) -> None:
        """Let everybody go on who can; those who wait too long find a way, or others make room for them."""
        self._begin_handovers()
        if commanded:
            for name, errand in list(self._aside.items()):
                if errand.arrived and self._passed(self._robots[name], errand):
                    self._go_on(self._robots[name], errand)
        order = [name for name in self._robots if name in self._blocked]
        waiting = len(order) + 1
        while len(self._blocked) < waiting:  # who sets off may make room for the next
            waiting = len(self._blocked)
            for name in order:
                if name in self._blocked:
                    self._next_step(self._robots[name])
        for name, wait in list(self._blocked.items()):
            robot = self._robots[name]
            if wait.since_ms is None and self._blocked.get(name) is wait:
                wait.since_ms = self._now_ms
                self._waits += 1
                robot.odometer.arrive(self._now_ms)
                self._passages.append((name, robot.route[robot.step : robot.step + 1]))
                self._push(wait.look_ms, name, _WAKE)
            elif self._blocked.get(name) is wait and wait.due(self._now_ms):  # nobody else has sent it aside
                self._push(wait.look_ms, name, _WAKE)
                self._resolve(robot, self._now_ms - wait.since_ms)

    def _resolve(self, robot: SimulatedRobot, waited_ms: int) -> None:
        """Find a way for a robot that has waited, unless what is in its way moves anyhow."""
        ahead = robot.route[robot.step + 1]
        blockers = list(self._in_the_way(robot, ahead))
        if not blockers or any(self._busy(other) for other in blockers):
            return
        if self._detour(robot) or self._make_room(robot, blockers):
            self._deadlocks += 1
        elif waited_ms >= GIVE_UP_MS:
            commanded = self._goal(robot) is not None
            if commanded:
                self._failed.append((robot.name, f"no way past {', '.join(other.name for other in blockers)}"))
            self._rest(robot)

    def _busy(self, robot: SimulatedRobot) -> bool:
        claim = self._claim(robot)
        return robot.partner is not None or claim is None or claim[0] != claim[1]

    def _detour(self, robot: SimulatedRobot) -> bool:
        """Send a robot around all that stand, if there is a way; return whether there is."""
        ahead = robot.route[robot.step :]
        route = PathSearch(self._room(robot), robot.kind.diagonal).route(ahead[0], ahead[-1])
        longest = route_length(ahead, robot.kind.diagonal) + DETOUR_M / self._grid.resolution_m
        if route is None or route_length(route, robot.kind.diagonal) > longest:
            return False
        self._set_out(robot, route)
        return True

    def _make_room(self, robot: SimulatedRobot, blockers: Sequence[SimulatedRobot]) -> bool:
        """Send one of the robots that block each other aside; return whether one can."""
        order = list(self._robots)
        several = sorted((robot, *blockers), key=lambda one: (self._precedence(one), -order.index(one.name)))
        for pushing in (False, True):
            for one in several:
                winner = blockers[0] if one is robot else robot
                asked = self._drives(winner) and self._precedence(one) <= self._precedence(winner)
                if asked and self._step_aside(one, winner, pushing=pushing):
                    return True
        return False

    def _precedence(self, robot: SimulatedRobot) -> int:
        """Return 2 for a robot that is to dock now, 1 for one that drives, 0 for one that has nothing to do.

        One that makes room for another one counts as that one.
        """
        if any(robot.name in (each.rover, each.carrier) for each in self._handovers):
            return 2
        return int(self._drives(robot))

    def _drives(self, robot: SimulatedRobot) -> bool:
        """Return whether a robot has a way to go, which it may be waiting for."""
        return robot.activity is Activity.DRIVING and robot.step < len(robot.route) - 1

    def _step_aside(self, robot: SimulatedRobot, winner: SimulatedRobot, *, pushing: bool) -> bool:
        """Send a robot to the nearest place off the way of another one; return whether there is one."""
        assert robot.cell is not None
        room = self._room(robot, among=[winner] if pushing else None)
        lengths = PathSearch(room, robot.kind.diagonal).field(robot.cell)
        free = room.copy()
        free[robot.cell.y, robot.cell.x] = False
        _bar(free, self._way(winner), self._apart[robot.kind.name, winner.kind.name])
        lengths[~free] = math.inf
        nearest = int(lengths.argmin())
        if not math.isfinite(lengths.flat[nearest]):
            return False
        refuge = Cell(nearest % room.shape[1], nearest // room.shape[1])
        route = PathSearch(room, robot.kind.diagonal).route(robot.cell, refuge)
        assert route is not None
        goal = self._goal(robot) if robot.activity is Activity.DRIVING else None
        self._aside[robot.name] = _Aside(winner.name, robot.cell, goal, self._now_ms + LET_PASS_MS)
        self._push(self._now_ms + LET_PASS_MS, robot.name, _WAKE)
        self._set_out(robot, route)
        return True

    def _passed(self, robot: SimulatedRobot, errand: _Aside) -> bool:
        """Return whether the robot that was let through has passed the spot, or does not come any more."""
        if errand.winner is None or self._now_ms >= errand.until_ms:
            return True
        winner = self._robots[errand.winner]
        gone = winner.cell is None or winner.lost or not self._drives(winner)
        apart = self._apart[robot.kind.name, winner.kind.name]
        return gone or all(math.dist(cell, errand.spot) >= apart for cell in self._way(winner)[1:])

    def _go_on(self, robot: SimulatedRobot, errand: _Aside) -> None:
        """Send a robot that made room on to where its drive leads."""
        assert robot.cell is not None
        assert errand.goal is not None
        route = self._search(robot).route(robot.cell, errand.goal)
        del self._aside[robot.name]
        if route is None:
            self._failed.append((robot.name, "no way on from where it made room"))
            self._rest(robot)
        else:
            self._set_out(robot, route)

    def _room(self, robot: SimulatedRobot, among: Iterable[SimulatedRobot] | None = None) -> Mask:
        """Return the mask of known cells on which a robot can stand clear of all others, or of those `among`."""
        room = self._ground(robot.kind).copy()
        for other in self._robots.values() if among is None else among:
            claim = self._claim(other)
            if other is not robot and claim is not None and not self._meet(robot, other):
                _bar(room, claim, self._apart[robot.kind.name, other.kind.name])
        if robot.cell is not None:
            room[robot.cell.y, robot.cell.x] = True
        return room

    def _search(self, robot: SimulatedRobot) -> PathSearch:
        return PathSearch(self._ground(robot.kind), robot.kind.diagonal)

    def _ground(self, kind: RobotType) -> Mask:
        """Return the mask of known cells on which a robot of a type can stand, which stays as it is."""
        known = int(np.count_nonzero(self._known != UNKNOWN))
        if self._standable.get(kind.name, (0,))[0] != known:
            self._standable[kind.name] = known, standable(self._grid, kind)
        return self._standable[kind.name][1]

    # dockings

    def _begin_handovers(self) -> None:
        """Begin the dockings and undockings for which both robots are in place and there is room."""
        for asked in tuple(self._handovers):
            rover, carrier = self._robots[asked.rover], self._robots[asked.carrier]
            if not self._in_place(asked, rover, carrier):
                continue
            blockers = [] if asked.landing is None else list(self._in_the_way(rover, asked.landing))
            if not blockers:
                self._handovers.remove(asked)
                if asked.landing is None:
                    assert rover.cell is not None
                    self._docking[asked.rover] = rover.cell
                    super().dock(asked.rover, asked.carrier)
                else:
                    super().undock(asked.rover, asked.carrier, asked.landing)
                    self._posts[asked.rover] = asked.landing
            elif asked.wait.due(self._now_ms):
                self._push(asked.wait.look_ms, asked.carrier, _WAKE)
                for one in blockers:
                    if not self._busy(one):
                        self._deadlocks += any(self._step_aside(one, carrier, pushing=push) for push in (False, True))

    def _in_place(self, asked: _Handover, rover: SimulatedRobot, carrier: SimulatedRobot) -> bool:
        """Return whether both robots are free and near enough; who was asked aside is sent back if it is too far."""
        if any(robot.activity is not Activity.NONE for robot in (rover, carrier)):
            return False
        at = rover.cell if asked.landing is None else asked.landing
        limit = dock_range_cells(carrier.kind, rover.kind, self._grid.resolution_m)
        if at is None or carrier.cell is None or math.dist(at, carrier.cell) <= limit:
            return True
        sent = [self._send_back(robot) for robot in (rover, carrier)]
        return not any(sent)

    def _send_back(self, robot: SimulatedRobot) -> bool:
        """Send a robot back to where its last command left it; return whether it was not there."""
        post = self._posts[robot.name]
        if robot.cell is None or post is None or post == robot.cell:
            return False
        route = self._search(robot).route(robot.cell, post)
        if route is not None:
            self._aside[robot.name] = _Aside(None, robot.cell, None, self._now_ms)
            self._set_out(robot, route)
        return route is not None


def _gap(p: Cell, q: Cell, a: Cell, b: Cell) -> float:
    """Return the distance between two lines from a cell to the same or a neighbouring one."""
    if (p.x + q.x, p.y + q.y) == (a.x + b.x, a.y + b.y) and p != q and a != b:
        return 0.0  # they swap cells, or cross: diagonals of one square are the only lines that cross
    return min(_off(p, a, b), _off(q, a, b), _off(a, p, q), _off(b, p, q))


def _off(cell: Cell, a: Cell, b: Cell) -> float:
    """Return the distance of a cell from such a line."""
    x, y, dx, dy = cell.x - a.x, cell.y - a.y, b.x - a.x, b.y - a.y
    share = 0.0 if a == b else min(max((x * dx + y * dy) / (dx * dx + dy * dy), 0.0), 1.0)
    return math.hypot(x - share * dx, y - share * dy)


def _bar(mask: Mask, cells: Iterable[Cell], apart: float) -> None:
    """Take out of a mask all cells nearer than `apart` to one of these."""
    reach = math.ceil(apart)
    span = np.arange(-reach, reach + 1)
    near = np.hypot(span[:, None], span[None, :]) < apart
    height, width = mask.shape
    for cell in cells:
        top, left = max(0, cell.y - reach), max(0, cell.x - reach)
        bottom, right = min(height, cell.y + reach + 1), min(width, cell.x + reach + 1)
        rows, columns = (
            slice(top - cell.y + reach, bottom - cell.y + reach),
            slice(left - cell.x + reach, right - cell.x + reach),
        )
        mask[top:bottom, left:right] &= ~near[rows, columns]
