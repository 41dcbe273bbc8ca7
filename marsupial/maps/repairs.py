"""Repairs of a map before its use: specks are painted over, and a free outside is closed.

Specks are small groups of unknown or obstacle cells surrounded by free cells. Laser maps have hundreds. Like walls,
each keeps robots away by their radius. Unknown ones are cells where no beam ended; obstacles are noise or legs of
furniture, which only someone who knows the place can distinguish.

A map whose outside is free is closed along the convex hull of all obstacles, so that robots do not explore beyond its
walls: cells outside it become unknown, and free cells along the hull become obstacles. A yard between two wings of a
building lies in the hull and stays free.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from marsupial.arrays import Ints
from marsupial.errors import MapError
from marsupial.model.grid import OBSTACLE, UNKNOWN, CellArray, Grid

TOUCHING = np.ones((3, 3), dtype=np.bool_)  # neighbours of a cell, corners included


class Specks(NamedTuple):
    """The cells (n,) of some specks, ascending row-major indices, and the number (n,) of each cell's speck."""

    cells: Ints
    groups: Ints

    @property
    def number(self) -> int:
        return len(np.unique(self.groups))

    def smaller(self, cells: int) -> Specks:
        few = np.bincount(self.groups)[self.groups] < cells
        return Specks(self.cells[few], self.groups[few])


def find_specks(grid: Grid, code: int = UNKNOWN) -> Specks:
    """Return all groups of unknown (or obstacle) cells, of any size, surrounded by free cells only."""
    from scipy import ndimage  # its import takes a quarter of a second, and maps without unknown cells do not need it

    marked = grid.cells == code
    others = ((grid.cells == OBSTACLE) | (grid.cells == UNKNOWN)) & ~marked
    labels, count = ndimage.label(marked, structure=TOUCHING)
    enclosed = np.ones(count + 1, dtype=np.bool_)
    enclosed[labels[ndimage.binary_dilation(others, structure=TOUCHING)]] = False
    for side in (labels[0], labels[-1], labels[:, 0], labels[:, -1]):
        enclosed[side] = False
    enclosed[0] = False
    cells = np.flatnonzero(enclosed[labels])
    return Specks(cells, labels.ravel()[cells].astype(np.int64))


def painted(grid: Grid, specks: Specks) -> CellArray:
    """Return the map's cells (height, width) with each row of a speck replaced by the free cell to its left."""
    cells = grid.cells.copy()
    first = np.diff(specks.cells, prepend=-1) != 1
    left = specks.cells[first] - 1
    cells.ravel()[specks.cells] = grid.cells.ravel()[left[np.cumsum(first) - 1]]
    return cells


def without_specks(grid: Grid, largest: int, codes: Sequence[int] = (UNKNOWN, OBSTACLE)) -> tuple[Grid, int]:
    """Return the map without specks of fewer than `largest` cells, and their number."""
    number = 0
    for code in codes:
        small = find_specks(grid, code).smaller(largest)
        grid = replace(grid, cells=painted(grid, small))
        number += small.number
    return grid, number


def closed(grid: Grid) -> Grid:
    """Return the map closed along the convex hull of its obstacles; raise MapError if they enclose nothing."""
    from scipy import ndimage
    from skimage.morphology import convex_hull_image

    ys, xs = np.nonzero(grid.cells == OBSTACLE)
    if not len(xs) or np.linalg.matrix_rank(np.column_stack((xs - xs[0], ys - ys[0]))) < 2:
        raise MapError("the obstacles of the map enclose no area, so there is no boundary to draw")
    # half-cell offsets would widen the hull beyond the outermost walls
    outside = ~convex_hull_image(grid.cells == OBSTACLE, offset_coordinates=False)
    inside_rim = ~outside & ndimage.binary_dilation(outside, structure=TOUCHING, border_value=1)
    cells = np.where(outside, UNKNOWN, np.where(inside_rim, OBSTACLE, grid.cells)).astype(np.uint8)
    return replace(grid, cells=cells)
