"""What can be seen from a cell: the exact field of view on a grid.

A cell is visible when some ray from the centre of the observer's cell touches it without crossing an opaque cell
before. Each octant is swept row by row with the list of slope intervals that are still open; opaque cells close
theirs. Opaque cells that are hit are visible themselves. Two opaque cells that touch at a corner let nothing
through, as robots can't pass there either.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from marsupial.model.grid import Cell, CellArray
from marsupial.native import native

Indices = npt.NDArray[np.int64]

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


class Sight:
    """Fields of view on one grid, with reusable buffers.

    Parameters
    ----------
    cells
        uint8 (height, width), read anew at each call: it may change in between.
    opaque
        uint8 table of 256: non-zero for terrain codes that block sight.
    """

    def __init__(self, cells: CellArray, opaque: CellArray) -> None:
        self._cells = cells
        self._opaque = opaque
        self._stamps = np.zeros(cells.size, dtype=np.int64)
        self._stamp = 0
        self._seen = np.empty(cells.size, dtype=np.int64)
        longest = 2 * max(cells.shape) + 8
        self._intervals = np.empty((4, longest), dtype=np.float64)

    def visible(self, cell: Cell, range_cells: float) -> npt.NDArray[np.int64]:
        """Return the row-major indices of the cells visible from `cell` with their centre within the range.

        The result is a view that the next call overwrites.
        """
        self._stamp += 1
        count = _sweep(
            self._cells, self._opaque, cell.x, cell.y, range_cells,
            _OCTANTS, self._intervals, self._stamps, self._stamp, self._seen,
        )  # fmt: skip
        view: npt.NDArray[np.int64] = self._seen[:count]
        return view

    def count(self, code: int, cell: Cell, range_cells: float) -> int:
        """Return how many of the cells `visible` from `cell` have this code."""
        return int(_count(self._cells, self.visible(cell, range_cells), code))

    def clusters(self, groups: Sequence[Indices], range_cells: float) -> list[tuple[int, Indices]]:
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
        free = np.zeros(self._cells.size, dtype=np.bool_)
        free[cells] = True
        seeds, found, found_ends = np.empty((3, len(cells)), dtype=np.int64)
        count = _split(
            self._cells, self._opaque, range_cells, _OCTANTS, self._intervals, self._stamps, self._stamp, self._seen,
            cells, ends, free, seeds, found, found_ends,
        )  # fmt: skip
        self._stamp += count
        members = np.split(found, found_ends[: count - 1])
        return [(seed, np.sort(group)) for seed, group in zip(seeds[:count].tolist(), members, strict=True)]


@native
def _sweep(
    cells: Any, opaque: Any, x: int, y: int, reach: float,
    octants: Any, intervals: Any, stamps: Any, stamp: int, seen: Any,
) -> int:  # fmt: skip
    height, width = cells.shape
    here = y * width + x
    stamps[here] = stamp
    seen[0] = here
    count = 1
    limit = reach * reach + 1e-6
    rows = int(reach)
    for octant in range(8):
        fx, fy, sx, sy = octants[octant, 0], octants[octant, 1], octants[octant, 2], octants[octant, 3]
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
def _count(cells: Any, indices: Any, code: int) -> int:
    count = 0
    for index in indices:
        count += cells[index // cells.shape[1], index % cells.shape[1]] == code
    return count


@native
def _split(
    cells: Any, opaque: Any, reach: float, octants: Any, intervals: Any, stamps: Any, stamp: int, seen: Any,
    left: Any, ends: Any, free: Any, seeds: Any, found: Any, found_ends: Any,
) -> int:  # fmt: skip
    width = cells.shape[1]
    begin = count = tail = 0
    for end in ends:
        size = _free_first(left, begin, end - begin, free)
        while size:
            seed = _middle(left, begin, size, width)
            seeds[count] = seed
            visible = _sweep(
                cells, opaque, seed % width, seed // width, reach,
                octants, intervals, stamps, stamp + count + 1, seen,
            )  # fmt: skip
            for k in range(visible):
                if free[seen[k]]:
                    free[seen[k]] = False
                    found[tail] = seen[k]
                    tail += 1
            found_ends[count] = tail
            count += 1
            size = _free_first(left, begin, size, free)
        begin = end
    return count


@native
def _free_first(left: Any, begin: int, size: int, free: Any) -> int:
    """Move the free ones of `size` cells to their front, in order; return how many there are."""
    kept = 0
    for k in range(begin, begin + size):
        if free[left[k]]:
            left[begin + kept] = left[k]
            kept += 1
    return kept


@native
def _middle(left: Any, begin: int, size: int, width: int) -> int:
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
