"""The distances between some cells, from one moment to the next of a map on which cells are opened.

A distance only becomes shorter if a way by what was opened does. How long such ways are at least is known better with
every search: one from any cell says how far it is from there to what was opened, and then no other cell is nearer to
that, nor farther, than by how far they are apart. So those who are new are searched from first, and then of the others
as many as are needed to tell that the rest is as it was.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from marsupial.arrays import Flags, Floats, Ints, Ints32
from marsupial.model.grid import Mask
from marsupial.native import native
from marsupial.paths.openings import NO_OPENINGS, Openings, openings

ROUNDING = 1e-7
"""By how much, in cells, a way has to be shorter to be one: bounds are sums and differences of several lengths."""


class Distances:
    """Remembers the distances between the cells it was asked for last.

    Parameters
    ----------
    passable
        Boolean mask (height, width), referred to, not copied; cells are row-major indices.
    diagonal
        The length of a diagonal step, 1 to sqrt 2.
    """

    def __init__(self, passable: Mask, diagonal: float) -> None:
        self._passable, self._diagonal = passable, diagonal
        self._cells: Ints = np.empty(0, dtype=np.int64)
        self._table: Floats = np.empty((0, 0))
        self._opened: list[Ints] = []

    def opened(self, cells: Ints | None) -> None:
        """Take in that these cells (n,) were opened; for None forget everything."""
        if cells is None:
            self._cells, self._table = self._cells[:0], self._table[:0, :0]
            self._opened.clear()
        elif cells.size and self._cells.size:  # else there is nothing that they could make shorter
            self._opened.append(cells)

    def between(self, cells: Ints, search: Callable[[int, Ints], Floats]) -> Floats:
        """Return the distances (k, k) between k passable cells, one or more, each of them once.

        Parameters
        ----------
        search
            Finds the distances of some cells from one.
        """
        table = self._recalled(cells)
        opened = NO_OPENINGS
        if (
            self._opened and np.count_nonzero(~np.isnan(table)) > cells.size
        ):  # more than that they are 0 from themselves
            opened = openings(self._passable, np.concatenate(self._opened), self._diagonal)
        self._opened.clear()
        _Update(table, self._octile(cells, opened.cells), opened).run(cells, self._outward(cells), search)
        self._cells, self._table = cells, table.copy()
        return table

    def _recalled(self, cells: Ints) -> Floats:
        """Return what was known of the distances (k, k) between k cells, NaN for what was not."""
        table = np.full((cells.size, cells.size), np.nan)
        _, new, old = np.intersect1d(cells, self._cells, assume_unique=True, return_indices=True)
        table[np.ix_(new, new)] = self._table[np.ix_(old, old)]
        np.fill_diagonal(table, 0.0)
        return table

    def _octile(self, cells: Ints, others: Ints) -> Floats:
        """Return the distances (k, n) from k cells to n others if nothing is in the way."""
        width = self._passable.shape[1]
        dx = np.abs(cells[:, None] % width - others % width)
        dy = np.abs(cells[:, None] // width - others // width)
        away: Floats = np.maximum(dx, dy) + (self._diagonal - 1) * np.minimum(dx, dy)
        return away

    def _outward(self, cells: Ints) -> Floats:
        """Return how far (k,) cells are from the middle of all."""
        y, x = np.divmod(cells, self._passable.shape[1])
        away: Floats = np.hypot(x - x.mean(), y - y.mean())
        return away


class _Update:
    """Brings a table of distances up to date.

    Parameters
    ----------
    table
        (k, k): as they were before, NaN where they are not known.
    least
        (k, n): how far it is from each cell to each opening, at least.
    """

    def __init__(self, table: Floats, least: Floats, opened: Openings) -> None:
        self._table, self._least, self._opened = table, least, opened
        self._doubtful: Flags = np.ones(table.shape, dtype=np.bool_)
        np.fill_diagonal(self._doubtful, False)
        self._parts = _parts(np.isfinite(table))
        self._settle()

    def run(self, cells: Ints, outward: Floats, search: Callable[[int, Ints], Floats]) -> None:
        """Search for what is not known until all is."""
        while self._doubtful.any():
            # of those that know as little the outer ones go first: the others draw together, and ways get shorter
            unknown, doubtful = (each.sum(axis=1) for each in (np.isnan(self._table), self._doubtful))
            source = int(np.lexsort((outward, doubtful, unknown))[-1])
            wanted = np.flatnonzero(self._doubtful[source])
            found = search(int(cells[source]), np.concatenate([cells[wanted], self._opened.cells]))
            self._enter(source, wanted, found[: wanted.size])
            self._learn(source, found[wanted.size :])

    def _enter(self, source: int, wanted: Ints, found: Floats) -> None:
        """Enter distances (n,) that were found from a cell to n others."""
        _enter(self._table, self._doubtful, self._parts, source, wanted, found)

    def _learn(self, source: int, away: Floats) -> None:
        """Take in how far (n,) each opening is from a cell whose distances are known."""
        if away.size:
            _learn(self._table[source], self._least, away)
            self._least[source] = away
            self._settle()

    def _settle(self) -> None:
        """Leave no doubt about distances that no way by an opening is shorter than."""
        _settle(self._table, self._least, self._opened.errors, self._doubtful)


@native
def _settle(table: Floats, least: Floats, errors: Floats, doubtful: Flags) -> None:
    """Enter in `doubtful` (k, k) which distances are sure, see `_Update`; NaN never is."""
    for a in range(len(table)):
        for b in range(a + 1, len(table)):
            if doubtful[a, b] and not np.isnan(table[a, b]):
                sure = True
                for way in range(len(errors)):
                    if least[a, way] + least[b, way] - errors[way] < table[a, b] - ROUNDING:
                        sure = False
                        break
                if sure:
                    doubtful[a, b] = doubtful[b, a] = False


def _parts(linked: Flags) -> Ints32:
    """Return (k,): the first of the cells that each is connected with, by way of others too; `linked` is symmetric.

    scipy has this, but takes as long to import as a small mission takes.
    """
    firsts = np.arange(len(linked), dtype=np.int32)
    while True:
        before = firsts
        firsts = np.minimum(before, np.where(linked, before, np.int32(len(linked))).min(axis=1, initial=len(linked)))
        if np.array_equal(firsts, before):
            return firsts


@native
def _enter(table: Floats, doubtful: Flags, parts: Ints32, source: int, wanted: Ints, found: Floats) -> None:
    """Enter the distances of wanted cells (n,); what is connected to a cell is as far from being so to others as that.

    Parameters
    ----------
    parts
        (k,): the least number of cells known to be connected has the same one, below k.
    """
    joined = np.zeros(len(parts), dtype=np.bool_)
    apart = np.zeros(len(parts), dtype=np.bool_)
    divided = False
    for i, cell in enumerate(wanted):
        table[source, cell] = table[cell, source] = found[i]
        if np.isinf(found[i]):
            apart[parts[cell]] = divided = True
        else:
            joined[parts[cell]] = True
    for cell in range(len(parts)):
        if joined[parts[cell]]:
            parts[cell] = parts[source]
    doubtful[source] = False
    doubtful[:, source] = False
    if divided:
        for a in range(len(parts)):
            for b in range(len(parts)):
                if parts[a] == parts[source] and apart[parts[b]]:
                    table[a, b] = table[b, a] = np.inf
                    doubtful[a, b] = doubtful[b, a] = False


@native
def _learn(away: Floats, least: Floats, from_openings: Floats) -> None:
    """Raise how far it is `least` (k, n) to n openings, from a cell `away` (k,) of which they are known (n,)."""
    for cell in range(len(least)):
        for way in range(len(from_openings)):
            apart = abs(away[cell] - from_openings[way])
            if apart > least[cell, way]:  # of two that can't be reached nothing is known
                least[cell, way] = apart
