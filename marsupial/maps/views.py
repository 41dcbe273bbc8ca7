"""Fields of view on a map that grows, from cells that are asked about again and again.

What is unknown is seen through, so a view changes only when a cell of it is revealed: only then it is looked for again.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from marsupial.arrays import Bytes, Flags, Ints, Ints32
from marsupial.maps.reach import middle
from marsupial.maps.sight import Sight
from marsupial.model.grid import Cell, CellArray
from marsupial.native import native

MOST_CELLS = 1 << 16
"""Larger views are not kept, only how many cells are unknown in them."""


@dataclass(slots=True)
class _KeptView:
    """What was seen from a cell; `revision` is that of the last time it was asked for."""

    cells: Ints32 | None
    unknown: int
    revision: int


class Views:
    """Fields of view on one growing map.

    Parameters
    ----------
    cells, opaque
        As for `Sight`.
    unknown
        The code of cells that are not known.
    """

    def __init__(self, cells: CellArray, opaque: CellArray, unknown: int) -> None:
        self._cells, self._codes, self._unknown = cells, cells.ravel(), unknown
        self._sight = Sight(cells, opaque)
        self._views: dict[tuple[Cell, float], _KeptView] = {}
        self._former: dict[tuple[Cell, float], _KeptView] = {}
        self._boxes: list[tuple[int, int, int, int]] = []
        self._free: Flags = np.zeros(cells.size, dtype=np.bool_)

    def revealed(self, indices: Ints) -> None:
        """Take in that cells (row-major) are known now."""
        y, x = np.divmod(indices, self._cells.shape[1])
        self._boxes.append((int(x.min()), int(y.min()), int(x.max()), int(y.max())))

    def forget(self) -> None:
        """Drop the views that were not asked for since the last time that this was called."""
        self._former, self._views = self._views, {}

    def hidden(self, cell: Cell, range_cells: float) -> int:
        """Return how many of the cells that are visible from a cell are unknown."""
        return self._view(cell, range_cells).unknown

    def clusters(self, groups: Sequence[Ints], range_cells: float) -> list[tuple[int, Ints]]:
        """Split cells into clusters whose members are all visible from the cluster's seed.

        Parameters
        ----------
        groups
            Row-major indices, each once, in the order in which seeds are chosen: in each group the cell in the middle
            of what is left of it. A seed's cluster may take cells of other groups.

        Returns
        -------
        list
            (seed, members in ascending order) of each.
        """
        width = self._cells.shape[1]
        for group in groups:
            self._free[group] = True
        found = []
        for group in groups:
            left = group[self._free[group]]
            while left.size:
                seed = int(middle(left, width))
                members = np.sort(_taken(self._seen(seed, range_cells), self._free))
                found.append((seed, members))
                left = left[self._free[left]]
        return found

    def _view(self, cell: Cell, range_cells: float) -> _KeptView:
        key = (cell, range_cells)
        view = self._views.get(key) or self._former.get(key)
        if view is None or self._changed(view, cell, range_cells):
            seen = self._sight.visible(cell, range_cells)
            kept = seen.astype(np.int32) if seen.size <= MOST_CELLS else None
            view = _KeptView(kept, int(_count(seen, self._codes, self._unknown)), 0)
        view.revision = len(self._boxes)
        self._views[key] = view
        return view

    def _changed(self, view: _KeptView, cell: Cell, range_cells: float) -> bool:
        """Say whether anything of a view was revealed since it was asked for."""
        x, y = cell
        for low_x, low_y, high_x, high_y in self._boxes[view.revision :]:
            if (
                low_x <= x + range_cells
                and high_x >= x - range_cells
                and low_y <= y + range_cells
                and high_y >= y - range_cells
            ):
                return view.cells is None or view.unknown != _count(view.cells, self._codes, self._unknown)
        return False

    def _seen(self, index: int, range_cells: float) -> Ints | Ints32:
        width = self._cells.shape[1]
        cell = Cell(index % width, index // width)
        kept = self._view(cell, range_cells).cells
        return self._sight.visible(cell, range_cells) if kept is None else kept


@native
def _count(indices: Ints | Ints32, codes: Bytes, code: int) -> int:
    count = 0
    for index in indices:
        count += codes[index] == code
    return count


@native
def _taken(indices: Ints | Ints32, free: Flags) -> Ints:
    """Return those of the cells that are free, and have them free no more."""
    out = np.empty(len(indices), dtype=np.int64)
    count = 0
    for index in indices:
        if free[index]:
            free[index] = False
            out[count] = index
            count += 1
    return out[:count].copy()
