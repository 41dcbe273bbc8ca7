"""What can be seen from a cell: the exact field of view on a grid.

A cell is visible if some ray from the centre of the observer's cell touches it before crossing an opaque cell. Opaque
cells that are hit are visible themselves. Two opaque cells that touch at a corner let nothing through, as robots can't
pass there either.

Each of eight octants is swept row by row away from the observer, with the list of slope intervals that are still open.
An opaque cell closes its part of an interval, and may split it in two:

    row k        [---------------]      an open interval of slopes
                 . . . # # . . . .      an opaque cell closes the slopes that it covers
    row k + 1    [----]   [------]      two intervals are left
"""

from typing import NamedTuple

import numpy as np

from marsupial.arrays import Bytes, Flags, Floats, Ints, Ints32
from marsupial.maps.window import Window
from marsupial.model.grid import UNKNOWN, Cell, CellArray, Grid
from marsupial.native import native

LAST_STAMP = np.iinfo(np.int32).max

_EVERYTHING: Bytes = np.empty(0, dtype=np.uint8)

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


def hopeful_codes(grid: Grid) -> CellArray:
    """Return a table (256,) that is non-zero for terrain codes known to block sight."""
    opaque = grid.opaque_codes()
    opaque[UNKNOWN] = 0
    return opaque


class _View(NamedTuple):
    """The input and buffers of a sweep."""

    # codes, width: terrain codes of the cells, row-major, and cells per row
    codes: Bytes
    width: int
    opaque: CellArray  # (256,): non-zero for terrain codes that block sight
    slopes: Floats  # (8, 2): the lowest and highest slope that the sweep covers in each octant
    intervals: Floats  # (4, n): lower and upper slopes of the open intervals of a row, and of the next one
    # (rows, columns): number of the last sweep that saw each cell, for a window of the sensor range only: small enough
    # to stay in the processor's cache
    stamps: Ints32
    seen: Ints  # (cells,): output


class Sight:
    """Fields of view on one grid, with reusable buffers.

    `cells` (height, width) is contiguous and may change between calls; `opaque` (256,) is non-zero for terrain codes
    that block sight.
    """

    def __init__(self, cells: CellArray, opaque: CellArray) -> None:
        self._view = _View(
            codes=cells.ravel(),
            width=cells.shape[1],
            opaque=opaque,
            slopes=np.tile([0.0, 1.0], (8, 1)),
            intervals=np.empty((4, 2 * max(cells.shape) + 8), dtype=np.float64),
            stamps=np.zeros((0, 0), dtype=np.int32),
            seen=np.empty(cells.size, dtype=np.int64),
        )
        self._shape = cells.shape
        self._farthest = -1.0
        self._stamp = 0

    def visible(self, cell: Cell, range_cells: float, among: Bytes = _EVERYTHING, code: int = UNKNOWN) -> Ints:
        """Return the visible cells (row-major) with their centres in range; the next call overwrites them.

        With `among` (cells,), only those that have the `code` there, which takes less time.
        """
        self._begin(range_cells, 1)
        count = _sweep(self._view, cell.x, cell.y, range_cells, self._stamp, among, code)
        seen: Ints = self._view.seen[:count]
        return seen

    def first_to_see(self, stands: Ints, wanted: Flags, window: Window, range_cells: float) -> Cell | None:
        """Return the first of `stands` (row-major) from which a wanted cell (flag per cell) is visible.

        Faster than comparing all fields of view: each stand looks only towards `window`, which holds all wanted cells.
        """
        self._begin(range_cells, len(stands))
        view = self._view._replace(slopes=np.empty_like(self._view.slopes))
        found = _first_to_see(view, stands, wanted.view(np.uint8), np.array(window), range_cells, self._stamp)
        return None if found < 0 else Cell(int(stands[found]) % self._shape[1], int(stands[found]) // self._shape[1])

    def _begin(self, range_cells: float, sweeps: int) -> None:
        """Reserve numbers for this many sweeps; `_stamp` is the last of them."""
        if range_cells > self._farthest or self._stamp + sweeps > LAST_STAMP:
            self._farthest, self._stamp = max(range_cells, self._farthest), 0
            window = [int(min(2 * self._farthest + 1, side)) for side in self._shape]
            self._view = self._view._replace(stamps=np.zeros(window, dtype=np.int32))
        self._stamp += sweeps


@native
def _first_to_see(view: _View, stands: Ints, wanted: Bytes, window: Ints, reach: float, last_stamp: int) -> int:
    """Return the index in `stands` of the cell that `Sight.first_to_see` returns, -1 for none."""
    bottom, top, left, right = window[0], window[1] - 1, window[2], window[3] - 1
    for i in range(len(stands)):
        x, y = stands[i] % view.width, stands[i] // view.width
        for octant in range(8):
            fx, fy, sx, sy = _OCTANTS[octant, 0], _OCTANTS[octant, 1], _OCTANTS[octant, 2], _OCTANTS[octant, 3]
            ahead = (left - x) * fx + (bottom - y) * fy, (right - x) * fx + (top - y) * fy
            beside = (left - x) * sx + (bottom - y) * sy, (right - x) * sx + (top - y) * sy
            # slopes of lines that touch a cell of the window, with a tiny margin
            low, high = (min(beside) - 0.5) / (max(ahead) + 0.5), (max(beside) + 0.5) / max(min(ahead) - 0.5, 1e-9)
            empty = max(ahead) < 1 or max(beside) < 0
            view.slopes[octant] = (1.0, 0.0) if empty else (max(0.0, low - 1e-6), min(1.0, high + 1e-6))
        far = np.hypot(max(x - left, right - x), max(y - bottom, top - y)) + 1
        if _sweep(view, x, y, min(reach, far), last_stamp - i, wanted, 1):
            return i
    return -1


@native
def _sweep(view: _View, x: int, y: int, reach: float, stamp: int, among: Bytes, code: int) -> int:
    """Write the cells seen from a cell within `reach` cells to `view.seen`; return their number.

    Unless `among` is empty, only those that have the `code` there.
    """
    codes, width, opaque, slopes, intervals, window, seen = view
    height = codes.size // width
    here = y * width + x
    # the window starts at the sensor range to the left and below, or at the edge of the map
    stamps, across = window.ravel(), window.shape[1]
    middle = min(y, int(reach)) * across + min(x, int(reach))
    stamps[middle] = stamp
    everything = among.size == 0
    seen[0] = here
    count = np.uint64(everything or among[here] == code)
    limit = reach * reach + 1e-6
    for octant in range(8):
        fx, fy, sx, sy = _OCTANTS[octant, 0], _OCTANTS[octant, 1], _OCTANTS[octant, 2], _OCTANTS[octant, 3]
        beside = (width - 1 - x if sx > 0 else x) if sx else (height - 1 - y if sy > 0 else y)
        ahead = (width - 1 - x if fx > 0 else x) if fx else (height - 1 - y if fy > 0 else y)
        low, high, next_low, next_high = intervals[0], intervals[1], intervals[2], intervals[3]
        low[0], high[0], n = slopes[octant, 0], slopes[octant, 1], 1
        if low[0] >= high[0]:
            continue
        apart, window_apart = sy * width + sx, sy * across + sx
        for k in range(1, min(int(reach), ahead) + 1):
            first, ranging = here + (fy * width + fx) * k, int(np.sqrt(limit - k * k))
            window_first = middle + (fy * across + fx) * k
            near, far = k - 0.5, k + 0.5
            m = 0
            for i in range(n):
                # a slope that is out of range here is out of range in all later rows
                start, end = low[i], min(high[i], (ranging + 0.5) / near)
                j = int(start * near + 0.5)
                if j <= beside and (j + 0.5) / near <= start + 1e-9:
                    j += 1  # the ray touches only its corner
                last = int(end * far + 0.5) + 1
                while (last - 0.5) / far >= end - 1e-9:
                    last -= 1
                while j <= last and start < end - 1e-9:
                    closed = True
                    while j <= last and j <= beside:
                        index = np.uint64(first + apart * j)
                        closed = opaque[codes[index]] != 0
                        if j <= ranging and (everything or among[index] == code):
                            at = np.uint64(window_first + window_apart * j)
                            if stamps[at] != stamp:
                                stamps[at] = np.int32(stamp)
                                seen[count] = index
                                count += np.uint64(1)
                        if closed:
                            break
                        j += 1
                    if not closed:
                        break
                    low_j = max(0.0, (j - 0.5) / far)
                    if low_j > start + 1e-9:
                        next_low[m], next_high[m] = start, low_j
                        m += 1
                    start = max(start, (j + 0.5) / near)
                    j += 1
                if start < end - 1e-9:
                    next_low[m], next_high[m] = start, end
                    m += 1
            low, next_low = next_low, low
            high, next_high = next_high, high
            n = m
            if n == 0:
                break
    return int(count)
