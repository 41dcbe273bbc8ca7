"""Shared by all generators: an array of cells of checked size, and boxes to carve out of it.

Generators give sizes of walls, doors and corridors in metres. Here they become whole cells, rounded up so that a robot
that fits by the metre fits on the grid. A generator starts from solid obstacle and carves; it never carves the
outermost cells, so every generated map is closed.
"""

import math
from typing import NamedTuple

import numpy as np

from marsupial.errors import MapError, Problem
from marsupial.model.grid import OBSTACLE, CellArray

LEAST_RESOLUTION_M, MOST_RESOLUTION_M = 0.02, 0.5
MOST_SIZE_M = 500.0
MOST_CELLS = 4000
# Ordinary doors let carriers of the default radius of 0.5 m through, narrow ones only rovers.
WALL_M = 0.25
DOOR_M = 1.25
NARROW_DOOR_M = 0.4
CORRIDOR_M = 2.5


class CanvasSize(NamedTuple):
    """The size of a map in metres, and the edge of a cell."""

    width_m: float
    height_m: float
    resolution_m: float


class Box(NamedTuple):
    """Cells with x0 <= x < x1 and y0 <= y < y1."""

    x0: int
    x1: int
    y0: int
    y1: int

    @property
    def area(self) -> int:
        return (self.x1 - self.x0) * (self.y1 - self.y0)


def solid(size: CanvasSize, seed: int, least_m: tuple[float, float]) -> CellArray:
    """Return obstacles (height, width) to carve, at least `least_m`; raise a `MapError` with every wrong parameter."""
    width_m, height_m, resolution_m = size
    problems = []
    if not LEAST_RESOLUTION_M <= resolution_m <= MOST_RESOLUTION_M:
        message = f"must be {LEAST_RESOLUTION_M} to {MOST_RESOLUTION_M}, got {resolution_m}"
        problems.append(Problem("resolution_m", message))
    if seed < 0:
        problems.append(Problem("seed", f"must be 0 or more, got {seed}"))
    for name, size_m, least in (("width_m", width_m, least_m[0]), ("height_m", height_m, least_m[1])):
        if not least <= size_m <= MOST_SIZE_M:
            problems.append(Problem(name, f"must be {least:g} to {MOST_SIZE_M:g}, got {size_m}"))
        elif resolution_m > 0 and size_m / resolution_m > MOST_CELLS:
            problems.append(Problem(name, f"must be at most {MOST_CELLS} cells of {resolution_m} m, got {size_m}"))
    if problems:
        raise MapError(problems)
    return np.full((round(height_m / resolution_m), round(width_m / resolution_m)), OBSTACLE, dtype=np.uint8)


def cells_of(length_m: float, resolution_m: float, *, least: int = 1) -> int:
    """Return the number of cells that cover `length_m`, at least `least`."""
    return max(least, math.ceil(length_m / resolution_m - 1e-9))  # 0.3 / 0.1 is a little more than 3


def door_cells(resolution_m: float) -> int:
    """Return the width of an ordinary door, at least three cells, which let a disc wider than one cell through."""
    return cells_of(DOOR_M, resolution_m, least=3)


def carve(cells: CellArray, box: Box, code: int) -> None:
    cells[box.y0 : box.y1, box.x0 : box.x1] = code


def fill_pockets(cells: CellArray) -> None:
    """Fill all free areas but the largest with obstacle; areas connect over edges of cells."""
    from marsupial.maps.reach import parts  # imports numba, which a list of generators does not need

    labels, count = parts(cells != OBSTACLE)
    if count > 1:
        sizes = np.bincount(labels.ravel())
        sizes[0] = 0
        cells[labels != int(sizes.argmax())] = OBSTACLE


def close_border(cells: CellArray) -> None:
    """Set the outermost cells to obstacle."""
    cells[0, :] = cells[-1, :] = OBSTACLE
    cells[:, 0] = cells[:, -1] = OBSTACLE
