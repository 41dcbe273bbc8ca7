"""What becomes of cells when the frame of a map grows.

The lattice of cells stays where it is in the world: a frame grows by whole rows and columns, on any side. A cell then
has another number, and what is called after a cell (targets and meeting points) another name.
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

_CALLED_AFTER = re.compile(r"(?P<kind>[tm])_(?P<numbers>-?\d+(?:_-?\d+)+)(?P<rest>.*)")
_NUMBERS = {"t": 2, "m": 4}
"""How many numbers of the name of a target or a meeting point tell its cells, two for each."""


@dataclass(frozen=True, slots=True)
class FrameShift:
    """From one frame to a larger one that holds it.

    Parameters
    ----------
    by
        Columns and rows by which cells are further from the lower left corner now; neither is negative.
    width_before
        Columns of the frame before.
    width, height
        Of the frame now, in cells.
    """

    by: Cell
    width_before: int
    width: int
    height: int

    def cell(self, cell: Cell) -> Cell:
        """Return the cell as it is called now."""
        return Cell(cell.x + self.by.x, cell.y + self.by.y)

    def cells(self, cells: Mapping[str, Cell]) -> dict[str, Cell]:
        """Return each cell as it is called now."""
        return {key: self.cell(cell) for key, cell in cells.items()}

    def indices(self, indices: Indices) -> Indices:
        """Return row-major indices as they are now."""
        x, y = indices % self.width_before + self.by.x, indices // self.width_before + self.by.y
        return y * self.width + x

    def laid_out(self, cells: npt.NDArray[S], fill: int) -> npt.NDArray[S]:
        """Return an array (height, width) of the frame before in the frame now, with `fill` in what is new."""
        larger = np.full((self.height, self.width), fill, dtype=cells.dtype)
        larger[self.by.y : self.by.y + cells.shape[0], self.by.x : self.by.x + cells.shape[1]] = cells
        return larger

    def place(self, name: str) -> str:
        """Return what a place of a situation is called now: targets and meeting points are called after their cells."""
        match = _CALLED_AFTER.fullmatch(name)
        if match is None:
            return name
        numbers = [int(number) for number in match["numbers"].split("_")]
        count = _NUMBERS[match["kind"]]
        moved = [number + self.by[i % 2] for i, number in enumerate(numbers[:count])]
        return "_".join([match["kind"], *map(str, moved + numbers[count:])]) + match["rest"]

    def action(self, action: Action) -> Action:
        """Return an action with its places as they are called now."""
        origin = None if action.origin is None else self.place(action.origin)
        return replace(action, place=self.place(action.place), origin=origin)

    def then(self, later: FrameShift) -> FrameShift:
        """Return this shift and a later one as one."""
        return FrameShift(
            Cell(self.by.x + later.by.x, self.by.y + later.by.y), self.width_before, later.width, later.height
        )
