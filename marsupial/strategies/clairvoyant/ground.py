"""The true map as the clairvoyant's search needs it: where robots can stop, what they see there, path lengths.

Robots stop at *sites*, a lattice of the cells that their type can reach. A set of seen cells is a Python integer with
one bit per reachable cell, so that unions and differences of tens of thousands of cells take less than a microsecond.
Views, path lengths and routes are cached within a memory limit.
"""

from collections.abc import Callable, Iterable, Sequence
from functools import reduce
from operator import or_
from typing import TypeVar

import numpy as np

from marsupial.arrays import Floats, Ints
from marsupial.maps.footprint import Contact
from marsupial.maps.growth import reach_of
from marsupial.maps.sight import Sight
from marsupial.maps.territory import Reach, Territory
from marsupial.model import Cell, Grid, Mask, PlacedRobot, RobotType
from marsupial.paths.routes import Route
from marsupial.paths.ways import ways_of

K = TypeVar("K")
V = TypeVar("V")

CellSet = int  # a set of reachable cells, one bit for each

NOTHING: Ints = np.empty(0, dtype=np.int64)

MOST_SITES = 6000  # most sites of a robot type on the lattice; fewer on large maps. Necessary sites are added to them.

MEMORY = 200_000_000  # bytes for views from sites, and the same for the other caches, which are cleared when full


class Ground:
    """Sites, views and paths on the true map; cells seen from the team's start, or `seen`, need not be seen again."""

    def __init__(
        self, grid: Grid, types: Sequence[RobotType], robots: Sequence[PlacedRobot], seen: Ints = NOTHING
    ) -> None:
        truth = grid.solid()
        self.robots = tuple(robots)
        self.territory = Territory(truth, types)
        self.reach: Reach = reach_of(self.territory, self.robots)
        there = {robot.type for robot in robots}
        self.kinds = {kind.name: kind for kind in types if kind.name in there}
        self.width = truth.width
        self._sight = Sight(truth.cells, truth.opaque_codes())
        self._contact = {k.name: Contact(k, truth.resolution_m) for k in types}
        self._ways = {
            name: ways_of(kind, self.territory.footprints[name].standable, truth.resolution_m)
            for name, kind in self.kinds.items()
        }
        self._views: dict[tuple[str, Cell], CellSet] = {}
        self._rows: dict[tuple[str, Cell], Floats] = {}
        self._routes: dict[tuple[str, Cell, Cell], Route] = {}
        self._legs: dict[tuple[str, Cell, Cell], CellSet] = {}
        self._site_views: dict[str, list[CellSet]] = {}
        self._cached_bytes = 0
        self._bit = np.flatnonzero(np.logical_or.reduce(list(self.reach.by_type.values())))
        self._set_bytes = len(self._bit) // 8
        # the number of each cell's bit, -1 for cells out of reach
        self._place = np.full(truth.cells.size, -1, dtype=np.int64)
        self._place[self._bit] = np.arange(len(self._bit))
        self.wanted: CellSet = ((1 << len(self._bit)) - 1) & ~self._bits(seen)  # the reachable cells still to be seen
        for robot in robots:
            if robot.cell is not None:
                self.wanted &= ~self.view(robot.type, robot.cell)
        # row-major indices of the sites of each type, ascending
        self.sites = {name: self._lattice(name) for name in self.kinds}
        self._numbers = {name: {int(i): n for n, i in enumerate(sites)} for name, sites in self.sites.items()}
        self._add_lone_sites()

    def cell(self, index: int) -> Cell:
        """Return the cell with a row-major index."""
        return Cell(int(index) % self.width, int(index) // self.width)

    def view(self, kind: str, cell: Cell) -> CellSet:
        """Return what a robot of that type sees from a cell."""

        def view() -> CellSet:
            grid = self.territory.grid
            seen = self._sight.visible(cell, self.territory.kinds[kind].sensor_range_m / grid.resolution_m)
            return self._bits(np.concatenate((seen, self._contact[kind].touched(grid.cells, cell))))

        return self._cached(self._views, (kind, cell), view, self._set_bytes)

    def site_views(self, kind: str) -> list[CellSet]:
        """Return the wanted cells that are seen from each site of a type."""
        if kind not in self._site_views:
            self._site_views[kind] = [self.view(kind, self.cell(i)) & self.wanted for i in self.sites[kind].tolist()]
        return self._site_views[kind]

    def ms_per_cell(self, kind: str) -> float:
        """Return the driving time of a type for the length of a cell."""
        return 1000 * self.territory.grid.resolution_m / self.kinds[kind].speed_mps

    def may_see(self, kind: str, cells: CellSet) -> Mask:
        """Return which sites of a type are near enough to the first and last of these cells to see all of them."""
        near = np.ones(len(self.sites[kind]), dtype=np.bool_)
        if cells:
            for bit in ((cells & -cells).bit_length() - 1, cells.bit_length() - 1):
                near &= self.near(kind, self.cell(self._bit[bit]))
        return near

    def near(self, kind: str, cell: Cell) -> Mask:
        """Return which sites of a type might see a cell."""
        sites, robot = self.sites[kind], self.kinds[kind]
        reach = max(robot.sensor_range_m, robot.radius_m) / self.territory.grid.resolution_m + 2.0
        x, y = sites % self.width - cell.x, sites // self.width - cell.y
        return np.asarray(x * x + y * y <= reach * reach)

    def bit_of(self, cell: Cell) -> CellSet:
        """Return the set of one cell."""
        return 1 << int(self._place[cell.y * self.width + cell.x])

    def drawn(self, cells: CellSet, rng: np.random.Generator) -> Cell:
        """Return a random cell of the set."""
        return self.cell(int(rng.choice(self._listed(cells))))

    def distances(self, kind: str, cell: Cell) -> Floats:
        """Return the path length in cells from a cell to each site of a type, inf without a path."""
        sites = self.sites[kind]

        def lengths() -> Floats:
            return self._ways[kind].lengths(cell, np.column_stack((sites % self.width, sites // self.width)))

        return self._cached(self._rows, (kind, cell), lengths, sites.nbytes)

    def apart(self, kind: str, cell: Cell, others: Sequence[Cell]) -> Floats:
        """Return the path lengths in cells from a cell to some sites of a type."""
        numbers = self._numbers[kind]
        return self.distances(kind, cell)[[numbers[c.y * self.width + c.x] for c in others]]

    def route(self, kind: str, start: Cell, goal: Cell) -> Route:
        """Return the route of a type between two cells that are connected for it."""
        key = (kind, start, goal)
        if key not in self._routes:
            found = self._ways[kind].route(start, goal)
            assert found is not None, "only connected places are put in a plan"
            self._reserve(100 * len(found))
            self._routes[key] = found
        return self._routes[key]

    def leg(self, kind: str, start: Cell, goal: Cell) -> CellSet:
        """Return what a robot sees on its route, both ends included."""

        def seen() -> CellSet:
            return reduce(or_, (self.view(kind, cell) for cell in self.route(kind, start, goal)))

        return self._cached(self._legs, (kind, start, goal), seen, self._set_bytes)

    def add_sites(self, kind: str, cells: Iterable[Cell]) -> None:
        """Add cells to the sites of a type, such as its starts and meeting points."""
        more = [i for c in cells if (i := c.y * self.width + c.x) not in self._numbers[kind]]
        if not more:
            return
        self.sites[kind] = np.unique(np.concatenate((self.sites[kind], np.array(more, dtype=np.int64))))
        self._numbers[kind] = {int(i): n for n, i in enumerate(self.sites[kind])}
        # both caches are indexed by the numbers of sites, which have changed
        self._rows.clear()
        self._site_views.pop(kind, None)

    def _lattice(self, kind: str) -> Ints:
        """Return the reachable cells on the finest square lattice within the limit of sites."""
        reach = self.reach.by_type[kind]
        most = min(MOST_SITES, MEMORY // (1 + len(self._bit) // 8) // len(self.kinds))
        spacing = 1
        while np.count_nonzero(reach[::spacing, ::spacing]) > most:
            spacing += 1
        thinned = np.zeros_like(reach)
        thinned[::spacing, ::spacing] = reach[::spacing, ::spacing]
        return np.flatnonzero(thinned)

    def _add_lone_sites(self) -> None:
        """Add as a site every cell that is seen from no site."""
        left = self.wanted
        for kind in self.kinds:
            for seen in self.site_views(kind):
                left &= ~seen
        for kind in self.kinds:
            reach = self.reach.by_type[kind].ravel()
            lone = [index for index in self._listed(left) if reach[index]]
            more = []
            for index in lone:
                if left >> int(self._place[index]) & 1:
                    more.append(self.cell(index))
                    left &= ~self.view(kind, self.cell(index))
            self.add_sites(kind, more)

    def _listed(self, cells: CellSet) -> Ints:
        raw = np.frombuffer(cells.to_bytes((len(self._bit) + 7) // 8, "little"), dtype=np.uint8)
        return self._bit[np.flatnonzero(np.unpackbits(raw, count=len(self._bit), bitorder="little"))]

    def _bits(self, indices: Ints) -> CellSet:
        at = self._place[indices]
        marks = np.zeros(len(self._bit), dtype=np.uint8)
        marks[at[at >= 0]] = 1
        return int.from_bytes(np.packbits(marks, bitorder="little").tobytes(), "little")

    def _cached(self, known: dict[K, V], key: K, make: Callable[[], V], size: int) -> V:
        """Return the cached value, or compute and cache it; `size` is in bytes."""
        if key not in known:
            value = make()
            self._reserve(size)
            known[key] = value
        return known[key]

    def _reserve(self, size: int) -> None:
        self._cached_bytes += size
        if self._cached_bytes > MEMORY:
            self._cached_bytes = 0
            for known in (self._views, self._rows, self._routes, self._legs):
                known.clear()
