"""Specks: small groups of unknown or obstacle cells surrounded by free cells. Laser maps have hundreds.

Like walls, each keeps robots away by their radius. Unknown ones are cells where no beam ended; obstacles are noise or
legs of furniture, which only someone who knows the place can tell.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from marsupial.arrays import Ints
from marsupial.model.grid import OBSTACLE, UNKNOWN, CellArray, Grid

TOUCHING = np.ones((3, 3), dtype=np.bool_)  # neighbours of a cell, corners included


class Specks(NamedTuple):
    """The cells (n,) of some specks, ascending row-major indices, and the number (n,) of each cell's speck."""

    cells: Ints
    groups: Ints

    @property
    def number(self) -> int:
        """Number of specks."""
        return len(np.unique(self.groups))

    def smaller(self, cells: int) -> Specks:
        """Return the specks of fewer than `cells` cells."""
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
