"""The framed arrays of the flood search.

Filling tens of megabytes costs more than most searches on a large map, so a workspace is kept, and only the cells
touched by the last search are reset. Passability is copied before each search, so it can't be out of date.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TypeVar

import numpy as np

from marsupial.arrays import Bytes, Cells, Floats, Ints
from marsupial.model.grid import Cell, Mask
from marsupial.paths import kernels

NOWHERE: Cells = np.empty(0, dtype=np.uint32)

_Framed = TypeVar("_Framed", Bytes, Floats)


class FramedGrid:
    """A grid framed by closed cells, so that no search tests for the edge of the map."""

    def __init__(self, height: int, width: int) -> None:
        self._height, self._width = height, width
        self._row = row = width + 2
        self.size = (height + 2) * row
        around = np.array([1, row + 1, row, row - 1, -1, -row - 1, -row, -row + 1], dtype=np.int64)
        # (24,): from a cell to its neighbours, counter-clockwise from east, three times round, so that a direction plus
        # or minus a few needs no modulo
        self.offsets = np.tile(around, 3).astype(np.uint64)

    def indices(self, cells: Sequence[Cell] | Ints) -> Cells:
        """Return the framed index of each cell; for cells outside the grid that of a closed cell."""
        xy = np.array(cells, dtype=np.int64).reshape(-1, 2)
        x, y = xy[:, 0], xy[:, 1]
        inside = (x >= 0) & (x < self._width) & (y >= 0) & (y < self._height)
        return np.where(inside, (y + 1) * self._row + x + 1, 0).astype(np.uint32)

    def framed(self, cells: Ints) -> Ints:
        """Return the framed index of cells of the grid, by row-major index."""
        y, x = np.divmod(cells, self._width)
        index: Ints = (y + 1) * self._row + x + 1
        return index

    def inside(self, framed: _Framed) -> _Framed:
        """Return the view (height, width) of a framed array without its frame."""
        return framed.reshape(self._height + 2, self._row)[1:-1, 1:-1]


class FloodMemory:
    """Working memory for grids of one shape (height, width); several workspaces may share it, used one at a time."""

    def __init__(self, shape: tuple[int, int]) -> None:
        size = FramedGrid(*shape).size
        self.cost = np.full(size, np.inf)
        self.arrival = np.empty(size, dtype=np.uint8)
        self.queue = np.empty(3 * size, dtype=np.uint32)
        self.touched = np.empty(size, dtype=np.uint32)
        self.stale = 0  # number of cells touched by the last search


class Workspace:
    """Searches on grids of one shape, in cells. Not thread-safe; for `diagonal` and `memory` see `PathSearch`."""

    def __init__(self, height: int, width: int, diagonal: float, memory: FloodMemory | None = None) -> None:
        self._frame = FramedGrid(height, width)
        self._memory = memory = memory or FloodMemory((height, width))
        self._buffers = kernels.Buffers(
            passable=np.zeros(self._frame.size, dtype=np.uint8),
            cost=memory.cost,
            arrival=memory.arrival,
            offsets=self._frame.offsets,
            queue=memory.queue,
            touched=memory.touched,
            diagonal=diagonal,
        )
        self.indices = self._frame.indices

    def load(self, passable: Mask) -> None:
        """Copy the mask of passable cells."""
        self._frame.inside(self._buffers.passable)[:] = passable

    def open(self, cells: Ints) -> None:
        """Make these cells (n,), by row-major index, passable."""
        self._buffers.passable[self._frame.framed(cells)] = 1

    def passable(self, at: Cells) -> Mask:
        """Return which of the cells are passable."""
        return self._buffers.passable[at].astype(np.bool_)

    def search(self, source: Cells, wanted: Cells = NOWHERE, limit: float = math.inf) -> float:
        """Search outward from a passable cell; return the length below which costs are final."""
        # above a quarter of the cells a sequential fill beats resetting scattered ones
        if 4 * self._memory.stale > self._buffers.cost.size:
            self._buffers.cost.fill(np.inf)
            self._memory.stale = 0
        stale, longest = np.uint64(self._memory.stale), limit + kernels.TOLERANCE
        final, touched = kernels.flood(self._buffers, stale, source, wanted, longest)
        self._memory.stale = int(touched)
        return float(final)

    def costs(self, at: Cells) -> Floats:
        """Return the distances of these cells from the source of the last search."""
        return self._buffers.cost[at]

    def field(self, final: float = math.inf) -> Floats:
        """Return a copy (height, width) of the last search's distances, inf where they are not below `final`."""
        field = self._frame.inside(self._buffers.cost).copy()
        if final < math.inf:
            field[field >= final] = np.inf
        return field

    def descent(self, start: np.uint32) -> str:
        """Return the step digits from `start` down to the source of the last search, which must have reached it."""
        steps = np.empty(int(self._buffers.cost[start]) + 1, dtype=np.uint8)
        count = kernels.descend(self._buffers, np.uint64(start), steps)
        return (steps[: int(count)] + ord("0")).tobytes().decode("ascii")
