"""Meeting points: where a carrier can set down or pick up a rover.

    d d d d # r r r r       d: docking cells, that a rover can reach close enough to a carrier
    d d d M r r t r r       r: the rover-only area, that rovers reach but cannot dock in; t: a target there
    d d d d # r r r r       M: the meeting point, in the middle of the border between both

The border is cut into stretches: a door gives one point, a long border several. Meeting points are made only

- for rover-only areas that matter now: with a target that no carrier can explore, or a rover on the ground;
- where a rover on the ground can be picked up, or a carrier can set one down, without driving.

Points in use persist from one planning call to the next, so that plans and names are stable.

References
----------
Wurm et al. 2010, section III-B ("meeting points ... situated between those parts").
"""

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from marsupial.arrays import Ints
from marsupial.maps.reach import groups, middle, spread
from marsupial.maps.targets import Target, cell_at
from marsupial.maps.territory import Reach, Territory, dock_range_cells, ways_from
from marsupial.maps.window import Window
from marsupial.model import Cell, MapMeeting, Mask, PlacedRobot, Role

STRETCH_M = 6.0  # length of border in metres that one meeting point serves

_KEPT_POINT_CELLS = 3.0  # a kept point this near a border serves it: borders move a little as the map grows

_NO_AREA = 0


@dataclass(frozen=True, slots=True, kw_only=True)
class Meetings:
    """The meeting points, and per point the targets of the rover-only areas that it gives access to."""

    points: tuple[MapMeeting, ...]
    connects: Mapping[str, frozenset[str]]


def find_meetings(
    territory: Territory,
    reach: Reach,
    targets: Sequence[Target],
    robots: Iterable[PlacedRobot],
    keep: Iterable[MapMeeting] = (),
) -> Meetings:
    """Return the meeting points that matter; those in use, `keep`, stay while both poses are reachable."""
    robots = tuple(robots)
    points = [point for point in keep if _still_good(point, reach)]
    connects: dict[str, frozenset[str]] = {}
    for number, (carrier, rover) in enumerate(sorted(reach.docking)):
        if not any(robot.type == rover for robot in robots):
            continue
        # two pairs of types may meet at the same two cells, but names are unique
        suffix = f"_{number + 1}" if len(reach.docking) > 1 else ""
        pair = _Pair(territory, reach, carrier, rover, suffix, targets, robots)
        # points in use and of earlier pairs come first: they may serve a border already
        points += pair.on_borders(points)
        points += pair.at_robots(points)
        connects |= pair.connections(points)
    return Meetings(points=tuple(points), connects=connects)


def _still_good(point: MapMeeting, reach: Reach) -> bool:
    carrier, rover = point.carrier_cell, point.rover_cell
    return (
        (point.carrier_type, point.rover_type) in reach.docking
        and bool(reach.by_type[point.carrier_type][carrier.y, carrier.x])
        and bool(reach.by_type[point.rover_type][rover.y, rover.x])
    )


class _Pair:
    """The meeting points of one carrier type with one rover type."""

    def __init__(
        self,
        territory: Territory,
        reach: Reach,
        carrier: str,
        rover: str,
        suffix: str,
        targets: Sequence[Target],
        robots: Sequence[PlacedRobot],
    ) -> None:
        self._territory, self._targets, self._robots = territory, targets, robots
        self._docking = docking = reach.docking[carrier, rover]
        self._carrier, self._rover, self._suffix = carrier, rover, suffix
        self._width = territory.grid.width
        cut = territory.known.cut
        self._dock, rover_only = np.zeros((2, *docking.cells.shape), dtype=np.bool_)
        self._dock[cut] = docking.cells[cut] & reach.by_type[rover][cut]
        rover_only[cut] = reach.by_type[rover][cut] & ~docking.cells[cut]
        self._areas = np.zeros(docking.cells.shape, dtype=np.int32)
        self._cells_of: dict[int, Ints] = {}
        self._enter_areas(rover_only)

    def _enter_areas(self, rover_only: Mask) -> None:
        """Find the rover-only areas that matter: at a rover on the ground or a target that no carrier can explore."""
        seeds = [target.viewpoints[self._rover] for target in self._rover_only()]
        seeds += [robot.cell for robot in self._robots if robot.type == self._rover and robot.cell is not None]
        queue = np.empty(rover_only.size if seeds else 0, dtype=np.int32)
        for seed in seeds:
            # a robot or target may be at the door itself, just outside its area
            around = Window.around(seed, seed, 0 if rover_only[seed.y, seed.x] else 1, rover_only.shape)
            for index in around.on_map(np.flatnonzero(rover_only[around.cut]), self._width).tolist():
                if not self._areas.flat[index]:
                    area = self._areas.flat[index] = len(self._cells_of) + 1
                    queue[0] = index
                    self._cells_of[area] = queue[: spread(rover_only, self._areas, area, queue, 1)].astype(np.int64)

    def on_borders(self, points: Sequence[MapMeeting]) -> list[MapMeeting]:
        """Return a point for each stretch of border that no given point serves."""
        stretch = STRETCH_M / self._territory.grid.resolution_m
        served = [(self._index(p.rover_cell), self._areas_near(p.rover_cell)) for p in points if self._fits(p)]
        found: list[MapMeeting] = []
        for area, border in self._borders():
            for cells in groups(border, self._dock.shape):
                here = [index for index, areas in served if area in areas or area == _NO_AREA]
                taken = [index for index in here if _near(index, cells, self._width, _KEPT_POINT_CELLS).any()]
                for index in _spread(cells, taken, stretch, self._width):
                    found.append(self._point(index))
                    served.append((index, self._areas_near(found[-1].rover_cell)))
        return found

    def at_robots(self, points: Sequence[MapMeeting]) -> list[MapMeeting]:
        """Return points at the positions of rovers on the ground and of loaded carriers."""
        spots: list[MapMeeting] = []
        for robot in self._robots:
            if robot.cell is None:
                continue
            if robot.type == self._rover and self._dock[robot.cell.y, robot.cell.x]:
                spots.append(self._point(self._index(robot.cell)))
            loaded = any(other.carrier == robot.name and other.type == self._rover for other in self._robots)
            if robot.type == self._carrier and loaded and any(self._rover in t.viewpoints for t in self._targets):
                spots += self._within_reach(robot.cell)
        names = {point.name for point in points}
        return list({spot.name: spot for spot in spots if spot.name not in names}.values())

    def connections(self, points: Sequence[MapMeeting]) -> dict[str, frozenset[str]]:
        """Return the rover-only targets that each point of this pair gives access to."""
        cells = {target.name: target.viewpoints[self._rover] for target in self._rover_only()}
        areas_of = {name: self._areas_near(cell) for name, cell in cells.items()}
        reach = STRETCH_M / self._territory.grid.resolution_m
        served: dict[str, frozenset[str]] = {}
        for point in points:
            if self._fits(point):
                mine, here = self._areas_near(point.rover_cell), point.rover_cell
                # a target at the very border, with no area of its own, belongs to the points on the same stretch
                near = {n for n, c in cells.items() if not areas_of[n] and math.dist(c, here) <= reach}
                served[point.name] = frozenset(near | {name for name, areas in areas_of.items() if areas & mine})
        return served

    def _borders(self) -> Iterator[tuple[int, Ints]]:
        """Yield each area with its border, then as `_NO_AREA` the docking cells with a target beside no area."""
        for area, cells in sorted(self._cells_of.items(), key=lambda item: int(item[1].min())):
            yield area, _beside(cells, self._dock)
        viewpoints = [target.viewpoints[self._rover] for target in self._rover_only()]
        lone = {self._index(c) for c in viewpoints if self._dock[c.y, c.x] and not self._areas_near(c)}
        yield _NO_AREA, np.array(sorted(lone), dtype=np.int64)

    def _rover_only(self) -> list[Target]:
        carriers = {kind.name for kind in self._territory.of_role(Role.CARRIER)}
        return [t for t in self._targets if self._rover in t.viewpoints and not carriers & t.viewpoints.keys()]

    def _areas_near(self, cell: Cell) -> set[int]:
        """Return the areas that matter at a cell or, for a docking cell, next to it."""
        here = int(self._areas[cell.y, cell.x])
        if here:
            return {here}
        window = self._areas[max(0, cell.y - 1) : cell.y + 2, max(0, cell.x - 1) : cell.x + 2]
        return set(window.ravel().tolist()) - {_NO_AREA}

    def _within_reach(self, carrier_cell: Cell) -> list[MapMeeting]:
        """Return the point where a carrier standing there sets a rover down, if there is room."""
        x, y = carrier_cell
        # the nearest cell is the carrier's own, as docking robots may share a cell
        if self._dock[y, x] and self._territory.see_through[y, x]:
            return [self._named(carrier_cell, carrier_cell)]
        carrier, rover = self._territory.kinds[self._carrier], self._territory.kinds[self._rover]
        limit = dock_range_cells(carrier, rover, self._territory.grid.resolution_m)
        window, distance = ways_from(carrier_cell, limit, self._territory.see_through)
        distance = np.where(self._dock[window.cut], distance, np.inf)
        best = np.argmin(distance)
        if not np.isfinite(distance.ravel()[best]):
            return []
        return [self._named(cell_at(int(window.on_map(best, self._width)), self._width), carrier_cell)]

    def _fits(self, point: MapMeeting) -> bool:
        return (point.carrier_type, point.rover_type) == (self._carrier, self._rover)

    def _point(self, index: int) -> MapMeeting:
        carrier = int(self._docking.carrier_at(np.array([index]))[0])
        return self._named(cell_at(index, self._width), cell_at(carrier, self._width))

    def _named(self, rover_cell: Cell, carrier_cell: Cell) -> MapMeeting:
        return MapMeeting(
            name=self._territory.grid.name_of("m", rover_cell, carrier_cell) + self._suffix,
            carrier_cell=carrier_cell,
            rover_cell=rover_cell,
            carrier_type=self._carrier,
            rover_type=self._rover,
        )

    def _index(self, cell: Cell) -> int:
        return cell.y * self._width + cell.x


def _near(index: int, others: Ints, width: int, limit: float) -> Mask:
    """Return which of the other cells (n,) are at most `limit` cells from the given cell."""
    dx, dy = others % width - index % width, others // width - index // width
    return np.asarray(dx * dx + dy * dy <= limit**2)


def _spread(cells: Ints, taken: Sequence[int], stretch: float, width: int) -> list[int]:
    """Choose border cells greedily, so that each border cell is within half a stretch of a chosen or taken one."""
    rest = cells
    for index in taken:
        rest = rest[~_near(index, rest, width, stretch / 2)]
    chosen: list[int] = []
    while len(rest):
        index = int(middle(rest, width))
        chosen.append(index)
        rest = rest[~_near(index, rest, width, stretch / 2)]
    return chosen


def _beside(cells: Ints, dock: Mask) -> Ints:
    """Return the docking cells beside these, row-major and ascending."""
    height, width = dock.shape
    y, x = np.divmod(cells, width)
    near = [cells[y > 0] - width, cells[y < height - 1] + width, cells[x > 0] - 1, cells[x < width - 1] + 1]
    beside = np.concatenate(near)
    return np.unique(beside[dock.ravel()[beside]])
