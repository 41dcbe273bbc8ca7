"""Open ground with boxes of random size, added until they cover the wanted share.

Gaps between boxes are often too narrow for a carrier and wide enough for a rover. Unreachable pockets are filled, so
that a little more than the wanted share becomes obstacle.
"""

from __future__ import annotations

import math

import numpy as np

from marsupial.generators.canvas import Box, CanvasSize, carve, cells_of, close_border, fill_pockets
from marsupial.model.grid import FLOOR, OBSTACLE, CellArray

MOST_SHARE = 0.35
DEFAULT_SHARE = 0.15
LEAST_BOX_M, MOST_BOX_M = 0.5, 3.0


def random_obstacles(
    cells: CellArray, rng: np.random.Generator, size: CanvasSize, share: float = DEFAULT_SHARE
) -> None:
    """Strew boxes over open ground; `share` of it is covered, at most `MOST_SHARE`."""
    cells[:] = FLOOR
    wanted = math.floor(share * cells.size)
    least, most = (cells_of(side_m, size.resolution_m) for side_m in (LEAST_BOX_M, MOST_BOX_M))
    while np.count_nonzero(cells == OBSTACLE) < wanted:  # boxes may overlap
        wide, high = rng.integers(least, most + 1, 2).tolist()
        x0, y0 = int(rng.integers(cells.shape[1] - wide + 1)), int(rng.integers(cells.shape[0] - high + 1))
        carve(cells, Box(x0, x0 + wide, y0, y0 + high), OBSTACLE)
    close_border(cells)
    fill_pockets(cells)
