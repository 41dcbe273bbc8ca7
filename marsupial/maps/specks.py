"""Specks: small groups of unknown or obstacle cells in the midst of free ground, of which laser maps have hundreds.

Each bars the way as walls do and so keeps robots away by their radius. Grey ones are where no beam ever ended; black
ones are noise, or legs of furniture: only somebody who knows the place can tell.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
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


def find_specks(grid: Grid, code: int = UNKNOWN) -> Specks:
    """Return all groups of unknown cells (or obstacles), of whatever size, with nothing but free cells round them."""
    from scipy import ndimage  # takes a quarter of a second, and maps without unknown cells do not need it

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
    """Return the map's cells (height, width) with each row of a speck painted as the free cell to the left of it."""
    cells = grid.cells.copy()
    first = np.diff(specks.cells, prepend=-1) != 1
    left = specks.cells[first] - 1
    cells.ravel()[specks.cells] = grid.cells.ravel()[left[np.cumsum(first) - 1]]
    return cells


def without_specks(grid: Grid, largest: int, codes: Sequence[int] = (UNKNOWN, OBSTACLE)) -> tuple[Grid, int]:
    """Return the map without specks of fewer cells than `largest`, and how many those were."""
    number = 0
    for code in codes:
        small = find_specks(grid, code).smaller(largest)
        grid = replace(grid, cells=painted(grid, small))
        number += small.number
    return grid, number
