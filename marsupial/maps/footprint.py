"""Where a robot type may stand on a map that is being revealed.

A disc of the type's radius round the centre of a cell must touch no cell that is an obstacle, unknown or of a
terrain the type can't drive on; it touches a cell when it holds the cell's centre (the rule of costmaps). For every
cell two counts are kept: the cells under the disc that bar it now (`standable` where zero), and those known to
bar it for ever (`possible` where zero: it might stand there once the unknown turns out to be drivable). Revealing
a cell changes the counts under one disc only, so the cost goes with what is new and not with the size of the map.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from marsupial.model.grid import UNKNOWN, Cell, CellArray, Grid, Mask
from marsupial.model.robots import RobotType
from marsupial.native import native


def disc(radius_cells: float) -> npt.NDArray[np.int64]:
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


class Footprint:
    """The cells one robot type may stand on, kept up to date as cells are revealed.

    Attributes
    ----------
    standable, possible
        Live boolean masks (height, width): may stand there now; might still turn out so.
    """

    def __init__(self, shape: tuple[int, int], kind: RobotType, resolution_m: float) -> None:
        self.kind = kind
        self._offsets = disc(kind.radius_m / resolution_m)
        self._drivable = np.zeros(256, dtype=np.bool_)
        self._drivable[sorted(kind.terrains)] = True
        self._barred = np.full(shape, len(self._offsets), dtype=np.int32)
        self._closed = np.zeros(shape, dtype=np.int32)
        self.standable: Mask = np.zeros(shape, dtype=np.bool_)
        self.possible: Mask = np.ones(shape, dtype=np.bool_)
        _close_outside(self._offsets, self._closed, self.possible)

    def reveal(self, indices: npt.NDArray[np.int64], cells: CellArray) -> npt.NDArray[np.int64]:
        """Take in cells that were unknown until now; return the cells that have become standable.

        Parameters
        ----------
        indices
            Row-major indices, each revealed once and for all.
        cells
            The known map (height, width) with their codes already in it.
        """
        opened = np.empty(min(len(indices) * len(self._offsets), cells.size), dtype=np.int64)
        count = _reveal(
            indices, cells, self._drivable, self._offsets,
            self._barred, self._closed, self.standable, self.possible, opened,
        )  # fmt: skip
        return opened[:count].copy()


def standable(grid: Grid, kind: RobotType) -> Mask:
    """Return the mask (height, width) of the cells where a robot of type `kind` may stand."""
    footprint = Footprint(grid.cells.shape, kind, grid.resolution_m)
    footprint.reveal(np.flatnonzero(grid.cells != UNKNOWN), grid.cells)
    return footprint.standable


@native
def _close_outside(offsets: Any, closed: Any, possible: Any) -> None:
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
def _reveal(
    indices: Any, cells: Any, drivable: Any, offsets: Any,
    barred: Any, closed: Any, standable: Any, possible: Any, opened: Any,
) -> int:  # fmt: skip
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
                barred[v, u] -= 1
                if barred[v, u] == 0:
                    standable[v, u] = True
                    opened[count] = v * width + u
                    count += 1
            else:
                closed[v, u] += 1
                possible[v, u] = False
    return count
