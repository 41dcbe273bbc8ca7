"""Where a robot type may stand on a map that is being revealed.

A disc of the type's radius round the centre of a cell must touch no cell that is an obstacle, unknown or of a
terrain the type can't drive on; it touches a cell when it holds the cell's centre (the rule of costmaps). For every
cell two counts are kept: the cells under the disc that bar it now (`standable` where zero), and those known to
bar it for ever (`possible` where zero: it might stand there once the unknown turns out to be drivable). Revealing
a cell changes the counts under one disc only, so the cost goes with what is new and not with the size of the map.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from marsupial.arrays import Flags, Ints, Ints32
from marsupial.model.grid import UNKNOWN, Cell, CellArray, Grid, Mask, code_table
from marsupial.model.robots import RobotType
from marsupial.native import native


def disc(radius_cells: float) -> Ints:
    """Return the offsets (n, 2) as (dx, dy) of the cells whose centre an open disc round a cell's centre holds.

    The cell itself is always among them.
    """
    span = np.arange(-int(radius_cells + 1), int(radius_cells + 1) + 1)
    dx, dy = np.meshgrid(span, span)
    touched = (np.hypot(dx, dy) < radius_cells - 1e-9) | ((dx == 0) & (dy == 0))
    return np.stack([dx[touched], dy[touched]], axis=1).astype(np.int64)


def fits(grid: Grid, kind: RobotType, cell: Cell) -> bool:
    """Say whether a robot of that type may stand on a cell of the map, without looking at the rest of the map."""
    offsets = disc(kind.radius_m / grid.resolution_m)
    x, y = cell.x + offsets[:, 0], cell.y + offsets[:, 1]
    inside = (x >= 0) & (y >= 0) & (x < grid.width) & (y < grid.height)
    return bool(inside.all()) and bool(np.isin(grid.cells[y[inside], x[inside]], sorted(kind.terrains)).all())


class _Counts(NamedTuple):
    """What is known of each cell, all (height, width).

    Attributes
    ----------
    barred, closed
        How many cells under the disc bar it now, and for ever.
    standable, possible
        Those of `Footprint`.
    """

    barred: Ints32
    closed: Ints32
    standable: Mask
    possible: Mask


class Footprint:
    """The cells one robot type may stand on, kept up to date as cells are revealed.

    Attributes
    ----------
    offsets
        (n, 2): those of the cells under the disc, see `disc`.
    standable, possible
        Live boolean masks (height, width): may stand there now; might still turn out so.
    """

    def __init__(self, shape: tuple[int, int], kind: RobotType, resolution_m: float) -> None:
        self.kind = kind
        self.offsets = disc(kind.radius_m / resolution_m)
        self._drivable = code_table(kind.terrains)
        self.standable: Mask = np.zeros(shape, dtype=np.bool_)
        self.possible: Mask = np.ones(shape, dtype=np.bool_)
        self._counts = _Counts(
            barred=np.full(shape, len(self.offsets), dtype=np.int32),
            closed=np.zeros(shape, dtype=np.int32),
            standable=self.standable,
            possible=self.possible,
        )
        _close_outside(self.offsets, self._counts.closed, self.possible)

    def reveal(self, indices: Ints, cells: CellArray) -> Ints:
        """Take in cells that were unknown until now; return the cells that have become standable.

        Parameters
        ----------
        indices
            Row-major indices, each revealed once and for all.
        cells
            The known map (height, width) with their codes already in it.
        """
        opened = np.empty(min(len(indices) * len(self.offsets), cells.size), dtype=np.int64)
        count = _reveal(indices, cells, self._drivable, self.offsets, self._counts, opened)
        return opened[:count].copy()


def standable(grid: Grid, kind: RobotType) -> Mask:
    """Return the mask (height, width) of the cells where a robot of type `kind` may stand."""
    footprint = Footprint(grid.cells.shape, kind, grid.resolution_m)
    footprint.reveal(np.flatnonzero(grid.cells != UNKNOWN), grid.cells)
    return footprint.standable


@native
def _close_outside(offsets: Ints, closed: Ints32, possible: Mask) -> None:
    """Count what is under the disc outside the map, which bars it for ever."""
    height, width = closed.shape
    reach = np.abs(offsets).max()
    for y in range(height):
        for x in range(width):
            if reach <= x < width - reach and reach <= y < height - reach:
                continue
            for i in range(len(offsets)):
                u, v = x + offsets[i, 0], y + offsets[i, 1]
                if u < 0 or v < 0 or u >= width or v >= height:
                    closed[y, x] += 1
            possible[y, x] = closed[y, x] == 0


@native
def _reveal(indices: Ints, cells: CellArray, drivable: Flags, offsets: Ints, counts: _Counts, opened: Ints) -> int:
    """Count what is revealed; enter in `opened` the cells that have become standable and return how many.

    Parameters
    ----------
    indices, cells
        Those of `Footprint.reveal`.
    drivable
        (256,): which terrain codes the type can drive on.
    offsets
        (n, 2): those of `disc`.
    """
    height, width = cells.shape
    count = 0
    for index in indices:
        y, x = index // width, index % width
        opens = drivable[cells[y, x]]
        for i in range(len(offsets)):
            u, v = x - offsets[i, 0], y - offsets[i, 1]
            if u < 0 or v < 0 or u >= width or v >= height:
                continue
            if opens:
                counts.barred[v, u] -= 1
                if counts.barred[v, u] == 0:
                    counts.standable[v, u] = True
                    opened[count] = v * width + u
                    count += 1
            else:
                counts.closed[v, u] += 1
                counts.possible[v, u] = False
    return count
