"""What figures share: axes of a map in metres, and files with the same bytes for the same figure.

Axes count metres of the map frame, so that a point read off them can stand in a scenario file. If the map is rotated in
its frame, the frame's metres do not run along the map's edges: then axes count from the map's corner, and say so.
"""

import io
import math
from typing import Any

import numpy as np
import numpy.typing as npt
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from marsupial.arrays import Floats
from marsupial.model.grid import Cell

ROTATED_RAD = 1e-6  # a smaller yaw is a rounding error: it moves no corner of a map of kilometres by a centimetre

SAME_BYTES: dict[str, dict[str, Any]] = {
    "svg": {"Date": None, "Creator": None},
    "pdf": {"CreationDate": None, "Creator": None, "Producer": None},
    "png": {"Software": None},
}
"""The metadata to leave out of each kind of file, so that the same figure has the same bytes."""


def figure_file(figure: Figure, kind: str) -> bytes:
    """Return a figure as a file of a kind in `SAME_BYTES`. An SVG holds its text as text, to be searched and edited."""
    from matplotlib import rc_context

    out = io.BytesIO()
    with rc_context({"svg.fonttype": "none", "svg.hashsalt": "marsupial", "pdf.fonttype": 42}):
        figure.savefig(out, format=kind, metadata=SAME_BYTES[kind])
    return out.getvalue()


class MapAxes:
    """The axes of a map of `width` x `height` cells with its lower left corner at `origin_m`: x, y and yaw."""

    def __init__(self, width: int, height: int, resolution_m: float, origin_m: tuple[float, float, float]) -> None:
        x, y, self._yaw = origin_m
        self._resolution_m = resolution_m
        self._is_rotated = abs(self._yaw) > ROTATED_RAD
        self._corner = (0.0, 0.0) if self._is_rotated else (x, y)
        self.extent = self.part(width, height)

    def part(self, width: int, height: int) -> tuple[float, float, float, float]:
        """Return left, right, bottom and top of a part of this size (cells) at the lower left corner."""
        left, bottom = self._corner
        return left, left + width * self._resolution_m, bottom, bottom + height * self._resolution_m

    def points(self, cells: npt.ArrayLike) -> Floats:
        """Return points (..., 2) given in cells from the centre of the lower left cell."""
        return (np.asarray(cells, dtype=np.float64) + 0.5) * self._resolution_m + self._corner

    def centre(self, cell: Cell) -> tuple[float, float]:
        """Return the centre of a cell."""
        x, y = self.points(cell).tolist()
        return x, y

    def label(self, axes: Axes) -> None:
        """Label the ticks in metres; if the map is rotated, name their origin below."""
        for axis in (axes.xaxis, axes.yaxis):
            axis.set_major_formatter(lambda value, _: f"{round(value, 6) + 0.0:.10g} m")
        if self._is_rotated:
            turn = f"the map is turned by {math.degrees(self._yaw):.3g}° in the map frame"
            axes.set_xlabel(f"metres from the lower left corner: {turn}", fontsize=8)
