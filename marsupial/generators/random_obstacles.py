"""Open ground with boxes of random size strewn over it until they cover the wanted share.

Gaps between boxes are often too narrow for a carrier and wide enough for a rover. Pockets that nothing can reach are
filled, so a little more than the wanted share ends up as obstacle.
"""

from __future__ import annotations

import math

import numpy as np

from marsupial.errors import MapError, Problem
from marsupial.generators.canvas import Box, carve, cells_of, close_border, fill_pockets, finished, solid
from marsupial.model.grid import FLOOR, OBSTACLE, Grid

LEAST_M = (6.0, 6.0)
MOST_SHARE = 0.35
DEFAULT_SHARE = 0.15
LEAST_BOX_M, MOST_BOX_M = 0.5, 3.0


def random_obstacles(
    *, width_m: float, height_m: float, resolution_m: float, seed: int, share: float = DEFAULT_SHARE
) -> Grid:
    """Generate open ground with random boxes; `share` of it is covered, 0 to 0.35."""
    if not 0 <= share <= MOST_SHARE:
        raise MapError([Problem("share", f"must be 0 to {MOST_SHARE}, got {share}")])
    cells = solid(width_m=width_m, height_m=height_m, resolution_m=resolution_m, seed=seed, least_m=LEAST_M)
    rng = np.random.default_rng(seed)
    cells[:] = FLOOR
    wanted = math.floor(share * cells.size)
    least, most = cells_of(LEAST_BOX_M, resolution_m), cells_of(MOST_BOX_M, resolution_m)
    while np.count_nonzero(cells == OBSTACLE) < wanted:
        wide, high = rng.integers(least, most + 1, 2).tolist()
        x0, y0 = int(rng.integers(cells.shape[1] - wide + 1)), int(rng.integers(cells.shape[0] - high + 1))
        carve(cells, Box(x0, x0 + wide, y0, y0 + high), OBSTACLE)
    close_border(cells)
    fill_pockets(cells)
    return finished(cells, resolution_m)
