"""A small building for quick tries: one hall with a few rooms on both sides, about half of them for rovers only."""

from __future__ import annotations

import numpy as np

from marsupial.generators.canvas import WALL_M, Box, CanvasSize, carve, cells_of
from marsupial.generators.floorplan import band, furnish
from marsupial.model.grid import FLOOR, CellArray

HALL_M = 3.0


def lobby(cells: CellArray, rng: np.random.Generator, size: CanvasSize) -> None:
    """Carve a hall with rooms below and above it."""
    resolution_m = size.resolution_m
    wall, hall = cells_of(WALL_M, resolution_m), cells_of(HALL_M, resolution_m)
    height, width = cells.shape
    low_top = (height - 4 * wall - hall) // 2 + wall
    bottom, top = low_top + wall, low_top + wall + hall
    rooms = band(rng, Box(wall, width - wall, wall, low_top), (low_top, bottom), resolution_m)
    rooms += band(rng, Box(wall, width - wall, top + wall, height - wall), (top, top + wall), resolution_m)
    furnish(rng, cells, rooms)
    carve(cells, Box(wall, width - wall, bottom, top), FLOOR)
