"""Shortest paths over passable cells: distance fields, distance matrices and routes.

Motion is eight-connected: a step costs 1, a diagonal one sqrt 2 and needs both cells beside it passable; cells outside
the grid are impassable. The costs are those that A* finds. Three layers answer:

    field, route ---------------------------------> flood, one cell after the other   kernels.py
    lengths ----------------> the faster search: /
    matrix -> Distances ---/  jump point search ----> corner to corner                 jumps.py
              distances.py, openings.py: only the pairs whose distance may have changed

A flood is needed where every cell gets a distance, and is faster on ragged ground with a corner at every cell.
Floats are in cells; inf means that there is no path.
"""

import math
from collections.abc import Sequence
from functools import cached_property

import numpy as np

from marsupial.arrays import Cells, Floats, Ints
from marsupial.model import SQRT2, Cell, Mask
from marsupial.model.feed import Feed, Reader
from marsupial.paths import kernels
from marsupial.paths.distances import Distances
from marsupial.paths.framed import NOWHERE, FramedGrid
from marsupial.paths.jumps import JumpMemory, Jumps
from marsupial.paths.routes import Route, route_of

RAGGED = 0.2  # diagonal steps per open cell at which a jump point search takes as long as a flood


class SearchMemory:
    """Working memory for masks of one shape (height, width); several `PathSearch` may share it, used one at a time.

    Filling tens of megabytes costs more than most searches on a large map, so memory is reused, and only the cells
    touched by the last flood are reset.
    """

    def __init__(self, shape: tuple[int, int]) -> None:
        self._shape = shape
        self.stale = 0  # number of cells touched by the last flood

    @cached_property
    def jumps(self) -> JumpMemory:
        """Memory of jump point searches."""
        return JumpMemory(self._shape)

    @cached_property
    def flood(self) -> kernels.Buffers:
        """Memory of floods, without passable cells: each search has its own."""
        frame = FramedGrid(*self._shape)
        return kernels.Buffers(
            passable=np.zeros(0, dtype=np.uint8),
            cost=np.full(frame.size, np.inf),
            arrival=np.empty(frame.size, dtype=np.uint8),
            offsets=frame.offsets,
            queue=np.empty(3 * frame.size, dtype=np.uint32),
            touched=np.empty(frame.size, dtype=np.uint32),
            diagonal=SQRT2,
        )


class PathSearch:
    """Searches on one mask (height, width), which is referenced and may change between calls.

    Searches reuse buffers, so reuse the instance. Not thread-safe. `diagonal` is the length of a diagonal step, 1 to
    sqrt 2. If cells only become passable, and the feed `opened` lists them, the cost of a call does not depend on the
    size of the mask. Searches that never run at the same time can share working `memory`. Shortest paths are the same
    for all headings.
    """

    def __init__(
        self, passable: Mask, diagonal: float = SQRT2, opened: Feed | None = None, memory: SearchMemory | None = None
    ) -> None:
        self.passable = passable
        height, width = passable.shape
        self._memory = memory or SearchMemory((height, width))
        self._frame = FramedGrid(height, width)
        self._opened = opened
        self._framed_news: Reader | None = None
        self._jumps_news: Reader | None = None
        self._diagonal = diagonal
        self._open = self._ragged = 0
        self._distances = Distances(passable, diagonal)

    @cached_property
    def _jumps(self) -> Jumps:
        height, width = self.passable.shape
        return Jumps((height, width), self._diagonal, self._memory.jumps)

    @cached_property
    def _buffers(self) -> kernels.Buffers:
        passable = np.zeros(self._frame.size, dtype=np.uint8)
        return self._memory.flood._replace(passable=passable, diagonal=self._diagonal)

    def field(self, source: Cell, limit: float = math.inf) -> Floats:
        """Return the distance of every cell (height, width) from `source`, inf without a path or beyond the limit."""
        start = self._framed([source])
        if not self._buffers.passable[start[0]]:
            return np.full(self.passable.shape, np.inf)
        self._flood(start, NOWHERE, limit)
        return self._frame.inside(self._buffers.cost).copy()

    def lengths(self, source: Cell, wanted: Sequence[Cell] | Ints, heading: int | None = None) -> Floats:
        """Return the lengths (n,) in cells of the routes from a cell to n others; inf without a route."""
        self._update_jumps()
        start, cells = self._indices([source]), self._indices(wanted)
        costs = np.full(cells.size, np.inf)
        inside = np.flatnonzero(self._passable(cells))
        if inside.size and self._passable(start)[0]:
            costs[inside] = self._search(int(start[0]), cells[inside])
        return costs

    def matrix(self, cells: Sequence[Cell], headings: Sequence[int | None] | None = None) -> Floats:
        """Return the lengths (k, k) in cells of the routes between all `cells`; inf without a route."""
        # a cell on impassable ground is at inf, even from itself
        self._update_jumps()
        unique, place = np.unique(self._indices(cells), return_inverse=True)
        table = np.full((unique.size, unique.size), np.inf)
        inside = np.flatnonzero(self._passable(unique))
        if inside.size:
            table[np.ix_(inside, inside)] = self._distances.between(unique[inside], self._search)
        return table[np.ix_(place, place)]

    def route(self, start: Cell, goal: Cell, heading: int | None = None) -> Route | None:
        """Return the route, both ends included, always the same one; None if there is no route."""
        ends, buffers = self._framed([start, goal]), self._buffers
        if not buffers.passable[ends].all():
            return None
        self._flood(ends[1:], ends[:1])
        if not math.isfinite(buffers.cost[ends[0]]):
            return None
        steps = np.empty(int(buffers.cost[ends[0]]) + 1, dtype=np.uint8)
        count = int(kernels.descend(buffers, np.uint64(ends[0]), steps))
        return route_of(start, (steps[:count] + ord("0")).tobytes().decode("ascii"))

    def _framed(self, cells: Sequence[Cell] | Ints) -> Cells:
        """Return the framed index of each cell, after an update of the flood's passable cells to the present mask."""
        if self._framed_news is not None:
            self._buffers.passable[self._frame.framed(self._framed_news.cells())] = 1
        else:
            self._frame.inside(self._buffers.passable)[:] = self.passable
            self._framed_news = None if self._opened is None else self._opened.reader()
        return self._frame.indices(cells)

    def _flood(self, source: Cells, wanted: Cells, limit: float = math.inf) -> None:
        """Search outward from a passable cell until the wanted ones are final, or all of them where none is wanted."""
        memory, buffers = self._memory, self._buffers
        # above a quarter of the cells a sequential fill beats resetting scattered ones
        if 4 * memory.stale > buffers.cost.size:
            buffers.cost.fill(np.inf)
            memory.stale = 0
        longest = limit + kernels.TOLERANCE
        memory.stale = int(kernels.flood(buffers, np.uint64(memory.stale), source, wanted, longest))

    def _update_jumps(self) -> None:
        """Update the jump point search and the remembered distances to the present mask."""
        opened: Ints | None
        if self._jumps_news is not None:
            opened = self._jumps_news.cells()
            self._jumps.open(opened)
        else:
            opened = self._jumps.load(self.passable)
            self._jumps_news = None if self._opened is None else self._opened.reader()
        self._distances.opened(opened)
        if opened is None:
            self._open, self._ragged = int(np.count_nonzero(self.passable)), 0
        else:
            self._open += opened.size

    def _indices(self, cells: Sequence[Cell] | Ints) -> Ints:
        """Return the row-major index of each cell; -1 for those outside the grid."""
        height, width = self.passable.shape
        x, y = np.array(cells, dtype=np.int64).reshape(-1, 2).T
        return np.where((x >= 0) & (x < width) & (y >= 0) & (y < height), y * width + x, -1)

    def _passable(self, cells: Ints) -> Mask:
        return (cells >= 0) & self.passable.ravel()[cells]

    def _search(self, source: int, wanted: Ints) -> Floats:
        """Return the distances of passable cells from another one, by the faster search for this map."""
        # after a jump point search with too many diagonal steps, floods serve until a quarter more cells are open
        if 4 * self._open > 5 * self._ragged:
            costs = self._jumps.costs(source, wanted)
            self._ragged = self._open if self._jumps.steps > RAGGED * self._open else 0
            return costs
        width = self.passable.shape[1]
        y, x = np.divmod(np.append(wanted, source), width)
        framed = self._framed(np.stack([x, y], axis=1))
        self._flood(framed[-1:], framed[:-1])
        return self._buffers.cost[framed[:-1]]
