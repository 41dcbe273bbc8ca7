"""What can be seen from a cell: the exact field of view on a grid.

A cell is visible when some ray from the centre of the observer's cell touches it without crossing an opaque cell
before. Each octant is swept row by row with the list of slope intervals that are still open; opaque cells close
theirs. Opaque cells that are hit are visible themselves. Two opaque cells that touch at a corner let nothing
through, as robots can't pass there either.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from marsupial.arrays import Flags, Floats, Ints
from marsupial.model.grid import Cell, CellArray
from marsupial.native import native

# forward and sideways unit vectors of the eight octants: (forward x, forward y, sideways x, sideways y)
_OCTANTS = np.array(
    [
        (1, 0, 0, 1),
        (0, 1, 1, 0),
        (0, 1, -1, 0),
        (-1, 0, 0, 1),
        (-1, 0, 0, -1),
        (0, -1, -1, 0),
        (0, -1, 1, 0),
        (1, 0, 0, -1),
    ],
    dtype=np.int64,
)


class _View(NamedTuple):
    """What a sweep looks at and works in.

    Attributes
    ----------
    cells
        (height, width).
    opaque
        (256,): non-zero for terrain codes that block sight.
    intervals
        (4, n): lower and upper slopes of those open in a row, and in the next one.
    stamps
        (cells,): the number of the last sweep that each cell was seen in.
    seen
        (cells,): receives the cells of a sweep.
    """

    cells: CellArray
    opaque: CellArray
    intervals: Floats
    stamps: Ints
    seen: Ints


class _Clusters(NamedTuple):
    """Buffers for clusters: the seed of each, their members one after the other, and the end of each among these."""

    seeds: Ints
    members: Ints
    ends: Ints


class Sight:
    """Fields of view on one grid, with reusable buffers.

    Parameters
    ----------
    cells
        uint8 (height, width), read at each call: it may change in between.
    opaque
        uint8 table of 256: non-zero for terrain codes that block sight.
    """

    def __init__(self, cells: CellArray, opaque: CellArray) -> None:
        self._view = _View(
            cells=cells,
            opaque=opaque,
            intervals=np.empty((4, 2 * max(cells.shape) + 8), dtype=np.float64),
            stamps=np.zeros(cells.size, dtype=np.int64),
            seen=np.empty(cells.size, dtype=np.int64),
        )
        self._stamp = 0

    def visible(self, cell: Cell, range_cells: float) -> Ints:
        """Return the row-major indices of the cells visible from `cell` with their centre within the range.

        The result is a view that the next call overwrites.
        """
        self._stamp += 1
        seen: Ints = self._view.seen[: _sweep(self._view, cell.x, cell.y, range_cells, self._stamp)]
        return seen

    def count(self, code: int, cell: Cell, range_cells: float) -> int:
        """Return how many of the cells `visible` from `cell` have this code."""
        return int(_count(self._view.cells, self.visible(cell, range_cells), code))

    def clusters(self, groups: Sequence[Ints], range_cells: float) -> list[tuple[int, Ints]]:
        """Split cells into clusters whose members are all visible from the cluster's seed.

        Parameters
        ----------
        groups
            Row-major indices, each once, in the order in which seeds are chosen: in each group the cell in the middle
            of what is left of it. A seed's cluster may take cells of other groups.

        Returns
        -------
        list
            (seed, members in ascending order) of each.
        """
        if not groups:
            return []
        cells = np.concatenate(groups)
        ends = np.cumsum([len(group) for group in groups])
        free = np.zeros(self._view.cells.size, dtype=np.bool_)
        free[cells] = True
        found = _Clusters(*np.empty((3, len(cells)), dtype=np.int64))
        count = _split(self._view, range_cells, self._stamp, cells, ends, free, found)
        self._stamp += count
        members = np.split(found.members, found.ends[: count - 1])
        return [(seed, np.sort(group)) for seed, group in zip(found.seeds[:count].tolist(), members, strict=True)]


@native
def _sweep(view: _View, x: int, y: int, reach: float, stamp: int) -> int:
    """Enter what is seen from a cell within `reach` cells in `view.seen`; return how many cells that is."""
    cells, opaque, intervals, stamps, seen = view
    height, width = cells.shape
    here = y * width + x
    stamps[here] = stamp
    seen[0] = here
    count = 1
    limit = reach * reach + 1e-6
    rows = int(reach)
    for octant in range(8):
        fx, fy, sx, sy = _OCTANTS[octant, 0], _OCTANTS[octant, 1], _OCTANTS[octant, 2], _OCTANTS[octant, 3]
        low, high, next_low, next_high = intervals[0], intervals[1], intervals[2], intervals[3]
        low[0], high[0], n = 0.0, 1.0, 1
        for k in range(1, rows + 1):
            cx, cy = x + fx * k, y + fy * k
            if n == 0 or cx < 0 or cy < 0 or cx >= width or cy >= height:
                break
            near, far = k - 0.5, k + 0.5
            m = 0
            for i in range(n):
                start, end = low[i], high[i]
                j = int(start * near + 0.5)
                while start < end - 1e-9:
                    low_j, high_j = max(0.0, (j - 0.5) / far), (j + 0.5) / near
                    if low_j >= end - 1e-9:
                        break
                    px, py = cx + sx * j, cy + sy * j
                    inside = 0 <= px < width and 0 <= py < height
                    closed = True
                    if inside and high_j > start + 1e-9:
                        closed = opaque[cells[py, px]] != 0
                        index = py * width + px
                        if stamps[index] != stamp and k * k + j * j <= limit:
                            stamps[index] = stamp
                            seen[count] = index
                            count += 1
                    elif inside:
                        closed = False
                    if closed:
                        if low_j > start + 1e-9:
                            next_low[m], next_high[m] = start, low_j
                            m += 1
                        start = max(start, high_j)
                    j += 1
                if start < end - 1e-9:
                    next_low[m], next_high[m] = start, end
                    m += 1
            low, next_low = next_low, low
            high, next_high = next_high, high
            n = m
    return count


@native
def _count(cells: CellArray, indices: Ints, code: int) -> int:
    count = 0
    for index in indices:
        count += cells[index // cells.shape[1], index % cells.shape[1]] == code
    return count


@native
def _split(view: _View, reach: float, stamp: int, left: Ints, ends: Ints, free: Flags, found: _Clusters) -> int:
    """Enter the clusters of the groups in `left`, which end at `ends`; return how many there are.

    `free` says for every cell of the map whether it is one that is in no cluster yet.
    """
    width = view.cells.shape[1]
    begin = count = tail = 0
    for end in ends:
        size = _free_first(left, begin, end - begin, free)
        while size:
            seed = _middle(left, begin, size, width)
            found.seeds[count] = seed
            for k in range(_sweep(view, seed % width, seed // width, reach, stamp + count + 1)):
                if free[view.seen[k]]:
                    free[view.seen[k]] = False
                    found.members[tail] = view.seen[k]
                    tail += 1
            found.ends[count] = tail
            count += 1
            size = _free_first(left, begin, size, free)
        begin = end
    return count


@native
def _free_first(left: Ints, begin: int, size: int, free: Flags) -> int:
    """Move the free ones of `size` cells to their front, in order; return how many there are."""
    kept = 0
    for k in range(begin, begin + size):
        if free[left[k]]:
            left[begin + kept] = left[k]
            kept += 1
    return kept


@native
def _middle(left: Ints, begin: int, size: int, width: int) -> int:
    """Return the cell nearest to the centre of gravity of some cells (the first of several)."""
    x = y = 0
    for k in range(begin, begin + size):
        x += left[k] % width
        y += left[k] // width
    best, nearest = left[begin], np.inf
    for k in range(begin, begin + size):
        apart = (left[k] % width - x / size) ** 2 + (left[k] // width - y / size) ** 2
        if apart < nearest:
            best, nearest = left[k], apart
    return best
