"""Distances over passable cells: fields, cost matrices and routes.

Motion is eight-connected: a step costs 1, a diagonal sqrt 2 and needs both cells beside it passable; outside the
grid nothing is. The costs are those that A* finds. One bucket-queue search from a cell gives the exact costs to all
cells around it and stops once those asked for are final, which serves a whole row of a cost matrix.
Floats are in cells; inf means that there is no path.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from marsupial.arrays import Cells, Floats, Ints
from marsupial.model.grid import Cell, Mask
from marsupial.model.robots import SQRT2
from marsupial.paths.routes import Route, route_of
from marsupial.paths.workspace import NOWHERE, Workspace

_Numbers = npt.NDArray[np.intp]


class PathSearch:
    """Searches on one mask, which may change between calls.

    Buffers are kept between searches, so an instance should be kept too; it must not be used by two threads at once.

    Parameters
    ----------
    passable
        Boolean mask (height, width). Referred to, not copied: each call sees it as it is then.
    diagonal
        The length of a diagonal step in straight ones, 1 to sqrt 2.
    """

    def __init__(self, passable: Mask, diagonal: float = SQRT2) -> None:
        self.passable = passable
        height, width = passable.shape
        self._work = Workspace(height, width, diagonal)

    def field(self, source: Cell, wanted: Sequence[Cell] | None = None, limit: float = math.inf) -> Floats:
        """Return the distance of every cell from `source`.

        Parameters
        ----------
        wanted
            The search may stop once these cells are final; all of them, where None.
        limit
            Cells farther away than this many cells are left out.

        Returns
        -------
        ndarray
            float64, shape (height, width); inf for cells that were not reached.
        """
        start = self._load([source])
        if not self._work.passable(start)[0]:
            return np.full(self.passable.shape, np.inf)
        goals = NOWHERE
        if wanted is not None:
            goals = np.append(start, self._work.indices(wanted))
        goals = goals[self._work.passable(goals)]
        return self._work.field(self._work.search(start, goals, limit))

    def costs(self, source: Cell, wanted: Sequence[Cell] | Ints) -> Floats:
        """Return the distance of each wanted cell from `source`, stopping once all of them are final."""
        start = self._load([source])
        return self._costs(start, self._work.indices(wanted))

    def matrix(self, cells: Sequence[Cell]) -> Floats:
        """Return the distances between all pairs of `cells`, float64 (k, k), symmetric.

        Each pair is searched once. A cell on impassable ground is at inf from everything, itself included.
        """
        unique, place = np.unique(self._load(cells), return_inverse=True)
        table = np.full((unique.size, unique.size), np.inf)
        left = np.flatnonzero(self._work.passable(unique))
        while left.size:
            left = self._fill_component(unique, left, table)
        return table[np.ix_(place, place)]

    def route(self, start: Cell, goal: Cell) -> Route | None:
        """Return a shortest route, both ends included, always the same one; None where there is none."""
        ends = self._load([start, goal])
        if not np.isfinite(self._costs(ends[1:], ends[:1])[0]):
            return None
        return route_of(start, self._work.descent(ends[0]))

    def _load(self, cells: Sequence[Cell] | Ints) -> Cells:
        self._work.load(self.passable)
        return self._work.indices(cells)

    def _costs(self, source: Cells, wanted: Cells) -> Floats:
        goals = wanted[self._work.passable(wanted)]
        if not goals.size or not self._work.passable(source)[0]:
            return np.full(wanted.size, np.inf)
        self._work.search(source, goals)
        return self._work.costs(wanted)

    def _fill_component(self, cells: Cells, left: _Numbers, table: Floats) -> _Numbers:
        """Fill `table` for the cells connected to the most central one `left`; return those that are not.

        Outer cells go first: what remains draws together, and the searches get ever shorter. That all are connected
        is known by then, so no search runs on to the end of the map for a cell it cannot reach.
        """
        y, x = np.divmod(cells[left].astype(np.int64), self.passable.shape[1] + 2)
        centre = left[np.argmin((x - x.mean()) ** 2 + (y - y.mean()) ** 2)]
        distances = self._costs(cells[[centre]], cells[left])
        reached = np.isfinite(distances)
        order = left[reached][np.argsort(-distances[reached], kind="stable")]
        table[centre, left] = table[left, centre] = distances
        inner = order[:-1]  # the last is the centre
        table[np.ix_(inner, inner)] = self._work.pairs(cells[inner])
        return left[~reached]
