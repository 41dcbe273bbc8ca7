"""A small building for quick tries: one hall with a few rooms on both sides, about half of them for rovers only."""

from __future__ import annotations

import numpy as np

from marsupial.generators.canvas import WALL_M, Box, carve, cells_of, finished, solid
from marsupial.generators.floorplan import band, furnish
from marsupial.model.grid import FLOOR, Grid

LEAST_M = (8.0, 9.0)
HALL_M = 3.0


def lobby(*, width_m: float, height_m: float, resolution_m: float, seed: int) -> Grid:
    """Generate a hall of `width_m` with rooms below and above it."""
    cells = solid(width_m=width_m, height_m=height_m, resolution_m=resolution_m, seed=seed, least_m=LEAST_M)
    rng = np.random.default_rng(seed)
    wall, hall = cells_of(WALL_M, resolution_m), cells_of(HALL_M, resolution_m)
    height, width = cells.shape
    low_top = (height - 4 * wall - hall) // 2 + wall
    bottom, top = low_top + wall, low_top + wall + hall
    rooms = band(rng, Box(wall, width - wall, wall, low_top), (low_top, bottom), resolution_m)
    rooms += band(rng, Box(wall, width - wall, top + wall, height - wall), (top, top + wall), resolution_m)
    furnish(rng, cells, rooms)
    carve(cells, Box(wall, width - wall, bottom, top), FLOOR)
    return finished(cells, resolution_m)
