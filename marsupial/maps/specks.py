"""Specks: small groups of unknown cells in the midst of free ground, of which laser maps have hundreds.

What is unknown bars the way as walls do, so each of them keeps robots away by their radius.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from marsupial.arrays import Ints
from marsupial.model.grid import OBSTACLE, UNKNOWN, CellArray, Grid

TOUCHING = np.ones((3, 3), dtype=np.bool_)
"""Cells of one group touch, corners included."""


class Specks(NamedTuple):
    """The cells (n,) of some specks, row-major indices in ascending order, and the number of each one's speck."""

    cells: Ints
    groups: Ints

    @property
    def number(self) -> int:
        """How many specks they are."""
        return len(np.unique(self.groups))

    def smaller(self, cells: int) -> Specks:
        """Return the specks of fewer cells than that."""
        few = np.bincount(self.groups)[self.groups] < cells
        return Specks(self.cells[few], self.groups[few])


def find_specks(grid: Grid) -> Specks:
    """Return all groups of unknown cells, of whatever size, with nothing but free cells round them."""
    from scipy import ndimage  # takes a quarter of a second, and maps without unknown cells do not need it

    unknown = grid.cells == UNKNOWN
    labels, count = ndimage.label(unknown, structure=TOUCHING)
    enclosed = np.ones(count + 1, dtype=np.bool_)
    enclosed[labels[ndimage.binary_dilation(grid.cells == OBSTACLE, structure=TOUCHING)]] = False
    for side in (labels[0], labels[-1], labels[:, 0], labels[:, -1]):
        enclosed[side] = False
    enclosed[0] = False
    cells = np.flatnonzero(enclosed[labels])
    return Specks(cells, labels.ravel()[cells].astype(np.int64))


def painted(grid: Grid, specks: Specks) -> CellArray:
    """Return the map's cells (height, width) with each row of a speck painted as the free cell to the left of it."""
    cells = grid.cells.copy()
    first = np.diff(specks.cells, prepend=-1) != 1
    left = specks.cells[first] - 1
    cells.ravel()[specks.cells] = grid.cells.ravel()[left[np.cumsum(first) - 1]]
    return cells
