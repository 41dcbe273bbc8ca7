"""Maps of any size for benches, each drawn by a seed: the generators' maps without their size limits."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from marsupial.generators import GENERATORS
from marsupial.generators.canvas import CanvasSize
from marsupial.model.grid import OBSTACLE, Grid, Mask

ROOM = 32
"""Edge of a room in cells, one wall included."""

CAVE_M = 0.1
"""Edge of a cell of a cave."""


def rand20(size: int, seed: int) -> Mask:
    """Return a square map with 20 % of its cells blocked at random."""
    return np.random.default_rng(seed).random((size, size)) >= 0.2


def rooms(size: int, seed: int) -> Mask:
    """Return a square map of rooms 32 cells wide with a door, one cell wide, in each wall between two."""
    random = np.random.default_rng(seed)
    passable = np.ones((size, size), dtype=np.bool_)
    passable[ROOM - 1 :: ROOM] = False
    passable[:, ROOM - 1 :: ROOM] = False
    for wall in range(ROOM - 1, size, ROOM):
        for room in range(0, size, ROOM):
            doors = np.minimum(room + random.integers(0, ROOM - 1, 2), size - 1)
            passable[wall, doors[0]] = True
            passable[doors[1], wall] = True
    return passable


def cave(size: int, seed: int) -> Mask:
    """Return a square map of a cave."""
    return np.asarray(generated("cave", size, CAVE_M, seed).cells != OBSTACLE)


MASKS: dict[str, Callable[[int, int], Mask]] = {"rand20": rand20, "rooms": rooms, "cave": cave}
"""Functions of size and seed that return the mask of passable cells."""


def generated(name: str, size: int, resolution_m: float, seed: int) -> Grid:
    """Return a generator's square map with that many cells a side."""
    cells = np.full((size, size), OBSTACLE, dtype=np.uint8)
    side_m = size * resolution_m
    GENERATORS[name].carve(cells, np.random.default_rng(seed), CanvasSize(side_m, side_m, resolution_m))
    return Grid(cells=cells, resolution_m=resolution_m)
