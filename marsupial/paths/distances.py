r"""A matrix of distances that is updated as cells are opened, with as few searches as possible.

Theory of operation
-------------------
Opening cells changes the distance of a and b only if a path through an opening w is shorter:

    a ----------- d(a, b) ----------- b         d(a, b) stays if, for every opening w,
     \                               /
      least(a, w) --- w --- least(b, w)          least(a, w) + least(b, w) - error(w) >= d(a, b)

`openings` gives the w and their errors. `least` holds lower bounds, the octile distance at first. Every search raises
them: a search from s gives the exact d(s, w), and by the triangle inequality no cell c is nearer to w than |d(s, c) -
d(s, w)|. `_update` alternates between both steps:

1. mark as sure all pairs that satisfy the inequality (`_settle`);
2. search from the cell with the most unknown, then the most doubtful pairs, and learn from it (`_learn`).

New cells have only unknown pairs, so they are searched first. Usually few searches from old cells follow, where a plain
matrix would take one from each. Disconnected cells need no search each: if one cell is unreachable, so is its whole
connected part (`_enter`).
"""

from collections.abc import Callable

import numpy as np

from marsupial.arrays import Flags, Floats, Ints, Ints32
from marsupial.model.grid import Mask
from marsupial.native import native
from marsupial.paths.openings import NO_OPENINGS, Openings, openings

ROUNDING = 1e-7  # least gain, in cells, of a shorter path: bounds are sums and differences of rounded lengths


class Distances:
    """Remembers the distances between the cells (row-major) of the last request, on a mask that may open."""

    def __init__(self, passable: Mask, diagonal: float) -> None:
        self._passable, self._diagonal = passable, diagonal
        self._cells: Ints = np.empty(0, dtype=np.int64)
        self._table: Floats = np.empty((0, 0))
        self._opened: list[Ints] = []

    def opened(self, cells: Ints | None) -> None:
        """Record these cells (n,) as opened; None clears all distances."""
        if cells is None:
            self._cells, self._table = self._cells[:0], self._table[:0, :0]
            self._opened.clear()
        elif cells.size and self._cells.size:  # otherwise they can shorten no known distance
            self._opened.append(cells)

    def between(self, cells: Ints, search: Callable[[int, Ints], Floats]) -> Floats:
        """Return the distances (k, k) between k >= 1 different passable cells; `search` finds those from one."""
        table = self._recalled(cells)
        opened = NO_OPENINGS
        # the diagonal is always known; with no other known distance there is nothing to check
        if self._opened and np.count_nonzero(~np.isnan(table)) > cells.size:
            opened = openings(self._passable, np.concatenate(self._opened), self._diagonal)
        self._opened.clear()
        y, x = np.divmod(cells, self._passable.shape[1])
        outward = np.hypot(x - x.mean(), y - y.mean())  # from the middle of all cells
        _update(table, self._octile(cells, opened.cells), opened, cells, outward, search)
        self._cells, self._table = cells, table.copy()
        return table

    def _recalled(self, cells: Ints) -> Floats:
        """Return the known distances (k, k) between k cells, NaN for the others."""
        table = np.full((cells.size, cells.size), np.nan)
        _, new, old = np.intersect1d(cells, self._cells, assume_unique=True, return_indices=True)
        table[np.ix_(new, new)] = self._table[np.ix_(old, old)]
        np.fill_diagonal(table, 0.0)
        return table

    def _octile(self, cells: Ints, others: Ints) -> Floats:
        """Return the distances (k, n) from k cells to n others over empty ground."""
        width = self._passable.shape[1]
        dx = np.abs(cells[:, None] % width - others % width)
        dy = np.abs(cells[:, None] // width - others // width)
        away: Floats = np.maximum(dx, dy) + (self._diagonal - 1) * np.minimum(dx, dy)
        return away


def _update(
    table: Floats, least: Floats, opened: Openings, cells: Ints, outward: Floats, search: Callable[[int, Ints], Floats]
) -> None:
    """Bring `table` (k, k), the former distances, up to date; `least` (k, n) bounds those to openings from below."""
    doubtful = ~np.eye(len(table), dtype=np.bool_)
    firsts = _parts(np.isfinite(table))
    _settle(table, least, opened.errors, doubtful)
    while doubtful.any():
        # ties: outer cells first, so that the remaining searches are between cells close together, and short
        unknown, doubts = (each.sum(axis=1) for each in (np.isnan(table), doubtful))
        source = int(np.lexsort((outward, doubts, unknown))[-1])
        wanted = np.flatnonzero(doubtful[source])
        found = search(int(cells[source]), np.concatenate([cells[wanted], opened.cells]))
        _enter(table, doubtful, firsts, source, wanted, found[: wanted.size])
        away = found[wanted.size :]
        if away.size:
            _learn(table[source], least, away)
            least[source] = away
            _settle(table, least, opened.errors, doubtful)


@native
def _settle(table: Floats, least: Floats, errors: Floats, doubtful: Flags) -> None:
    """Clear `doubtful` (k, k) for the distances that no path through an opening can beat; NaN is never sure."""
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
    """Return (k,): the lowest-numbered cell of each cell's connected part; `linked` is symmetric."""
    # scipy has this, but its import takes as long as a small mission
    firsts = np.arange(len(linked), dtype=np.int32)
    while True:
        before = firsts
        firsts = np.minimum(before, np.where(linked, before, np.int32(len(linked))).min(axis=1, initial=len(linked)))
        if np.array_equal(firsts, before):
            return firsts


@native
def _enter(table: Floats, doubtful: Flags, parts: Ints32, source: int, wanted: Ints, found: Floats) -> None:
    """Write the distances (n,) found from a source to wanted cells, and inf between parts shown to be separate.

    `parts` (k,) is what `_parts` returns; cells that turn out to be connected join the source's part.
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
    """Raise the bounds `least` (k, n) by a source's distances to the cells, `away` (k,), and to the openings (n,)."""
    for cell in range(len(least)):
        for way in range(len(from_openings)):
            apart = abs(away[cell] - from_openings[way])
            if apart > least[cell, way]:  # never true for inf - inf, which is NaN and gives no bound
                least[cell, way] = apart
