"""The distances between some cells, from one moment to the next of a map on which cells are opened."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.sparse.csgraph import connected_components

from marsupial.arrays import Floats, Ints

TILE = 16
"""Cells that are opened are looked at by squares of that many cells a side."""


class Distances:
    """Remembers the distances between the cells it was asked for last.

    Parameters
    ----------
    width
        Of the map; cells are row-major indices.
    diagonal
        The length of a diagonal step, 1 to sqrt 2.
    """

    def __init__(self, width: int, diagonal: float) -> None:
        self._width, self._diagonal = width, diagonal
        self._cells: Ints = np.empty(0, dtype=np.int64)
        self._table: Floats = np.empty((0, 0))

    def opened(self, cells: Ints | None) -> None:
        """Forget what is not known any more now that these cells (n,) were opened; everything for None."""
        if cells is None:
            self._cells, self._table = self._cells[:0], self._table[:0, :0]
        elif cells.size and self._cells.size:
            least = self._least_by(cells)
            self._table[~(self._table <= least)] = np.nan

    def between(self, cells: Ints, search: Callable[[int, Ints], Floats]) -> Floats:
        """Return the distances (k, k) between k passable cells, one or more, each of them once.

        Parameters
        ----------
        search
            Finds the distances of some cells from one.
        """
        table = self._recalled(cells)
        labels = connected_components(np.isfinite(table), directed=False)[1]
        x, y = cells % self._width, cells // self._width
        outward = np.hypot(x - x.mean(), y - y.mean())
        while True:
            unknown = np.isnan(table)
            counts = unknown.sum(axis=1)
            if not counts.any():
                break
            # of those that know as little the outer ones go first: the others draw together, and ways get shorter
            source = int(np.lexsort((outward, counts))[-1])
            wanted = np.flatnonzero(unknown[source])
            found = search(int(cells[source]), cells[wanted])
            table[source, wanted] = table[wanted, source] = found
            joined = wanted[np.isfinite(found)]
            labels[np.isin(labels, labels[joined])] = labels[source]
            apart = np.isin(labels, labels[wanted[np.isinf(found)]])
            here = labels == labels[source]
            table[np.ix_(here, apart)] = table[np.ix_(apart, here)] = np.inf
        self._cells, self._table = cells, table.copy()
        return table

    def _recalled(self, cells: Ints) -> Floats:
        """Return what is known of the distances (k, k) between k cells, NaN for what is not."""
        table = np.full((cells.size, cells.size), np.nan)
        np.fill_diagonal(table, 0.0)
        _, new, old = np.intersect1d(cells, self._cells, assume_unique=True, return_indices=True)
        table[np.ix_(new, new)] = self._table[np.ix_(old, old)]
        return table

    def _least_by(self, cells: Ints) -> Floats:
        """Return the lengths (k, k) that ways between the cells that are remembered have by these cells, at least."""
        across = self._width // TILE + 1
        tiles = np.unique(cells // self._width // TILE * across + cells % self._width // TILE)
        low = np.stack([tiles % across, tiles // across]) * TILE
        at = np.stack([self._cells % self._width, self._cells // self._width])[:, :, None]
        dx, dy = np.maximum(0, np.maximum(low[:, None] - at, at - low[:, None] - TILE + 1))
        away = np.maximum(dx, dy) + (self._diagonal - 1) * np.minimum(dx, dy)
        return np.array([(away + row).min(axis=1) for row in away])
