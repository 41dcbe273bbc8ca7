"""Distances between cells that are asked for again and again while the map grows.

Known ground is never taken back, so a distance found before is still right unless a way through newly passable cells
is shorter. No such way is shorter than the way to the nearest of these cells and from the nearest of them on: one
search from all of them says which pairs to search anew. Most targets and meeting points stay where they are from
one replanning to the next, and what is new is far from most of them.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from marsupial.model.grid import Cell
from marsupial.paths.fields import PathSearch
from marsupial.paths.kernels import TOLERANCE
from marsupial.paths.workspace import Lengths

Indices = npt.NDArray[np.int64]

_NONE: Indices = np.empty(0, dtype=np.int64)


class Distances:
    """The distances between all pairs of some cells, those of the last time reused.

    Parameters
    ----------
    search
        On a mask whose cells only ever become passable.
    """

    def __init__(self, search: PathSearch) -> None:
        self._search = search
        self._cells: Indices = _NONE
        self._table: Lengths = np.empty((0, 0))
        self._opened: list[Indices] = []

    def open(self, cells: Indices) -> None:
        """Take in cells (row-major indices) that have become passable."""
        self._opened.append(cells)

    def matrix(self, cells: Sequence[Cell]) -> Lengths:
        """Return what `PathSearch.matrix` returns, give or take the order in which steps are summed up."""
        width = self._search.passable.shape[1]
        asked = np.array([cell.y * width + cell.x for cell in cells], dtype=np.int64)
        unique, place = np.unique(asked, return_inverse=True)
        old = np.isin(unique, self._cells, assume_unique=True)
        if 2 * np.count_nonzero(old) < unique.size:
            table = self._search.matrix(_cells(unique, width))
        else:
            table = np.full((unique.size, unique.size), np.nan)
            before = np.searchsorted(self._cells, unique[old])
            table[np.ix_(old, old)] = self._still_right(before)
            self._fill(table, unique)
        self._cells, self._table, self._opened = unique, table, []
        return table[np.ix_(place, place)]

    def _still_right(self, rows: npt.NDArray[np.intp]) -> Lengths:
        """Return the part of the last table that stands in these rows and columns, nan where it may be too long."""
        table = self._table[np.ix_(rows, rows)]
        opened = np.concatenate([_NONE, *self._opened])
        if opened.size:
            height, width = self._search.passable.shape
            y, x = np.divmod(opened, width)
            # a way may also lead diagonally past a newly passable cell, from one of its neighbours to another
            beside = (opened, opened[x > 0] - 1, opened[x + 1 < width] + 1, opened[y > 0] - width)
            sources = np.unique(np.concatenate((*beside, opened[y + 1 < height] + width)))
            away = self._search.costs_from(sources, _cells(self._cells[rows], width))
            table[away[:, None] + away < table - TOLERANCE] = np.nan
        return table

    def _fill(self, table: Lengths, unique: Indices) -> None:
        """Search for the entries of a symmetric `table` that are nan, the row that lacks most of them first."""
        width = self._search.passable.shape[1]
        lacking = np.isnan(table)
        while lacking.any():
            row = int(np.argmax(lacking.sum(axis=1)))
            wanted = np.flatnonzero(lacking[row])
            source = _cells(unique[[row]], width)[0]
            table[row, wanted] = table[wanted, row] = self._search.costs(source, _cells(unique[wanted], width))
            # who is connected to this cell has no way to those who are not
            here = np.isfinite(table[row])
            apart = here[:, None] & ~here
            apart |= apart.T
            table[apart] = np.inf
            lacking &= ~apart
            lacking[row] = lacking[:, row] = False


def _cells(indices: Indices, width: int) -> list[Cell]:
    return [Cell(index % width, index // width) for index in indices.tolist()]
