"""Growth of the map's frame: new indices for cells, new names for places.

A frame grows by whole rows and columns on any side, while the lattice of cells stays where it is in the world. Cells
then have new coordinates, and targets and meeting points, which are named after their cells, have new names.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import TypeVar

import numpy as np
import numpy.typing as npt

from marsupial.model.grid import Cell
from marsupial.model.plan import Action

S = TypeVar("S", bound=np.generic)
Indices = npt.NDArray[np.int64]

_NAMED_AFTER_CELLS = re.compile(r"(?P<kind>[tm])_(?P<numbers>-?\d+(?:_-?\d+)+)(?P<rest>.*)")
_NUMBERS = {"t": 2, "m": 4}  # how many numbers in the name of a target or meeting point are cell coordinates


@dataclass(frozen=True, slots=True)
class FrameShift:
    """The change from one frame to a larger one that contains it."""

    by: Cell  # columns and rows added on the left and below; neither is negative
    width_before: int
    width: int  # of the new frame
    height: int

    def cell(self, cell: Cell) -> Cell:
        """Return a cell's coordinates in the new frame."""
        return Cell(cell.x + self.by.x, cell.y + self.by.y)

    def cells(self, cells: Mapping[str, Cell]) -> dict[str, Cell]:
        """Return each cell's coordinates in the new frame."""
        return {key: self.cell(cell) for key, cell in cells.items()}

    def indices(self, indices: Indices) -> Indices:
        """Return row-major indices in the new frame."""
        x, y = indices % self.width_before + self.by.x, indices // self.width_before + self.by.y
        return y * self.width + x

    def index(self, index: int) -> int:
        """Return one row-major index in the new frame."""
        return int(self.indices(np.array(index)))

    def laid_out(self, cells: npt.NDArray[S], fill: int) -> npt.NDArray[S]:
        """Return an array (height, width) of the old frame in the new one; new cells are `fill`."""
        larger = np.full((self.height, self.width), fill, dtype=cells.dtype)
        larger[self.by.y : self.by.y + cells.shape[0], self.by.x : self.by.x + cells.shape[1]] = cells
        return larger

    def place(self, name: str) -> str:
        """Return the new name of a place; only targets and meeting points are named after their cells."""
        match = _NAMED_AFTER_CELLS.fullmatch(name)
        if match is None:
            return name
        # "t_3_7" is the target at (3, 7); numbers after the coordinates of a name stay as they are
        numbers = [int(number) for number in match["numbers"].split("_")]
        count = _NUMBERS[match["kind"]]
        moved = [number + self.by[i % 2] for i, number in enumerate(numbers[:count])]
        return "_".join([match["kind"], *map(str, moved + numbers[count:])]) + match["rest"]

    def action(self, action: Action) -> Action:
        """Return an action with the new names of its places."""
        origin = None if action.origin is None else self.place(action.origin)
        return replace(action, place=self.place(action.place), origin=origin)

    def then(self, later: FrameShift) -> FrameShift:
        """Return this shift and a later one combined."""
        return FrameShift(
            Cell(self.by.x + later.by.x, self.by.y + later.by.y), self.width_before, later.width, later.height
        )
