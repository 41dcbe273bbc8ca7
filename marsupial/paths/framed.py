"""Grids with a frame of closed cells, as the flood searches work on them."""

from collections.abc import Sequence
from typing import TypeVar

import numpy as np

from marsupial.arrays import Bytes, Cells, Floats, Ints
from marsupial.model.grid import Cell

NOWHERE: Cells = np.empty(0, dtype=np.uint32)

_Framed = TypeVar("_Framed", Bytes, Floats)


class FramedGrid:
    """A grid framed by closed cells, so that no search tests for the edge of the map."""

    def __init__(self, height: int, width: int) -> None:
        self._height, self._width = height, width
        self._row = row = width + 2
        self.size = (height + 2) * row
        around = np.array([1, row + 1, row, row - 1, -1, -row - 1, -row, -row + 1], dtype=np.int64)
        # (24,): from a cell to its neighbours, counter-clockwise from east, three times round, so that a direction plus
        # or minus a few needs no modulo
        self.offsets = np.tile(around, 3).astype(np.uint64)

    def indices(self, cells: Sequence[Cell] | Ints) -> Cells:
        """Return the framed index of each cell; for cells outside the grid, the index of a closed cell."""
        xy = np.array(cells, dtype=np.int64).reshape(-1, 2)
        x, y = xy[:, 0], xy[:, 1]
        inside = (x >= 0) & (x < self._width) & (y >= 0) & (y < self._height)
        return np.where(inside, (y + 1) * self._row + x + 1, 0).astype(np.uint32)

    def framed(self, cells: Ints) -> Ints:
        """Return the framed index of cells of the grid, by row-major index."""
        y, x = np.divmod(cells, self._width)
        index: Ints = (y + 1) * self._row + x + 1
        return index

    def inside(self, framed: _Framed) -> _Framed:
        """Return the view (height, width) of a framed array without its frame."""
        return framed.reshape(self._height + 2, self._row)[1:-1, 1:-1]
