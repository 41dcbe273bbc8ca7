"""What can be seen from a cell: the exact field of view on a grid.

A cell is visible when some ray from the centre of the observer's cell touches it without crossing an opaque cell
before. Each octant is swept row by row with the list of slope intervals that are still open; opaque cells close
theirs. Opaque cells that are hit are visible themselves. Two opaque cells that touch at a corner let nothing
through, as robots can't pass there either.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from marsupial.arrays import Floats, Ints
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
