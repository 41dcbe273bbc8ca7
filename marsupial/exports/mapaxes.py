"""Axes of a map in a figure: metres of the map frame, so that what is read off them can stand in a scenario file.

Where the map frame is turned against the map its metres do not run along the edges: axes count from the corner then,
and say so.
"""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt
from matplotlib.axes import Axes

from marsupial.arrays import Floats
from marsupial.model.grid import Cell

TURNED_RAD = 1e-6
"""A yaw below it moves no corner of a map of kilometres by a centimetre: it is what is left of a computed 0."""


class MapAxes:
    """How the axes of one map count.

    Parameters
    ----------
    width, height
        Of the map, in cells.
    origin_m
        (x, y, yaw) of its lower left corner in the map frame; metres and radians.
    """

    def __init__(self, width: int, height: int, resolution_m: float, origin_m: tuple[float, float, float]) -> None:
        x, y, self._yaw = origin_m
        self._resolution_m = resolution_m
        self._corner = (0.0, 0.0) if self._turned else (x, y)
        self.extent = self.part(width, height)

    @property
    def _turned(self) -> bool:
        return abs(self._yaw) > TURNED_RAD

    def part(self, width: int, height: int) -> tuple[float, float, float, float]:
        """Return left, right, bottom and top of so many cells from the lower left corner on."""
        left, bottom = self._corner
        return left, left + width * self._resolution_m, bottom, bottom + height * self._resolution_m

    def points(self, cells: npt.ArrayLike) -> Floats:
        """Return points (..., 2) that are counted in cells from the centre of the lower left one."""
        return (np.asarray(cells, dtype=np.float64) + 0.5) * self._resolution_m + self._corner

    def centre(self, cell: Cell) -> tuple[float, float]:
        """Return the centre of a cell."""
        x, y = self.points(cell).tolist()
        return x, y

    def label(self, axes: Axes) -> None:
        """Let the ticks say metres, and below what they count from where that is not the map frame."""
        for axis in (axes.xaxis, axes.yaxis):
            axis.set_major_formatter(lambda value, _: f"{round(value, 6) + 0.0:.10g} m")
        if self._turned:
            turn = f"the map is turned by {math.degrees(self._yaw):.3g}° in the map frame"
            axes.set_xlabel(f"metres from the lower left corner: {turn}", fontsize=8)
