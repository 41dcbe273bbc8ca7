"""Where a robot type may stand on a map that is being revealed.

A disc of the type's radius around the centre of a cell must touch no obstacle, no unknown cell and no terrain that the
type can't drive on. It touches a cell if it contains the cell's centre, as in costmaps. Two things are kept per cell:

- a count of the cells under the disc that bar it now: unknown or not drivable. It is `standable` at zero.
- whether one bars it for ever: not drivable. If none does it is `possible`: all unknown cells may yet be drivable.

Revealing a cell updates the disc around it only, so the cost goes with the new cells, not with the size of the map. It
is updated row by row, which the compiler vectorises.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from marsupial.arrays import Counts, Ints, Ints32
from marsupial.model.feed import Feed
from marsupial.model.grid import UNKNOWN, Cell, CellArray, Grid, Mask, code_table
from marsupial.model.robots import RobotType
from marsupial.native import native

AT_ONCE = 1 << 20
"""Approximate number of cells of a known map to reveal at once: all of a large one would fill hundreds of megabytes."""


def disc(radius_cells: float) -> Ints:
    """Return the offsets (n, 2) as (dx, dy) of the cells with their centre in an open disc, (0, 0) always included."""
    reach = int(radius_cells + 1)
    span = np.arange(-reach, reach + 1)
    touched = np.hypot(span[None, :], span[:, None]) < radius_cells - 1e-9
    touched[reach, reach] = True
    return np.ascontiguousarray(np.argwhere(touched)[:, ::-1] - reach)


def fits(grid: Grid, kind: RobotType, *cells: Cell) -> bool:
    """Return whether a robot of a type may stand on all of these cells, without reading the rest of the map."""
    offsets = disc(kind.radius_m / grid.resolution_m)
    at = np.array(cells, dtype=np.int64).reshape(-1, 1, 2) + offsets
    x, y = at[..., 0].ravel(), at[..., 1].ravel()
    inside = (x >= 0) & (y >= 0) & (x < grid.width) & (y < grid.height)
    return bool(inside.all()) and bool(code_table(kind.terrains)[grid.cells[y, x]].all())


class Footprint:
    """The cells one robot type may stand on, updated as cells are revealed."""

    def __init__(self, shape: tuple[int, int], kind: RobotType, resolution_m: float) -> None:
        self.offsets = disc(kind.radius_m / resolution_m)  # (n, 2): offsets of the cells under the disc, see `disc`
        # half widths of the disc's rows, the one through its centre in the middle
        self._rows = np.bincount(self.offsets[:, 1] - self.offsets[:, 1].min()) // 2
        self._drivable = code_table(kind.terrains)
        self.standable: Mask = np.zeros(shape, dtype=np.bool_)  # live: where it may stand
        self.possible: Mask = np.zeros(shape, dtype=np.bool_)  # live: where it may turn out to
        reach = len(self._rows) // 2
        self.possible[reach : max(reach, shape[0] - reach), reach : max(reach, shape[1] - reach)] = True
        self.opened = Feed()  # the cells (row-major) that become standable
        # one count per cell: two bytes suffice unless the radius exceeds 144 cells
        counts = np.uint16 if len(self.offsets) < 1 << 16 else np.int32
        self._barred = np.full(shape, len(self.offsets), dtype=counts)

    def reveal(self, indices: Ints, cells: CellArray) -> None:
        """Update the masks for cells (row-major, each revealed once) that have their codes in the known map `cells`
        now.
        """
        opens = self._drivable[cells.ravel()[indices]]
        _close(indices[~opens], self._rows, self.possible)
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


def standable(grid: Grid, kind: RobotType) -> Mask:
    """Return the mask (height, width) of the cells where a robot of type `kind` may stand."""
    return footprint_of(grid, kind).standable


@native
def _open(indices: Ints, rows: Ints, barred: Counts | Ints32, opened: Ints) -> int:
    """Lower the counts around drivable cells; write the cells that nothing bars now to `opened`, return their number.

    `rows` (2 reach + 1,) has the half width of each row of the disc, `barred` (height, width) the number of cells under
    the disc that bar each cell.
    """
    height, width = barred.shape
    reach = len(rows) // 2
    count = 0
    for index in indices:
        y, x = index // width, index % width
        for v in range(max(0, y - reach), min(height, y + reach + 1)):
            half = rows[v - y + reach]
            row = barred[v, max(0, x - half) : x + half + 1]
            least = row[0]  # few rows have a zero: a loop without a branch finds out whether this one has
            for i in range(len(row)):
                row[i] -= 1
                least = min(least, row[i])
            if least == 0:
                for i in range(len(row)):
                    if row[i] == 0:
                        opened[count] = v * width + max(0, x - half) + i
                        count += 1
    return count


@native
def _close(indices: Ints, rows: Ints, possible: Mask) -> None:
    """Clear `possible` (height, width) under the discs around cells that are not drivable."""
    height, width = possible.shape
    reach = len(rows) // 2
    for index in indices:
        y, x = index // width, index % width
        for v in range(max(0, y - reach), min(height, y + reach + 1)):
            half = rows[v - y + reach]
            possible[v, max(0, x - half) : x + half + 1] = False
