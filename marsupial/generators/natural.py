"""Natural ground: a cave grown by a cellular automaton, and open ground strewn with boxes.

Cave: random noise on squares of half a metre is smoothed: a square becomes rock if most of its neighbours are, which
leaves winding halls and passages. Rough ground is where a second, blurred noise is highest.

Boxes of random size are added until they cover the wanted share. Gaps between them are often too narrow for a carrier
and wide enough for a rover.

Unreachable pockets are filled, so that a little more than the wanted share becomes obstacle.

References: Johnson, Yannakakis, Togelius, Cellular automata for real-time generation of infinite cave levels (PCGames
2010).
"""

import math

import numpy as np

from marsupial.generators.canvas import Box, CanvasSize, carve, cells_of, close_border, fill_pockets
from marsupial.model.grid import FLOOR, OBSTACLE, ROUGH, CellArray, Mask

SQUARE_M = 0.5
ROCK_SHARE = 0.44
ROUNDS = 5
ROUGH_SHARE = 0.2
ROUGH_BLUR_M = 1.5

MOST_SHARE = 0.35
DEFAULT_SHARE = 0.15
LEAST_BOX_M, MOST_BOX_M = 0.5, 3.0


def cave(cells: CellArray, rng: np.random.Generator, size: CanvasSize) -> None:
    """Carve a cave; about a fifth of its ground is rough."""
    from scipy import ndimage  # takes a third of a second, and only caves need it

    rock = _rock(rng, *(round(side_m / SQUARE_M) for side_m in (size.height_m, size.width_m)))
    rows = np.arange(cells.shape[0]) * rock.shape[0] // cells.shape[0]
    columns = np.arange(cells.shape[1]) * rock.shape[1] // cells.shape[1]
    cells[~rock[np.ix_(rows, columns)]] = FLOOR
    hills = ndimage.gaussian_filter(rng.random(rock.shape), ROUGH_BLUR_M / SQUARE_M)[np.ix_(rows, columns)]
    close_border(cells)
    fill_pockets(cells)
    ground = cells != OBSTACLE
    # The share is of the ground, not of the map: rock takes a random part of it.
    cells[ground & (hills > np.quantile(hills[ground], 1 - ROUGH_SHARE))] = ROUGH


def _rock(rng: np.random.Generator, height: int, width: int) -> Mask:
    """Return the rock on coarse squares: noise, then `ROUNDS` times the majority of nine squares."""
    from scipy import ndimage

    rock: Mask = rng.random((height, width)) < ROCK_SHARE
    kernel = np.ones((3, 3), dtype=np.int64)
    for _ in range(ROUNDS):
        rock = ndimage.convolve(rock.astype(np.int64), kernel, mode="constant", cval=1) >= 5
    return rock


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
