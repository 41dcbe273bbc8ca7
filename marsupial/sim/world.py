"""The simulator: robots drive through a hidden map, dock, and reveal what they see.

It is a discrete-event simulation in integer milliseconds: `advance` jumps from event to event and never sleeps. Each
robot on the ground senses from every cell that it passes: all cells in line of sight within its range, and those that
its body would touch one cell further on. What rovers out of contact see is held until they are in contact again: the
known map is that of all others. One with a sensor angle sees only ahead while it drives; where it stands it
turns on the spot, which takes no time, and sees all around. Unknown cells of the scenario's map are obstacles.

The event heap holds (time, sequence number, robot, event number). When a robot is lost, its event and that of its
docking partner stay in the heap, but they no longer have the number that the robot expects, and are ignored. Numbers
from `FIRST_FAULT` down are those of faults (`marsupial.sim.faults`).
"""

import heapq
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from enum import StrEnum

import numpy as np

from marsupial.arrays import Ints
from marsupial.errors import InternalError
from marsupial.maps.footprint import Contact
from marsupial.maps.territory import contact_range_cells
from marsupial.model import UNKNOWN, Cell, CellArray, Grid, Manoeuvres, News, PlacedRobot, RobotReport, RobotType
from marsupial.model.seats import has_place
from marsupial.model.world import MomentNews
from marsupial.native import native
from marsupial.paths.routes import Odometer, Route, passing_times_ms
from marsupial.sim.radio import in_contact
from marsupial.sim.sensors import Checked, FieldOfView, Sensor, ahead


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


FIRST_FAULT = -3  # event number of the first fault, the second has -4; derived classes have -1 and -2


class SimulatedWorld:
    """A simulated `World`.

    Robots on the ground see their surroundings at time 0: the first news of `advance`. Without a `sensor` they have the
    exact field of view.
    """

    def __init__(
        self,
        truth: Grid,
        kinds: Mapping[str, RobotType],
        robots: Sequence[PlacedRobot],
        sensor: Sensor | None = None,
    ) -> None:
        self._truth = truth.solid()
        self._known = np.full_like(self._truth.cells, UNKNOWN)
        self.grid = Grid(
            cells=self._known,
            resolution_m=truth.resolution_m,
            origin_m=truth.origin_m,
            terrains=truth.terrains,
            chargers=truth.chargers,
        )
        self._sensor = FieldOfView() if sensor is None else Checked(sensor)
        self._exact = sensor is None  # a second look by the same type from the same cell reveals nothing
        self._sensed: set[tuple[str, Cell, int | None]] = set()  # type, cell, and where it looked
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
        self._moment = MomentNews()
        ranges = {k.name: contact_range_cells(k, kinds.values(), truth.resolution_m) for k in kinds.values()}
        self._radios = {r.name: ranges[r.type] for r in robots if kinds[r.type].radio_range_m is not None}
        self._set_up(kinds)

    @property
    def _sees_known(self) -> bool:
        """Whether it matters which known cells robots see."""
        return False

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
        self._follow(mover, tuple(route))

    def stop(self, robot: str) -> None:
        mover = self._robots[robot]
        if mover.activity is RobotActivity.DRIVING:
            mover.route = mover.route[: mover.step + 1]

    def dock(self, rover: str, carrier: str) -> None:
        guest, host = self._free(rover), self._free(carrier)
        if guest.cell is None or host.cell is None or not self._has_place(host, guest):
            raise InternalError(f"{rover} can't dock on {carrier}")
        guest.left, guest.cell, guest.carrier = guest.cell, None, carrier
        guest.odometer.lift()
        self._start(guest, host, RobotActivity.DOCKING, guest.kind.dock_ms)

    def undock(self, rover: str, carrier: str, cell: Cell) -> None:
        guest, host = self._free(rover), self._free(carrier)
        if guest.carrier != carrier:
            raise InternalError(f"{rover} is not on {carrier}")
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
            if number < 0:
                self._happen(number, name)
                continue
            robot = self._robots[name]
            if number == robot.due and not robot.lost:
                if self._step(robot):
                    self._complete(robot)
                if robot.cell is not None:  # it passed a cell, or was just set down on one
                    self._look_round(robot)
        if self._radios:
            self._check_contact()
        return self._gathered()

    def _gathered(self) -> News | None:
        """Return the news of the present moment so far, None if there is none, and begin anew."""
        news = self._moment.news(self.now_ms)
        if news is not None:
            self._moment = MomentNews()
        return news

    def _times_ms(self, robot: SimulatedRobot, route: Sequence[Cell]) -> Ints:
        """Return when a robot that sets off now passes the cells of a route."""
        kind, speed_mps = robot.kind, robot.kind.speed_mps * robot.speed
        return self.now_ms + passing_times_ms(route, self.grid.resolution_m, speed_mps, kind.diagonal)

    def _complete(self, robot: SimulatedRobot) -> None:
        """End the command of a robot."""
        self._moment.finished += [robot.name] if robot.partner is None else sorted((robot.name, robot.partner))
        self._end_command(robot)

    def _look_round(self, robot: SimulatedRobot) -> None:
        """Let a robot on the ground sense from its cell."""
        assert robot.cell is not None
        if self._exact:
            look = robot.kind.name, robot.cell, self._looks_to(robot)
            if look in self._sensed or (robot.kind.name, robot.cell, None) in self._sensed:
                return
            if robot.held is None:
                self._sensed.add(look)
        seen = self._seen(robot, robot.cell)
        self._learn(robot, seen, self._contact[robot.kind.name].touched(self._truth.cells, robot.cell))

    def _seen(self, robot: SimulatedRobot, cell: Cell) -> Ints:
        """Return the row-major indices of the cells that a robot sees from a cell, perhaps without known ones."""
        known = None if self._sees_known else self._map_of(robot)
        seen = self._sensor.visible(self._truth, robot.kind, cell, known)
        heading, angle_deg = self._looks_to(robot), robot.kind.sensor_angle_deg
        return seen if heading is None or angle_deg is None else ahead(seen, self._truth, cell, heading, angle_deg)

    def _looks_to(self, robot: SimulatedRobot) -> int | None:
        """Return the heading to which a robot's view is limited; None if it sees all around."""
        driving = robot.activity is RobotActivity.DRIVING
        return robot.odometer.heading if driving and robot.kind.sensor_angle_deg is not None else None

    def _learn(self, robot: SimulatedRobot, seen: Ints, touched: Ints) -> None:
        """Add the cells (row-major indices) that a robot sees and touches to its map."""
        fresh = np.empty(len(seen) + len(touched), dtype=np.int64)
        known = self._map_of(robot)
        count = _reveal(seen, self._truth.cells, known, fresh)
        count += _reveal(touched, self._truth.cells, known, fresh[count:])
        if count and robot.held is None:
            # sorted, as the log encodes runs of neighbouring cells
            self._moment.revealed.append((robot.name, np.sort(fresh[:count])))

    def _map_of(self, robot: SimulatedRobot) -> CellArray:
        """Return the map that a robot adds to: the known one, or what it has seen since it was last in contact."""
        return self._known if robot.held is None else robot.held

    def _check_contact(self) -> None:
        """Note which rovers are no longer in contact, and which are again; lost ones are found, but not lost again."""
        heard = in_contact(self._robots.values(), self._radios)
        for name in self._radios:
            robot = self._robots[name]
            if robot.held is None and name not in heard and not robot.lost:
                robot.held = np.full_like(self._known, UNKNOWN)
                self._moment.out_of_contact.append(name)
            elif robot.held is not None and name in heard:
                self._hand_in(robot, robot.held)

    def _hand_in(self, robot: SimulatedRobot, held: CellArray) -> None:
        """Add what a rover has seen out of contact to the known map."""
        known, seen = self._known.ravel(), held.ravel()
        new = np.flatnonzero((seen != UNKNOWN) & (seen != known))
        fresh = new[known[new] == UNKNOWN]
        # others may have seen since how ground that it saw has changed
        changed = new[(known[new] != UNKNOWN) & (seen[new] == self._truth.cells.ravel()[new])]
        for cells, events in ((fresh, self._moment.revealed), (changed, self._moment.changed)):
            known[cells] = seen[cells]
            if len(cells):
                events.append((robot.name, cells))
        robot.held = None
        self._moment.in_contact.append(robot.name)

    def _happen(self, number: int, name: str) -> None:
        """Let an event of a derived class happen, perhaps to a robot."""

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
            speed=robot.told_speed,
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

    def _has_place(self, carrier: SimulatedRobot, rover: SimulatedRobot) -> bool:
        """Return whether a place for a rover is free; an undocking may fail, so its rover keeps its place."""
        undocked = carrier.partner if carrier.activity is RobotActivity.UNDOCKING else None
        others = (r for r in self._robots.values() if (r.carrier == carrier.name and not r.lost) or r.name == undocked)
        return has_place(carrier.kind, rover.kind.name, [other.kind.name for other in others])

    def _next_step(self, robot: SimulatedRobot) -> None:
        robot.due += 1
        if robot.slowed_ms is not None and robot.slowed_ms < self.now_ms:
            left, robot.slowed_ms = robot.route[robot.step :], None
            robot.times_ms = np.concatenate([robot.times_ms[: robot.step], self._times_ms(robot, left)])
            if robot.tells_speed:
                self._moment.passages.append((robot.name, left))
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
                one.free_at_ms, one.slowed_ms = self.now_ms, None


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
