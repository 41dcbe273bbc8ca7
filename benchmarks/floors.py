"""Random situations on synthetic floors: rover-only rooms between corridors for carriers.

Most instances of the planner suite (`marsupial.bench.suite.catalogue`) were drawn here, by `FLOORS`; the others are
moments of missions.

    +=====+=======+     =, |: corridors, like streets between blocks of different sizes
    |  .  D   .   |     each block is a room; D: a door, which is a meeting point
    +=====+===D===+     .: targets, most of them in rooms

A carrier drives along corridors; a rover drives straight or diagonally inside a room, at half the speed. `roaming`
rovers also pass doors and drive along corridors.

Positions are integers, in ms at a carrier's speed. Only `random.Random.random` draws them, whose sequence is the same
on every machine and Python version, so a floor never changes.
"""

import random
from bisect import bisect_right
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from marsupial.model import UNREACHABLE, PlanningType, RobotState, Situation, SituationGoal, TargetInfo, TravelTable
from marsupial.model.robots import Role

DOCK_MS, UNDOCK_MS = 10_000, 5_000
ROVER_SLOWNESS = 2
OWN_TARGETS = 10  # one target in this many is in a corridor
FAR = 10**12  # no path, while tables are computed


@dataclass(frozen=True, slots=True, kw_only=True)
class Floor:
    """The parameters of a floor."""

    seed: int
    carriers: int
    rovers: int  # aboard each carrier, which is its capacity
    targets: int
    rooms: int  # for rovers only
    doors: int = 1  # of each room; the second is opposite the first
    lot_ms: tuple[int, int] = (12_000, 12_000)  # least width and height of a block; the greatest is twice that
    scattered: bool = False  # carriers start in any corridor, not all in the first one
    roaming: bool = False  # rovers drive along corridors too
    # every other carrier is busy, and every other rover on the ground in a room, half of those busy
    in_flight: bool = False
    recover: bool = False
    homes: bool = False  # every carrier must return to its start

    def situation(self) -> Situation:
        return _FloorDrawing(self).situation()


@dataclass(frozen=True, slots=True)
class FloorPoint:
    """A position in a corridor, in a room (its number), or in both: at a door."""

    x: int
    y: int
    corridor: bool
    room: int | None = None


class _FloorDrawing:
    """One drawing of a floor: its corridors first, then doors, targets and robots."""

    def __init__(self, floor: Floor) -> None:
        self._floor = floor
        self._random = random.Random(floor.seed)
        columns = next(n for n in range(1, floor.rooms + 1) if n * n >= floor.rooms)
        rows = -(-floor.rooms // columns)
        self._xs = self._lines(columns, floor.lot_ms[0])
        self._ys = self._lines(rows, floor.lot_ms[1])
        lots = [(i, j) for j in range(rows) for i in range(columns)]
        self._rooms = lots[: floor.rooms]

    def situation(self) -> Situation:
        floor = self._floor
        meetings = [point for room in range(floor.rooms) for point in self._doors(room)]
        # the order of draws is part of the suite: any other order would make other floors
        own = max(1, floor.targets // OWN_TARGETS)
        # the first targets go to one room each, so that no room is empty
        targets = [self._inside(i % floor.rooms if i < floor.rooms else self._below(floor.rooms))
                   for i in range(floor.targets - own)]  # fmt: skip
        targets += [self._in_corridor() for _ in range(own)]
        infos = tuple(self._target(i, point) for i, point in enumerate(targets, 1))
        robots, starts = self._robots()
        homes = [point for robot, point in zip(robots, starts, strict=True) if robot.home and point]
        points = [point for point in starts if point] + targets + meetings + homes
        return Situation(
            types=(
                PlanningType(name="carrier", role=Role.CARRIER, capacity=floor.rovers),
                PlanningType(name="rover", role=Role.ROVER, dock_ms=DOCK_MS, undock_ms=UNDOCK_MS),
            ),
            robots=tuple(robots),
            targets=infos,
            meetings=tuple(f"m{i}" for i in range(1, len(meetings) + 1)),
            homes=tuple(robot.home for robot in robots if robot.home),
            travel_ms={"carrier": self._carriers_table(points), "rover": self._rovers_table(points)},
            goal=SituationGoal(recover_rovers=floor.recover, return_home=floor.homes),
        )

    def _below(self, end: int) -> int:
        return int(self._random.random() * end)

    def _between(self, low: int, high: int) -> int:
        return low + self._below(high - low)

    def _lines(self, lots: int, least_ms: int) -> list[int]:
        lines = [0]
        for _ in range(lots):
            lines.append(lines[-1] + self._between(least_ms, 2 * least_ms))
        return lines

    def _doors(self, room: int) -> list[FloorPoint]:
        """Return the doors of a room: one on a random side, a second on the opposite side."""
        i, j = self._rooms[room]
        west, east, north, south = self._xs[i], self._xs[i + 1], self._ys[j], self._ys[j + 1]
        side = self._below(4)
        doors = []
        for k in range(self._floor.doors):
            x, y = self._between(west + 1, east), self._between(north + 1, south)
            x, y = [(x, north), (west, y), (x, south), (east, y)][(side + 2 * k) % 4]
            doors.append(FloorPoint(x, y, corridor=True, room=room))
        return doors

    def _inside(self, room: int) -> FloorPoint:
        i, j = self._rooms[room]
        x, y = self._between(self._xs[i] + 1, self._xs[i + 1]), self._between(self._ys[j] + 1, self._ys[j + 1])
        return FloorPoint(x, y, corridor=False, room=room)

    def _in_corridor(self, *, first: bool = False) -> FloorPoint:
        if first or self._below(2):
            line = 0 if first else self._below(len(self._ys))
            return FloorPoint(self._below(self._xs[-1]), self._ys[line], corridor=True)
        return FloorPoint(self._xs[self._below(len(self._xs))], self._below(self._ys[-1]), corridor=True)

    def _target(self, number: int, point: FloorPoint) -> TargetInfo:
        explorers = {"carrier"} if point.corridor else {"rover"}
        if point.corridor and self._floor.roaming:
            explorers.add("rover")
        return TargetInfo(name=f"t{number}", explorers=frozenset(explorers), reveal_m2=float(self._between(5, 40)))

    def _robots(self) -> tuple[list[RobotState], list[FloorPoint | None]]:
        """Return the robots, and where each starts; None aboard."""
        floor = self._floor
        robots: list[RobotState] = []
        starts: list[FloorPoint | None] = []
        for i in range(1, floor.carriers + 1):
            name = f"c{i}"
            busy = self._below(8_000) if floor.in_flight and i % 2 else 0
            home = f"h{i}" if floor.homes else None
            robots.append(RobotState(name=name, type="carrier", place=f"{name}_start", free_at_ms=busy, home=home))
            starts.append(self._in_corridor(first=not floor.scattered))
            for j in range(1, floor.rovers + 1):
                robots.append(self._rover(f"r{i}_{j}", name, aground=floor.in_flight and j % 2 == i % 2))
                starts.append(None if robots[-1].carrier else self._inside(self._below(floor.rooms)))
        return robots, starts

    def _rover(self, name: str, carrier: str, *, aground: bool) -> RobotState:
        if not aground:
            return RobotState(name=name, type="rover", carrier=carrier)
        busy = self._below(8_000) if self._below(2) else 0
        return RobotState(name=name, type="rover", place=f"{name}_start", free_at_ms=busy)

    def _carriers_table(self, points: Sequence[FloorPoint]) -> TravelTable:
        """Return the travel times in ms (n, n) between points along corridors."""
        table = np.full((len(points), len(points)), UNREACHABLE, dtype=np.int64)
        exits = [self._crossings(point) if point.corridor else [] for point in points]
        for a, p in enumerate(points):
            for b, q in enumerate(points):
                if p.corridor and q.corridor:
                    table[a, b] = self._along(p, q, exits[a], exits[b])
        return table

    def _along(
        self, p: FloorPoint, q: FloorPoint, out: Sequence[tuple[int, int]], into: Sequence[tuple[int, int]]
    ) -> int:
        # on one corridor directly, else by the best pair of crossings
        if (p.x == q.x and p.x in self._xs) or (p.y == q.y and p.y in self._ys):
            return abs(p.x - q.x) + abs(p.y - q.y)
        return min(
            abs(p.x - x) + abs(p.y - y) + abs(x - u) + abs(y - v) + abs(u - q.x) + abs(v - q.y)
            for x, y in out
            for u, v in into
        )

    def _crossings(self, point: FloorPoint) -> list[tuple[int, int]]:
        """Return the crossings at both ends of a point's section of corridor."""
        if point.y in self._ys:
            i = min(bisect_right(self._xs, point.x), len(self._xs) - 1)
            return [(self._xs[i - 1], point.y), (self._xs[i], point.y)]
        j = min(bisect_right(self._ys, point.y), len(self._ys) - 1)
        return [(point.x, self._ys[j - 1]), (point.x, self._ys[j])]

    def _rovers_table(self, points: Sequence[FloorPoint]) -> TravelTable:
        """Return the travel times in ms (n, n) between points of a room and, if rovers roam, by corridors."""
        n = len(points)
        table = np.full((n, n), FAR, dtype=np.int64)
        if self._floor.roaming:
            along = self._carriers_table(points)
            table = np.where(along == UNREACHABLE, FAR, ROVER_SLOWNESS * along)
        for a, p in enumerate(points):
            for b, q in enumerate(points):
                if p.room is not None and p.room == q.room:
                    table[a, b] = min(table[a, b], _straight_ms(p, q))
        np.fill_diagonal(table, np.where(table.diagonal() < FAR, 0, FAR))
        for k in range(n):  # Floyd-Warshall
            np.minimum(table, table[:, k, None] + table[None, k, :], out=table)
        table[table >= FAR] = UNREACHABLE
        return table


def _straight_ms(p: FloorPoint, q: FloorPoint) -> int:
    """Return a rover's travel time in ms between points of a room, eight-connected, rounded up."""
    short, long = sorted((abs(p.x - q.x), abs(p.y - q.y)))
    return -(-ROVER_SLOWNESS * (1_000_000 * long + 414_214 * short) // 1_000_000)


FLOORS = {
    "rooms": (
        Floor(seed=11, carriers=1, rovers=1, targets=3, rooms=1),
        Floor(seed=12, carriers=1, rovers=2, targets=5, rooms=2),
        Floor(seed=13, carriers=2, rovers=2, targets=8, rooms=4),
        Floor(seed=14, carriers=3, rovers=2, targets=12, rooms=5),
        Floor(seed=15, carriers=6, rovers=3, targets=20, rooms=8, scattered=True),
        Floor(seed=16, carriers=12, rovers=3, targets=50, rooms=20, scattered=True),
        Floor(seed=17, carriers=34, rovers=3, targets=150, rooms=50, scattered=True),
    ),
    "two-doors": (
        Floor(seed=21, carriers=2, rovers=1, targets=6, rooms=3, doors=2, lot_ms=(20_000, 6_000)),
        Floor(seed=22, carriers=2, rovers=2, targets=8, rooms=4, doors=2, lot_ms=(20_000, 6_000), recover=True),
        Floor(seed=23, carriers=4, rovers=3, targets=16, rooms=6, doors=2, lot_ms=(20_000, 6_000)),
        Floor(
            seed=24,
            carriers=6,
            rovers=3,
            targets=20,
            rooms=6,
            doors=2,
            lot_ms=(20_000, 6_000),
            recover=True,
            scattered=True,
        ),
        Floor(seed=25, carriers=34, rovers=3, targets=150, rooms=50, doors=2, lot_ms=(20_000, 6_000), scattered=True),
    ),
    "pressure": (
        Floor(seed=31, carriers=1, rovers=1, targets=3, rooms=2, recover=True),
        Floor(seed=32, carriers=2, rovers=1, targets=6, rooms=5, recover=True),
        Floor(seed=33, carriers=2, rovers=2, targets=8, rooms=7, recover=True),
        Floor(seed=34, carriers=6, rovers=3, targets=22, rooms=20, recover=True),
        Floor(seed=35, carriers=12, rovers=3, targets=50, rooms=45, recover=True, scattered=True),
        Floor(seed=36, carriers=34, rovers=3, targets=150, rooms=135, recover=True, scattered=True),
    ),
    "homes": (
        Floor(seed=41, carriers=1, rovers=2, targets=5, rooms=2, recover=True, homes=True, roaming=True),
        Floor(seed=42, carriers=2, rovers=2, targets=8, rooms=4, recover=True, homes=True),
        Floor(seed=43, carriers=4, rovers=3, targets=16, rooms=6, recover=True, homes=True, roaming=True),
        Floor(seed=144, carriers=6, rovers=3, targets=20, rooms=12, recover=True, homes=True, scattered=True),
    ),
    "in-flight": (
        Floor(seed=51, carriers=2, rovers=2, targets=8, rooms=5, in_flight=True),
        Floor(seed=52, carriers=3, rovers=2, targets=12, rooms=7, in_flight=True, recover=True),
        Floor(seed=53, carriers=6, rovers=3, targets=20, rooms=10, in_flight=True, recover=True, scattered=True),
    ),
}
"""The drawn instances of the suite by family."""

MOMENTS = {
    "mission-lobby-1x2-5": (1, 3),
    "mission-rooms-1x1-11": (1, 75.024),
    "mission-office-2x2-8": (1, 134.686),
    "mission-office-2x2-17": (1, 220.336),  # and all rovers aboard at the end
    "mission-maze-2x2-16": (2, 111.368),
    "mission-cave-2x2-42": (1, 112.434),
    "mission-random-3x2-30": (1, 58.843),
    "mission-rooms-4x3-20": (1, 40.864),
    "mission-office-6x3-18": (1, 49.993),
    "mission-cave-6x3-21": (1, 68.273),  # and all rovers aboard at the end
    "mission-office-6x3-0": (1, 168.363),
}
"""Seed and time (s) of the moments of missions with the greedy planner and 8 steps that are the other instances."""
