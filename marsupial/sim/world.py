"""The hidden world: robots drive along routes through it, dock, and see what is in line of sight.

A discrete-event simulation on integer milliseconds; it never sleeps. Every robot that is not carried senses from
every cell it passes: all cells in line of sight within its range, and those that its body would touch one cell further
on (`marsupial.maps.contact`). What the scenario's map does not know is solid here.
"""

from __future__ import annotations

import heapq
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from enum import StrEnum

import numpy as np

from marsupial.arrays import Ints
from marsupial.errors import InternalError
from marsupial.maps.contact import Contact
from marsupial.model.grid import UNKNOWN, Cell, CellArray, Grid
from marsupial.model.mission import PlacedRobot
from marsupial.model.robots import RobotType
from marsupial.model.world import Manoeuvres, News, RobotReport
from marsupial.native import native
from marsupial.paths.headings import Odometer
from marsupial.paths.routes import passing_times_ms
from marsupial.sim.sensors import Checked, FieldOfView, Sensor


class _Doing(StrEnum):
    NOTHING = "nothing"
    DRIVING = "driving"
    DOCKING = "docking"
    UNDOCKING = "undocking"


@dataclass(slots=True)
class _SimulatedRobot:
    name: str
    kind: RobotType
    cell: Cell | None
    carrier: str | None
    doing: _Doing = _Doing.NOTHING
    free_at_ms: int = 0
    route: tuple[Cell, ...] = ()
    times_ms: Ints = field(default_factory=lambda: np.zeros(0, dtype=np.int64))
    step: int = 0
    partner: str | None = None
    errand: int = 0
    lost: bool = False
    distance_cells: float = 0.0
    driving_ms: int = 0
    odometer: Odometer = field(default_factory=Odometer)


class SimulatedWorld:
    """A `World` with a truth in it.

    Parameters
    ----------
    truth
        The real map.
    kinds
        Robot types by name.
    robots
        The team at time 0; every robot on the ground sees its surroundings at once (`advance` tells).
    failures
        Mission time in ms at which a robot is lost, by name.
    sensor
        What robots see; None for the exact field of view.
    """

    def __init__(
        self,
        truth: Grid,
        kinds: Mapping[str, RobotType],
        robots: Sequence[PlacedRobot],
        failures: Mapping[str, int] | None = None,
        sensor: Sensor | None = None,
    ) -> None:
        self._truth = truth.solid()
        self._known = np.full_like(self._truth.cells, UNKNOWN)
        self._grid = Grid(
            cells=self._known,
            resolution_m=truth.resolution_m,
            origin_m=truth.origin_m,
            terrains=truth.terrains,
        )
        self._sensor = FieldOfView() if sensor is None else Checked(sensor)
        self._exact = sensor is None
        self._sensed: set[tuple[str, Cell]] = set()
        self._contact = {k.name: Contact(k, truth.resolution_m) for k in kinds.values()}
        self._robots = {
            r.name: _SimulatedRobot(name=r.name, kind=kinds[r.type], cell=r.cell, carrier=r.carrier) for r in robots
        }
        self._now_ms = 0
        self._heap: list[tuple[int, int, str, int]] = []
        self._count = 0
        for name, robot in self._robots.items():
            if robot.cell is not None:
                self._push(0, name, robot.errand)
        for name, t_ms in sorted((failures or {}).items()):
            self._push(t_ms, name, -1)

    @property
    def grid(self) -> Grid:
        """The known map."""
        return self._grid

    @property
    def now_ms(self) -> int:
        """Mission time."""
        return self._now_ms

    def robots(self) -> tuple[RobotReport, ...]:
        """Return every robot of the team in the order it was given."""
        return tuple(self._report(robot) for robot in self._robots.values())

    def distance_m(self, robot: str) -> float:
        """Return how far a robot has driven by itself, in metres."""
        return self._robots[robot].distance_cells * self._grid.resolution_m

    def driving_ms(self, robot: str) -> int:
        """Return how long a robot has been driving."""
        return self._robots[robot].driving_ms

    def manoeuvres(self, robot: str) -> Manoeuvres:
        """Return how often a robot has stopped and turned."""
        return self._robots[robot].odometer.manoeuvres

    def drive(self, robot: str, route: Sequence[Cell]) -> None:
        """Send a free robot along `route`, which starts at its cell."""
        mover = self._free(robot)
        if mover.cell is None or route[0] != mover.cell:
            raise InternalError(f"{robot} can't drive from {route[0]}: it is at {mover.cell}")
        mover.doing = _Doing.DRIVING
        mover.route, mover.step = tuple(route), 0
        kind, resolution_m = mover.kind, self._grid.resolution_m
        times_ms = passing_times_ms(mover.route, resolution_m, kind.speed_mps, kind.diagonal)
        mover.times_ms = self._now_ms + times_ms
        mover.odometer.set_off(self._now_ms)
        self._next_step(mover)

    def stop(self, robot: str) -> None:
        """Let a driving robot stop at the next cell of its route."""
        mover = self._robots[robot]
        if mover.doing is _Doing.DRIVING:
            mover.route = mover.route[: mover.step + 1]

    def dock(self, rover: str, carrier: str) -> None:
        """Let a free rover dock on a free carrier; the rover counts as aboard from now on."""
        guest, host = self._free(rover), self._free(carrier)
        load = sum(other.carrier == carrier and not other.lost for other in self._robots.values())
        if guest.cell is None or host.cell is None or load >= host.kind.capacity:
            raise InternalError(f"{rover} can't dock on {carrier}")
        guest.cell, guest.carrier = None, carrier
        guest.odometer.lift()
        self._together(guest, host, _Doing.DOCKING, guest.kind.dock_ms)

    def undock(self, rover: str, carrier: str, cell: Cell) -> None:
        """Let a free carrier set down one of its rovers on `cell`."""
        guest, host = self._free(rover), self._free(carrier)
        if guest.carrier != carrier:
            raise InternalError(f"{rover} is not on {carrier}")
        guest.cell, guest.carrier = cell, None
        self._together(guest, host, _Doing.UNDOCKING, guest.kind.undock_ms)

    def advance(self, until_ms: int) -> News:
        """Let time pass until something happens, at most until `until_ms`, and say what."""
        while self._heap and self._heap[0][0] <= until_ms:
            self._now_ms = self._heap[0][0]
            revealed: list[tuple[str, Ints]] = []
            finished: list[str] = []
            lost: list[tuple[str, str]] = []
            while self._heap and self._heap[0][0] == self._now_ms:
                _, _, name, errand = heapq.heappop(self._heap)
                robot = self._robots[name]
                if errand == -1:
                    lost += self._lose(robot)
                elif errand == robot.errand and not robot.lost:
                    if self._step(robot):
                        finished += [name] if robot.partner is None else sorted((name, robot.partner))
                        self._release(robot)
                    if robot.cell is not None:
                        seen = self._sense(robot, robot.cell)
                        if len(seen):
                            revealed.append((name, seen))
            if revealed or finished or lost:
                return News(t_ms=self._now_ms, revealed=tuple(revealed), finished=tuple(finished), lost=tuple(lost))
        self._now_ms = max(self._now_ms, until_ms)
        return News(t_ms=self._now_ms)

    def _report(self, robot: _SimulatedRobot) -> RobotReport:
        driving = robot.doing is _Doing.DRIVING
        return RobotReport(
            name=robot.name,
            type=robot.kind.name,
            cell=robot.route[robot.step] if driving else robot.cell,
            carrier=robot.carrier,
            free_at_ms=int(robot.times_ms[robot.step]) if driving else max(robot.free_at_ms, self._now_ms),
            lost=robot.lost,
            heading=robot.odometer.heading,
        )

    def _push(self, t_ms: int, name: str, errand: int) -> None:
        self._count += 1
        heapq.heappush(self._heap, (t_ms, self._count, name, errand))

    def _free(self, name: str) -> _SimulatedRobot:
        robot = self._robots[name]
        if robot.doing is not _Doing.NOTHING or robot.lost:
            raise InternalError(f"{name} is not free: {'lost' if robot.lost else robot.doing}")
        return robot

    def _next_step(self, robot: _SimulatedRobot) -> None:
        robot.errand += 1
        before, robot.step = robot.step, min(robot.step + 1, len(robot.route) - 1)
        if robot.step > before:
            robot.odometer.step(robot.route[before], robot.route[robot.step])
        self._push(int(robot.times_ms[robot.step]), robot.name, robot.errand)

    def _together(self, rover: _SimulatedRobot, carrier: _SimulatedRobot, doing: _Doing, duration_ms: int) -> None:
        for robot, partner in ((rover, carrier), (carrier, rover)):
            robot.doing, robot.partner = doing, partner.name
            robot.free_at_ms = self._now_ms + duration_ms
            robot.errand += 1
        self._push(rover.free_at_ms, rover.name, rover.errand)

    def _step(self, robot: _SimulatedRobot) -> bool:
        """Carry out what is due for `robot`; return whether its command has ended."""
        if robot.doing is _Doing.NOTHING:
            return False
        if robot.doing is not _Doing.DRIVING:
            return True
        there = robot.route[robot.step]
        if robot.cell is not None and there != robot.cell:
            robot.distance_cells += 1.0 if there.x == robot.cell.x or there.y == robot.cell.y else robot.kind.diagonal
            robot.driving_ms += int(robot.times_ms[robot.step] - robot.times_ms[robot.step - 1])
        robot.cell = there
        if robot.step == len(robot.route) - 1:
            robot.odometer.arrive(self._now_ms)
            return True
        self._next_step(robot)
        return False

    def _release(self, robot: _SimulatedRobot) -> None:
        for name in (robot.name, robot.partner):
            if name is not None:
                one = self._robots[name]
                one.doing, one.partner, one.route, one.step = _Doing.NOTHING, None, (), 0
                one.free_at_ms = self._now_ms

    def _lose(self, robot: _SimulatedRobot) -> list[tuple[str, str]]:
        """Let `robot` fail: it and, if it is a carrier, the rovers aboard act no more.

        A lost rover takes up no place aboard.
        """
        if robot.lost:
            return []
        partner = robot.partner
        robot.errand += 1
        self._release(robot)
        robot.lost = True
        news = [(robot.name, "failed")]
        if partner is not None:
            self._robots[partner].errand += 1
        for other in self._robots.values():
            if other.carrier == robot.name and not other.lost:
                other.lost = True
                news.append((other.name, f"aboard {robot.name}, which failed"))
        return news

    def _sense(self, robot: _SimulatedRobot, cell: Cell) -> Ints:
        """Reveal what `robot` sees from `cell`; return the row-major indices of what is new."""
        if self._exact:  # the truth stays as it is: from the same cell, a robot of that type sees nothing new
            if (robot.kind.name, cell) in self._sensed:
                return np.empty(0, dtype=np.int64)
            self._sensed.add((robot.kind.name, cell))
        seen = self._sensor.visible(self._truth, robot.kind, cell)
        touched = self._contact[robot.kind.name].touched(self._truth.cells, cell)
        fresh = np.empty(len(seen) + len(touched), dtype=np.int64)
        count = _reveal(seen, self._truth.cells, self._known, fresh)
        count += _reveal(touched, self._truth.cells, self._known, fresh[count:])
        return np.sort(fresh[:count])


@native
def _reveal(cells: Ints, truth: CellArray, known: CellArray, fresh: Ints) -> int:
    """Enter cells (row-major) in the `known` map, list those that are new in `fresh`, and return how many they are."""
    codes, found = truth.ravel(), known.ravel()
    count = 0
    for index in cells:
        if found[index] == UNKNOWN:
            found[index] = codes[index]
            fresh[count] = index
            count += found[index] != UNKNOWN
    return count
