"""A rectangle of a map, so that the cost of work depends on what is known, not on the size of the map.

Cut masks and grids with `window.cut`; convert row-major indices with `on_map` and `inside`. Both keep the order of
cells, so results in a window equal those on the whole map.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from marsupial.arrays import Ints
from marsupial.model.grid import Cell


class Window(NamedTuple):
    """Rows `bottom` up to `top`, columns `left` up to `right`, both ends excluded; may be empty."""

    bottom: int
    top: int
    left: int
    right: int

    @classmethod
    def around(cls, low: Cell, high: Cell, margin: int, shape: tuple[int, int]) -> Window:
        """Return the cells from `low` to `high`, both included, with a margin, clipped to the map's shape."""
        height, width = shape
        return cls(
            max(0, low.y - margin), min(height, high.y + margin + 1),
            max(0, low.x - margin), min(width, high.x + margin + 1),
        )  # fmt: skip

    @property
    def cut(self) -> tuple[slice, slice]:
        """The window as a numpy index: ``mask[window.cut]`` is a view."""
        return slice(self.bottom, self.top), slice(self.left, self.right)

    def on_map(self, indices: npt.ArrayLike, width: int) -> Ints:
        """Return the indices on a map of `width` of cells given by their indices in the window."""
        y, x = np.divmod(np.asarray(indices, dtype=np.int64), max(1, self.right - self.left))
        return (y + self.bottom) * width + x + self.left

    def inside(self, indices: Ints, width: int) -> Ints:
        """Return the indices in the window of cells of a map of `width`, all inside the window."""
        y, x = np.divmod(indices, width)
        return (y - self.bottom) * (self.right - self.left) + x - self.left
