"""Maps of other papers' experiments, in cells of 1 m: scattered obstacles, and halls divided into rooms.

The divided halls follow the areas with structured obstacles of Mei et al. The paper says that the first has three rooms
with small openings at the doors. For the others it gives only the length of the robot's route and its energy.

References: Mei, Lu, Lee and Hu: Energy-Efficient Mobile Robot Exploration, ICRA 2006, sections III-A, V-A and V-C;
Al-Khawaldah, Livatino, Lee: Frontier-based Exploration with Two Cooperating Mobile Robots, section II-A.
"""

from collections.abc import Callable, Mapping, Sequence

import numpy as np

from marsupial.generators.canvas import Box, carve, close_border
from marsupial.model.grid import FLOOR, OBSTACLE, Grid

SIDE = 100  # side of the divided halls in cells


def scattered(columns: int, rows: int, obstacles: int, seed: int) -> Grid:
    """Return open ground with obstacles of one cell each at random; it has no border, as outside counts as obstacle."""
    cells = np.full((rows, columns), FLOOR, dtype=np.uint8)
    cells.ravel()[np.random.default_rng(seed).choice(cells.size, obstacles, replace=False)] = OBSTACLE
    return Grid(cells=cells, resolution_m=1.0)


def three_rooms() -> Grid:
    """Return a hall with three rooms beside it, doors of 4 cells."""
    walls = [_down(40, 1, 99), _across(33, 41, 99), _across(66, 41, 99)]
    doors = [_down(40, y, y + 4) for y in (15, 48, 81)]
    return _area(walls, doors)


def six_rooms() -> Grid:
    """Return a corridor with three rooms on either side, doors of 3 cells."""
    walls = [_across(y, 1, 99) for y in (44, 56)]
    walls += [_down(x, *ends) for x in (33, 66) for ends in ((1, 44), (57, 99))]
    doors = [_across(y, x, x + 3) for y in (44, 56) for x in (16, 49, 82)]
    return _area(walls, doors)


WALLED: Mapping[str, Callable[[], Grid]] = {"three-rooms": three_rooms, "six-rooms": six_rooms}


def _down(x: int, y0: int, y1: int) -> Box:
    return Box(x, x + 1, y0, y1)


def _across(y: int, x0: int, x1: int) -> Box:
    return Box(x0, x1, y, y + 1)


def _area(walls: Sequence[Box], doors: Sequence[Box]) -> Grid:
    cells = np.full((SIDE, SIDE), FLOOR, dtype=np.uint8)
    close_border(cells)
    for boxes, code in ((walls, OBSTACLE), (doors, FLOOR)):
        for box in boxes:
            carve(cells, box, code)
    return Grid(cells=cells, resolution_m=1.0)
