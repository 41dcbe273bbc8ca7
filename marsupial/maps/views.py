"""A cache of fields of view on a growing map.

Views pass through unknown cells, so a view can change only if one of its cells is revealed; only then is it recomputed.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from marsupial.arrays import Flags, Ints, Ints32
from marsupial.maps.reach import middle
from marsupial.maps.sight import Sight
from marsupial.model.grid import Cell, CellArray

MOST_CELLS = 1 << 16  # views with more unknown cells store only their number


@dataclass(slots=True)
class _KeptView:
    """The unknown cells of a field of view; `revision` is the number of reveals when it was last checked."""

    cells: Ints32 | None
    count: int
    revision: int


class Views:
    """The fields of view on one growing map; `cells` and `opaque` are those of `Sight`, `unknown` is a code."""

    def __init__(self, cells: CellArray, opaque: CellArray, unknown: int) -> None:
        self._cells, self._codes, self._unknown = cells, cells.ravel(), unknown
        self._sight = Sight(cells, opaque)
        self._views: dict[tuple[Cell, float], _KeptView] = {}
        self._former: dict[tuple[Cell, float], _KeptView] = {}
        self._boxes: list[tuple[int, int, int, int]] = []
        self._free: Flags = np.zeros(cells.size, dtype=np.bool_)

    def revealed(self, indices: Ints) -> None:
        """Note that cells (row-major) were revealed."""
        y, x = np.divmod(indices, self._cells.shape[1])
        self._boxes.append((int(x.min()), int(y.min()), int(x.max()), int(y.max())))

    def forget(self) -> None:
        """Drop the views that were not used since the last call of this method."""
        self._former, self._views = self._views, {}

    def hidden(self, cell: Cell, range_cells: float) -> int:
        """Return the number of unknown cells visible from a cell."""
        return self._view(cell, range_cells).count

    def clusters(self, groups: Sequence[Ints], range_cells: float) -> list[tuple[int, Ints]]:
        """Split groups of cells (row-major) into clusters that are visible from a seed; return (seed, ascending
        members).

        Each seed is the middle cell of a group's rest, group by group; its cluster may include cells of other groups.
        """
        width, free = self._cells.shape[1], self._free.view(np.uint8)
        for group in groups:
            self._free[group] = True
        found = []
        for group in groups:
            left = group[self._free[group]]
            while left.size:
                seed = int(middle(left, width))
                members = np.sort(self._sight.visible(Cell(seed % width, seed // width), range_cells, free, 1))
                self._free[members] = False
                found.append((seed, members))
                left = left[self._free[left]]
        return found

    def _view(self, cell: Cell, range_cells: float) -> _KeptView:
        key = (cell, range_cells)
        view = self._views.get(key) or self._former.get(key)
        if view is None or self._changed(view, cell, range_cells):
            hidden = self._sight.visible(cell, range_cells, self._codes, self._unknown)
            view = _KeptView(hidden.astype(np.int32) if hidden.size <= MOST_CELLS else None, hidden.size, 0)
        view.revision = len(self._boxes)
        self._views[key] = view
        return view

    def _changed(self, view: _KeptView, cell: Cell, range_cells: float) -> bool:
        """Return whether a cell of a view was revealed since it was last checked."""
        x, y = cell
        # bounding boxes first: most reveals are far away from the view
        for low_x, low_y, high_x, high_y in self._boxes[view.revision :]:
            if (
                low_x <= x + range_cells
                and high_x >= x - range_cells
                and low_y <= y + range_cells
                and high_y >= y - range_cells
            ):
                return view.cells is None or bool((self._codes[view.cells] != self._unknown).any())
        return False
