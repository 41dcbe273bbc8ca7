"""The simulator: robots drive through a hidden map, dock, and reveal what they see.

It is a discrete-event simulation in integer milliseconds: `advance` jumps from event to event and never sleeps. Each
robot on the ground senses from every cell that it passes: all cells in line of sight within its range, and those that
its body would touch one cell further on. Unknown cells of the scenario's map are obstacles.

The event heap holds (time, sequence number, robot, event number). When a robot is lost, its event and that of its
docking partner stay in the heap, but they no longer have the number that the robot expects, and are ignored. Faults
(`marsupial.model.faults`) are events with numbers from `_FAULT` down.
"""

import heapq
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from enum import StrEnum
from typing import Any

import numpy as np

from marsupial.arrays import Ints
from marsupial.errors import InternalError
from marsupial.maps.footprint import Contact, disc
from marsupial.model import UNKNOWN, Cell, CellArray, Grid, Manoeuvres, News, PlacedRobot, RobotReport, RobotType
from marsupial.model.faults import Fault, FaultKind
from marsupial.native import native
from marsupial.paths.routes import Odometer, Route, passing_times_ms
from marsupial.sim.sensors import Checked, FieldOfView, Sensor


class RobotActivity(StrEnum):
    """What a robot is doing."""

    NONE = "nothing"
    DRIVING = "driving"
    DOCKING = "docking"
    UNDOCKING = "undocking"


@dataclass(slots=True)
class SimulatedRobot:
    """A robot as the simulator knows it."""

    name: str
    kind: RobotType
    cell: Cell | None
    carrier: str | None
    activity: RobotActivity = RobotActivity.NONE
    free_at_ms: int = 0
    route: tuple[Cell, ...] = ()
    times_ms: Ints = field(default_factory=lambda: np.zeros(0, dtype=np.int64))
    step: int = 0
    partner: str | None = None
    due: int = 0  # number of the event that it expects
    lost: bool = False
    lost_with: str | None = None  # the carrier with which it was lost
    speed: float = 1.0  # share of its type's speed at which it drives
    slowed: bool = False  # whether `speed` changed during its drive, since the last cell
    declines: bool = False  # whether it refuses its next command
    slips: int = 0  # number of next dockings and undockings that fail
    left: Cell | None = None  # where it stood before its docking began; None before an undocking
    distance_cells: float = 0.0
    driving_ms: int = 0
    odometer: Odometer = field(default_factory=Odometer)


_FAULT = -3  # event number of the first fault in the list, the second has -4; -2 is used in `marsupial.sim.claims`

_AGAIN_MS = 1000  # least time until ground that robots stand on is tried again to change


@dataclass(slots=True)
class _MomentNews:
    """The events of one moment so far, as in `News`."""

    revealed: list[tuple[str, Ints]] = field(default_factory=list)
    changed: list[tuple[str, Ints]] = field(default_factory=list)
    finished: list[str] = field(default_factory=list)
    failed: list[tuple[str, str]] = field(default_factory=list)
    declined: list[tuple[str, str]] = field(default_factory=list)
    lost: list[tuple[str, str]] = field(default_factory=list)
    returned: list[str] = field(default_factory=list)
    slowed: list[tuple[str, float]] = field(default_factory=list)
    passages: list[tuple[str, tuple[Cell, ...]]] = field(default_factory=list)

    def news(self, t_ms: int) -> News | None:
        """Return the news, None if there is none."""
        parts: dict[str, Any] = {name: tuple(events) for name in self.__slots__ if (events := getattr(self, name))}
        return News(t_ms=t_ms, **parts) if parts else None


_NONE: Ints = np.empty(0, dtype=np.int64)


class SimulatedWorld:
    """A simulated `World`.

    Robots on the ground see their surroundings at time 0: the first news of `advance`. `faults` are dated
    (`marsupial.model.faults.dated`). Without a `sensor` robots have the exact field of view.
    """

    def __init__(
        self,
        truth: Grid,
        kinds: Mapping[str, RobotType],
        robots: Sequence[PlacedRobot],
        faults: Sequence[Fault] = (),
        sensor: Sensor | None = None,
    ) -> None:
        self._truth = truth.solid()
        self._known = np.full_like(self._truth.cells, UNKNOWN)
        self.grid = Grid(
            cells=self._known, resolution_m=truth.resolution_m, origin_m=truth.origin_m, terrains=truth.terrains
        )
        self._sensor = FieldOfView() if sensor is None else Checked(sensor)
        self._exact = sensor is None
        self._sensed: set[tuple[str, Cell]] = set()
        self._contact = {k.name: Contact(k, truth.resolution_m) for k in kinds.values()}
        self._robots = {
            r.name: SimulatedRobot(name=r.name, kind=kinds[r.type], cell=r.cell, carrier=r.carrier) for r in robots
        }
        self.now_ms = 0
        self._heap: list[tuple[int, int, str, int]] = []
        self._count = 0
        # the first look of each robot on the ground
        for name, robot in self._robots.items():
            if robot.cell is not None:
                self._push(0, name, robot.due)
        self._moment = _MomentNews()
        self._set_up(kinds)
        self._set_faults(faults)

    def _set_faults(self, faults: Sequence[Fault]) -> None:
        self._faults = faults
        self._when_seen: dict[int, Fault] = {}  # by number: those that happen when a cell is seen
        self._misses: list[tuple[float, np.random.Generator]] = []  # shares of missed cells
        self._changing = any(fault.kind is FaultKind.GROUND for fault in faults)
        for i, fault in enumerate(faults):
            if fault.kind is FaultKind.MISSED_CELLS:
                self._misses.append((fault.share, np.random.default_rng(fault.seed)))
            elif fault.at_ms is not None:
                self._push(fault.at_ms, fault.robot or "", _FAULT - i)
            else:
                self._when_seen[_FAULT - i] = fault
            if fault.kind is FaultKind.JOINS and fault.robot is not None:
                self._moment.lost += self._lose(self._robots[fault.robot], "is absent until it joins")

    def _set_up(self, kinds: Mapping[str, RobotType]) -> None:
        """Set up the state of a derived class; the world itself is complete by then."""

    def robots(self) -> tuple[RobotReport, ...]:
        return tuple(self._report(robot) for robot in self._robots.values())

    def distance_m(self, robot: str) -> float:
        return self._robots[robot].distance_cells * self.grid.resolution_m

    def driving_ms(self, robot: str) -> int:
        return self._robots[robot].driving_ms

    def manoeuvres(self, robot: str) -> Manoeuvres:
        return self._robots[robot].odometer.manoeuvres

    def drive(self, robot: str, route: Sequence[Cell]) -> None:
        mover = self._free(robot)
        if mover.cell is None or route[0] != mover.cell:
            raise InternalError(f"{robot} can't drive from {route[0]}: it is at {mover.cell}")
        if not self._declined(robot):
            self._follow(mover, tuple(route))

    def stop(self, robot: str) -> None:
        mover = self._robots[robot]
        if mover.activity is RobotActivity.DRIVING:
            mover.route = mover.route[: mover.step + 1]

    def dock(self, rover: str, carrier: str) -> None:
        guest, host = self._free(rover), self._free(carrier)
        if guest.cell is None or host.cell is None or self._is_full(host):
            raise InternalError(f"{rover} can't dock on {carrier}")
        if self._declined(rover, carrier):
            return
        guest.left, guest.cell, guest.carrier = guest.cell, None, carrier
        guest.odometer.lift()
        self._start(guest, host, RobotActivity.DOCKING, guest.kind.dock_ms)

    def undock(self, rover: str, carrier: str, cell: Cell) -> None:
        guest, host = self._free(rover), self._free(carrier)
        if guest.carrier != carrier:
            raise InternalError(f"{rover} is not on {carrier}")
        if self._declined(rover, carrier):
            return
        guest.left, guest.cell, guest.carrier = None, cell, None
        self._start(guest, host, RobotActivity.UNDOCKING, guest.kind.undock_ms)

    def advance(self, until_ms: int) -> News:
        moment = self._moment  # commands may have had effects at once
        if (moment.failed or moment.declined or moment.passages) and (news := self._gathered()):
            return news
        while self._heap and self._heap[0][0] <= until_ms:
            news = self._next_moment()
            if news is not None:
                return news
        self.now_ms = max(self.now_ms, until_ms)
        return News(t_ms=self.now_ms)

    def _next_moment(self) -> News | None:
        """Let time pass to the next events, and process them; return the news of that moment, None if there is none."""
        self.now_ms = self._heap[0][0]
        while self._heap and self._heap[0][0] == self.now_ms:
            _, _, name, number = heapq.heappop(self._heap)
            if number <= _FAULT:
                self._happen(number)
                continue
            robot = self._robots[name]
            if number == robot.due and not robot.lost:
                if self._step(robot):
                    self._complete(robot)
                if robot.cell is not None:  # it passed a cell, or was just set down on one
                    self._look_round(robot)
        return self._gathered()

    def _gathered(self) -> News | None:
        """Return the news of the present moment so far, None if there is none, and begin anew."""
        moment, self._moment = self._moment, _MomentNews()
        return moment.news(self.now_ms)

    def _times_ms(self, robot: SimulatedRobot, route: Sequence[Cell]) -> Ints:
        """Return when a robot that sets off now passes the cells of a route."""
        kind, speed_mps = robot.kind, robot.kind.speed_mps * robot.speed
        return self.now_ms + passing_times_ms(route, self.grid.resolution_m, speed_mps, kind.diagonal)

    def _complete(self, robot: SimulatedRobot) -> None:
        """End the command of a robot, as finished or as a docking or undocking that failed."""
        names = [robot.name] if robot.partner is None else sorted((robot.name, robot.partner))
        slips = [one for name in names if (one := self._robots[name]).slips] if robot.partner else []
        if slips:
            slips[0].slips -= 1
            carrier = robot.partner if robot.activity is RobotActivity.UNDOCKING else None
            robot.cell, robot.carrier = robot.left, carrier
            self._moment.failed += [(name, f"{robot.activity} failed") for name in names]
        else:
            self._moment.finished += names
        self._end_command(robot)

    def _look_round(self, robot: SimulatedRobot) -> None:
        """Let a robot on the ground sense from its cell."""
        assert robot.cell is not None
        fresh, changed = self._sense(robot, robot.cell)
        if len(fresh):
            self._moment.revealed.append((robot.name, fresh))
        if len(changed):
            self._moment.changed.append((robot.name, changed))
        for number, fault in list(self._when_seen.items()):
            if fault.seen is not None and self._known[fault.seen.y, fault.seen.x] != UNKNOWN:
                del self._when_seen[number]
                self._push(self.now_ms, fault.robot or robot.name, number)

    def _report(self, robot: SimulatedRobot) -> RobotReport:
        # a driving robot can stop at the next cell of its route at the earliest
        driving = robot.activity is RobotActivity.DRIVING
        return RobotReport(
            name=robot.name,
            type=robot.kind.name,
            cell=robot.route[robot.step] if driving else robot.cell,
            carrier=robot.carrier,
            free_at_ms=int(robot.times_ms[robot.step]) if driving else max(robot.free_at_ms, self.now_ms),
            lost=robot.lost,
            heading=robot.odometer.heading,
            speed=robot.speed,
        )

    def _push(self, t_ms: int, name: str, number: int) -> None:
        self._count += 1
        heapq.heappush(self._heap, (t_ms, self._count, name, number))

    def _free(self, name: str) -> SimulatedRobot:
        robot = self._robots[name]
        if robot.activity is not RobotActivity.NONE or robot.lost or robot.free_at_ms > self.now_ms:
            raise InternalError(f"{name} is not free: {'lost' if robot.lost else robot.activity}")
        return robot

    def _follow(self, robot: SimulatedRobot, route: Route) -> None:
        """Send a robot along a route from its cell."""
        if robot.activity is not RobotActivity.DRIVING:
            robot.activity = RobotActivity.DRIVING
            robot.odometer.set_off(self.now_ms)
        robot.route, robot.step, robot.times_ms = route, 0, self._times_ms(robot, route)
        self._next_step(robot)

    def _is_full(self, carrier: SimulatedRobot) -> bool:
        """Return whether all places are taken; an undocking may fail, so its rover keeps its place until the end."""
        carried = sum(other.carrier == carrier.name and not other.lost for other in self._robots.values())
        return carried + (carrier.activity is RobotActivity.UNDOCKING) >= carrier.kind.capacity

    def _declined(self, *names: str) -> bool:
        """Return whether one of these robots refuses the command that they get."""
        robot = next((one for name in names if (one := self._robots[name]).declines), None)
        if robot is None:
            return False
        robot.declines = False
        self._moment.declined += [(name, f"{robot.name} declined") for name in names]
        return True

    def _next_step(self, robot: SimulatedRobot) -> None:
        robot.due += 1
        if robot.slowed:
            ahead, robot.slowed = robot.route[robot.step :], False
            robot.times_ms = np.concatenate([robot.times_ms[: robot.step], self._times_ms(robot, ahead)])
            self._moment.passages.append((robot.name, ahead))
        # the route may have one cell only: a drive to where the robot stands ends at once
        before, robot.step = robot.step, min(robot.step + 1, len(robot.route) - 1)
        if robot.step > before:
            robot.odometer.step(robot.route[before], robot.route[robot.step])
        self._push(int(robot.times_ms[robot.step]), robot.name, robot.due)

    def _start(self, rover: SimulatedRobot, carrier: SimulatedRobot, activity: RobotActivity, duration_ms: int) -> None:
        """Start a docking or undocking of both robots; its event is the rover's."""
        for robot, partner in ((rover, carrier), (carrier, rover)):
            robot.activity, robot.partner = activity, partner.name
            robot.free_at_ms = self.now_ms + duration_ms
            robot.due += 1
        self._push(rover.free_at_ms, rover.name, rover.due)

    def _step(self, robot: SimulatedRobot) -> bool:
        """Process the event of a robot; return whether its command has ended."""
        if robot.activity is RobotActivity.NONE:
            return False
        if robot.activity is not RobotActivity.DRIVING:
            return True
        there = robot.route[robot.step]
        if robot.cell is not None and there != robot.cell:
            robot.distance_cells += 1.0 if there.x == robot.cell.x or there.y == robot.cell.y else robot.kind.diagonal
            robot.driving_ms += int(robot.times_ms[robot.step] - robot.times_ms[robot.step - 1])
        robot.cell = there
        if robot.step == len(robot.route) - 1:
            robot.odometer.arrive(self.now_ms)
            return True
        self._next_step(robot)
        return False

    def _end_command(self, robot: SimulatedRobot) -> None:
        for name in (robot.name, robot.partner):
            if name is not None:
                one = self._robots[name]
                one.activity, one.partner, one.route, one.step = RobotActivity.NONE, None, (), 0
                one.free_at_ms, one.slowed = self.now_ms, False

    def _halt(self, robot: SimulatedRobot) -> None:
        """Stop a robot where it stands, without an end of its command."""
        robot.odometer.arrive(self.now_ms)
        robot.due += 1
        self._end_command(robot)

    def _lose(self, robot: SimulatedRobot, what: str = "failed") -> list[tuple[str, str]]:
        """Mark `robot` as lost, with all rovers aboard; a lost rover takes up no place aboard."""
        if robot.lost:
            return []
        # the event of a docking is the rover's, so both numbers have to change
        partner = robot.partner
        robot.due += 1
        self._end_command(robot)
        robot.lost = True
        news = [(robot.name, what)]
        if partner is not None:
            self._robots[partner].due += 1
        for other in self._robots.values():
            if other.carrier == robot.name and not other.lost:
                other.lost, other.lost_with = True, robot.name
                news.append((other.name, f"aboard {robot.name}, which {what}"))
        return news

    # faults

    def _happen(self, number: int) -> None:
        """Let the fault of an event number happen, now or when it can."""
        fault, now_ms = self._faults[_FAULT - number], self.now_ms
        if fault.kind is FaultKind.GROUND:
            if self._is_occupied(fault):
                # less and less often, as robots may stand there for hours
                self._push(now_ms + max(_AGAIN_MS, (now_ms - (fault.at_ms or 0)) // 8), "", number)
            else:
                self._change_ground(fault)
            return
        assert fault.robot is not None
        robot = self._robots[fault.robot]
        match fault.kind:
            case FaultKind.LOST:
                lost = self._lose(robot)
                names = [name for name, _ in lost]
                self._moment.lost += lost
                self._moment.returned = [name for name in self._moment.returned if name not in names]  # lost again
            case FaultKind.RETURNS | FaultKind.JOINS:
                self._return(robot)
            case FaultKind.SLOWS if robot.speed != fault.share:
                robot.speed, robot.slowed = fault.share, robot.activity is RobotActivity.DRIVING
                self._moment.slowed.append((robot.name, fault.share))
            case FaultKind.STUCK if robot.partner is not None:
                self._push(robot.free_at_ms + 1, robot.name, number)  # dockings aren't interrupted
            case FaultKind.STUCK if robot.cell is not None and not robot.lost:
                free_at_ms = max(robot.free_at_ms, now_ms + fault.for_ms)
                self._halt(robot)
                robot.free_at_ms = free_at_ms
                self._moment.failed.append((robot.name, "stuck"))
            case FaultKind.DECLINES:
                robot.declines = True
            case FaultKind.DOCKING_FAILS:
                robot.slips += 1

    def _return(self, robot: SimulatedRobot) -> None:
        """Make a lost robot act again, with the rovers that were lost aboard it; one without a place aboard can't."""
        if not robot.lost:
            return
        if robot.carrier is not None:
            host = self._robots[robot.carrier]
            if host.lost or self._is_full(host):
                return
        robot.lost, robot.lost_with, robot.free_at_ms = False, None, self.now_ms
        self._moment.returned.append(robot.name)
        if robot.cell is not None:
            self._look_round(robot)
        for other in self._robots.values():
            if other.lost_with == robot.name and other.carrier == robot.name:
                self._return(other)

    def _is_occupied(self, fault: Fault) -> bool:
        """Return whether the body of a robot on the ground is in the area of a fault, or about to be."""
        assert fault.area is not None
        low, high = fault.area
        for robot in self._robots.values():
            # the next cell, and the one after: a robot is on its way to it before it can see a change
            ahead = robot.route[robot.step : robot.step + 2]
            corners = [Cell(a.x, b.y) for a in ahead for b in ahead]
            for cell in (robot.cell, robot.left if robot.partner else None, *corners):
                if cell is not None:
                    at = np.array(cell) + disc(robot.kind.radius_m / self.grid.resolution_m)
                    if ((at >= low) & (at <= high)).all(axis=1).any():
                        return True
        return False

    def _change_ground(self, fault: Fault) -> None:
        """Change the true terrain of an area; robots that stand look at it at once, driving ones at their next cell."""
        assert fault.area is not None
        low, high = fault.area
        cells = self._truth.cells.copy()
        cells[low.y : high.y + 1, low.x : high.x + 1] = fault.terrain
        self._truth = replace(self._truth, cells=cells)
        self._sensed.clear()
        for name, robot in self._robots.items():
            if robot.activity is RobotActivity.NONE and robot.cell is not None and not robot.lost:
                self._push(self.now_ms, name, robot.due)

    def _sense(self, robot: SimulatedRobot, cell: Cell) -> tuple[Ints, Ints]:
        """Reveal what `robot` sees from `cell`; return the row-major indices of the new cells and of the changed."""
        if self._exact and not self._misses:  # a second look by the same type from the same cell reveals nothing
            if (robot.kind.name, cell) in self._sensed:
                return _NONE, _NONE
            self._sensed.add((robot.kind.name, cell))
        seen = self._sensor.visible(self._truth, robot.kind, cell)
        for share, rng in self._misses:
            seen = seen[rng.random(len(seen)) >= share]
        touched = self._contact[robot.kind.name].touched(self._truth.cells, cell)
        changed = _NONE
        if self._changing:
            noticed = np.union1d(seen, touched)
            before, codes = self._known.ravel()[noticed], self._truth.cells.ravel()[noticed]
            changed = noticed[(before != UNKNOWN) & (before != codes)]
            self._known.ravel()[changed] = self._truth.cells.ravel()[changed]
        fresh = np.empty(len(seen) + len(touched), dtype=np.int64)
        count = _reveal(seen, self._truth.cells, self._known, fresh)
        count += _reveal(touched, self._truth.cells, self._known, fresh[count:])
        # sorted, as the log encodes runs of neighbouring cells
        return np.sort(fresh[:count]), changed


@native
def _reveal(cells: Ints, truth: CellArray, known: CellArray, fresh: Ints) -> int:
    """Copy cells (row-major) from `truth` to `known`, write the new ones to `fresh`, and return their number."""
    codes, found = truth.ravel(), known.ravel()
    count = 0
    for index in cells:
        if found[index] == UNKNOWN:
            found[index] = codes[index]
            fresh[count] = index
            count += found[index] != UNKNOWN
    return count
