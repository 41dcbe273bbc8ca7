"""Crop large maps to their known part.

Packages for mapping save frames of a fixed size, 2048 x 2048 or 4000 x 4000 cells, of which most are unknown; memory
and time of a mission would follow the frame. So a frame of more than `WHOLE_CELLS` loses the unknown rows and columns
along its edges, but for one, beyond which robots see nothing either way. The origin moves, so that points in metres
stay where they are. Smaller maps are read as they are.
"""

from collections.abc import Iterable
from dataclasses import replace
from typing import TypeVar

import numpy as np
import numpy.typing as npt

from marsupial.maps.window import Window
from marsupial.model.grid import UNKNOWN, Cell, CroppedFrame, Grid, MapReading, Mask

S = TypeVar("S", bound=np.generic)

WHOLE_CELLS = 2_125_000  # most cells of a map that is read whole

MARGIN = 1  # unknown rows and columns that stay along each edge


def known_window(bands: Iterable[tuple[int, Mask]], shape: tuple[int, int]) -> Window | None:
    """Return the window of a frame (height, width) around its known cells; None if that is no smaller, or all unknown.

    The masks of known cells come in bands of whole rows, each with its first row.
    """
    rows: list[int] = []
    across = np.zeros(shape[1], dtype=np.bool_)
    for first, known in bands:
        across |= known.any(axis=0)
        found = np.flatnonzero(known.any(axis=1))
        rows += (found[[0, -1]] + first).tolist() if found.size else []
    if not rows:
        return None
    columns = np.flatnonzero(across)
    window = Window.around(Cell(int(columns[0]), min(rows)), Cell(int(columns[-1]), max(rows)), MARGIN, shape)
    return None if window == Window(0, shape[0], 0, shape[1]) else window


def placed_in(grid: Grid, frame: CroppedFrame) -> Grid:
    """Return the map of a frame's known part, given with the frame's origin, where it is in the world."""
    x, y = grid.point_m(frame.left, frame.bottom)
    return replace(grid, origin_m=(round(x, 9), round(y, 9), grid.origin_m[2]))


def known_part(reading: MapReading) -> MapReading:
    """Return a map cropped to its known part if it is large."""
    cells = reading.grid.cells
    if cells.size <= WHOLE_CELLS or (window := known_window([(0, cells != UNKNOWN)], cells.shape)) is None:
        return reading
    frame = CroppedFrame(width=cells.shape[1], height=cells.shape[0], left=window.left, bottom=window.bottom)
    return replace(
        reading,
        grid=placed_in(replace(reading.grid, cells=cells[window.cut].copy()), frame),
        format=f"{reading.format}{words(frame)}",
        frame=frame,
    )


def words(frame: CroppedFrame | None) -> str:
    """Return how the format of a map names its frame, if that was cropped."""
    return "" if frame is None else f", the known part of {frame.width} x {frame.height} cells"


def cut(values: npt.NDArray[S], frame: CroppedFrame | None, shape: tuple[int, ...]) -> npt.NDArray[S]:
    """Return the part of a frame's values (height, width) that was kept as a map of a `shape`, the lowest row first."""
    if frame is None:
        return values
    return values[frame.bottom : frame.bottom + shape[0], frame.left : frame.left + shape[1]]
