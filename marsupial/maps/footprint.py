"""Where a robot type may stand on a map that is being revealed.

A disc of the type's radius around the centre of a cell must touch no obstacle, no unknown cell and no terrain that the
type can't drive on. It touches a cell if it contains the cell's centre, as in costmaps. Each cell stores two values:

- the number of cells under the disc that block it now: unknown or not drivable. At zero, it is `standable`.
- whether a non-drivable cell blocks it for ever. If none does, it is `possible`: unknown cells may be drivable.

Revealing cells updates the discs around them only, so the cost depends on the new cells, not on the size of the map.
The discs around a run of neighbouring cells are updated together, row by row, which the compiler vectorises.
"""

from collections.abc import Iterator

import numpy as np

from marsupial.arrays import Counts, Ints, Ints32
from marsupial.maps.discs import disc
from marsupial.model.feed import Feed
from marsupial.model.grid import OBSTACLE, UNKNOWN, Cell, CellArray, Grid, Mask, code_table
from marsupial.model.robots import RobotType
from marsupial.native import inlined, native

AT_ONCE = 1 << 20  # about this many cells of a known map are revealed at once: all would fill hundreds of MB


class Footprint:
    """The cells one robot type may stand on, updated as cells are revealed."""

    def __init__(self, shape: tuple[int, int], kind: RobotType, resolution_m: float) -> None:
        self.offsets = disc(kind.radius_m / resolution_m)  # (n, 2): offsets of the cells under the disc, see `disc`
        self._rows = _half_widths(self.offsets)
        self._drivable = code_table(kind.terrains)
        self.standable: Mask = np.zeros(shape, dtype=np.bool_)  # live: where it may stand
        self.possible: Mask = np.zeros(shape, dtype=np.bool_)  # live: where it may prove able to stand
        reach = len(self._rows) // 2
        self.possible[reach : max(reach, shape[0] - reach), reach : max(reach, shape[1] - reach)] = True
        self.opened = Feed()  # the cells (row-major) that become standable
        # one count per cell: two bytes suffice unless the radius exceeds 144 cells
        counts = np.uint16 if len(self.offsets) < 1 << 16 else np.int32
        self._barred = np.full(shape, len(self.offsets), dtype=counts)

    def reveal(self, indices: Ints, cells: CellArray) -> None:
        """Update the masks for cells (row-major, each revealed once); the known map `cells` has their codes.

        Ascending cells take least time.
        """
        opens = self._drivable[cells.ravel()[indices]]
        _fill(indices[~opens], self._rows, self.possible, False)
        drivable = indices[opens]
        opened = np.empty(self._most_covered(drivable, cells.shape), dtype=np.int64)
        count = _open(drivable, self._rows, self._barred, opened)
        opened = opened[:count].copy()
        self.standable.ravel()[opened] = True
        self.opened.add(opened)

    def _most_covered(self, cells: Ints, shape: tuple[int, ...]) -> int:
        """Return an upper bound of the number of cells under discs around `cells`, which limits the buffer."""
        if not len(cells):
            return 0
        height, width = shape
        rows = int(cells.max()) // width - int(cells.min()) // width + len(self._rows)
        return min(len(cells) * len(self.offsets), min(rows, height) * width)


def known_parts(grid: Grid) -> Iterator[Ints]:
    """Yield all known cells (row-major indices, ascending), a few rows at a time."""
    rows = max(1, AT_ONCE // grid.width)
    for first in range(0, grid.height, rows):
        yield np.flatnonzero(grid.cells[first : first + rows] != UNKNOWN) + first * grid.width


def footprint_of(grid: Grid, kind: RobotType) -> Footprint:
    """Return the footprint of a type on a map; cells still unknown may be revealed later."""
    footprint = Footprint(grid.cells.shape, kind, grid.resolution_m)
    for cells in known_parts(grid):
        footprint.reveal(cells, grid.cells)
    return footprint


def covered(cells: Ints, radius_cells: float, shape: tuple[int, int]) -> Mask:
    """Return which cells (height, width) are under discs round `cells`, row-major indices."""
    out = np.zeros(shape, dtype=np.bool_)
    _fill(cells, _half_widths(disc(radius_cells)), out, True)
    return out


def _half_widths(offsets: Ints) -> Ints:
    """Return the half widths (2 reach + 1,) of the rows of a disc, the one through its centre in the middle."""
    return np.bincount(offsets[:, 1] - offsets[:, 1].min()) // 2


@inlined
def _run(indices: Ints, k: int, width: int) -> int:
    """Return the number of cells from number `k` on that are each right of the one before."""
    end = k + 1
    while end < indices.size and indices[end] == indices[end - 1] + 1 and indices[end] % width:
        end += 1
    return end - k


@native
def _open(indices: Ints, rows: Ints, barred: Counts | Ints32, opened: Ints) -> int:
    """Lower the counts in `barred` around drivable cells; write the cells that reach zero to `opened`.

    `rows` are the `_half_widths` of the disc. Return the number of cells written.
    """
    height, width = barred.shape
    reach = len(rows) // 2
    count = k = 0
    while k < indices.size:
        y, first = indices[k] // width, indices[k] % width
        run = _run(indices, k, width)
        k, last = k + run, first + run - 1
        for v in range(max(0, y - reach), min(height, y + reach + 1)):
            half = rows[v - y + reach]
            left = max(0, first - half)
            row = barred[v, left : last + half + 1]
            least = row[0]  # few rows have a zero: a loop without a branch finds out whether this one has
            for i in range(len(row)):
                # how many cells of the run have this one under their discs
                row[i] -= min(left + i + half, last) - max(left + i - half, first) + 1
                least = min(least, row[i])
            if least == 0:
                for i in range(len(row)):
                    if row[i] == 0:
                        opened[count] = v * width + left + i
                        count += 1
    return count


@native
def _fill(indices: Ints, rows: Ints, mask: Mask, value: bool) -> None:
    """Set a mask (height, width) to a value under the discs, with half widths `rows`, around cells."""
    height, width = mask.shape
    reach = len(rows) // 2
    k = 0
    while k < indices.size:
        y, first = indices[k] // width, indices[k] % width
        run = _run(indices, k, width)
        k, last = k + run, first + run - 1
        for v in range(max(0, y - reach), min(height, y + reach + 1)):
            half = rows[v - y + reach]
            mask[v, max(0, first - half) : last + half + 1] = value


class Contact:
    """Finds the cells that robots of one type sense by contact, without seeing them.

    A robot next to an unknown cell learns whether it can drive there. Contact spreads from cell to neighbouring cell,
    up to one cell beyond the footprint, and ends at obstacles: it passes neither walls nor closed corners. If it did,
    the robot would reveal cells behind them and leave a frontier there that no robot can reach.
    """

    def __init__(self, kind: RobotType, resolution_m: float) -> None:
        # slightly more than one cell, so that rounding omits no cell of the footprint one cell further
        self._offsets = disc(kind.radius_m / resolution_m + 1.0 + 1e-6)
        self._beside = _beside(self._offsets)

    def touched(self, truth: CellArray, cell: Cell) -> Ints:
        """Return the cells touched from `cell`, itself included, as row-major indices of the map (height, width)."""
        touched: Ints = _touched(truth, cell.x, cell.y, self._offsets, self._beside)
        return touched


def _beside(offsets: Ints) -> Ints:
    """Return the positions (n, 4) in `offsets` (n, 2) of the four neighbours of each, -1 for those outside."""
    place = {(int(dx), int(dy)): i for i, (dx, dy) in enumerate(offsets)}
    steps = ((1, 0), (-1, 0), (0, 1), (0, -1))
    beside = [[place.get((dx + u, dy + v), -1) for u, v in steps] for dx, dy in place]
    return np.array(beside, dtype=np.int64)


@native
def _touched(truth: CellArray, x: int, y: int, offsets: Ints, beside: Ints) -> Ints:
    """Return the cells touched from (x, y), by breadth-first search; see `Contact.touched` and `_beside`."""
    height, width = truth.shape
    new = np.ones(len(offsets), dtype=np.bool_)
    queue, out = np.empty((2, len(offsets)), dtype=np.int64)
    queue[0] = len(offsets) // 2  # the middle of the disc, which is the robot's own cell
    new[queue[0]] = False
    head, tail, count = 0, 1, 0
    while head < tail:
        k = queue[head]
        head += 1
        u, v = x + offsets[k, 0], y + offsets[k, 1]
        if u < 0 or v < 0 or u >= width or v >= height:
            continue
        out[count] = v * width + u
        count += 1
        if truth[v, u] == OBSTACLE and k != queue[0]:
            continue
        for i in range(4):
            near = beside[k, i]
            if near >= 0 and new[near]:
                new[near] = False
                queue[tail] = near
                tail += 1
    return out[:count].copy()
