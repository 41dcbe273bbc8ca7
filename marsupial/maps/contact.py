"""The cells that a robot's body would touch one cell further on, and so knows without seeing them.

A robot next to an unknown cell learns whether it can go on. Contact spreads from cell to neighbouring cell, up to one
cell beyond the footprint, and ends at obstacles: it passes neither walls nor closed corners (two obstacles that touch
at a corner). If it did, the robot would reveal cells behind them and leave a frontier there that no robot can reach.
"""

from __future__ import annotations

import numpy as np

from marsupial.arrays import Ints
from marsupial.maps.footprint import disc
from marsupial.model import OBSTACLE, Cell, CellArray, RobotType
from marsupial.native import native


class Contact:
    """Finds the cells that robots of one type touch."""

    def __init__(self, kind: RobotType, resolution_m: float) -> None:
        # slightly more than one cell, so that rounding leaves out no cell of the footprint one cell further
        self._offsets = disc(kind.radius_m / resolution_m + 1.0 + 1e-6)
        self._beside = _beside(self._offsets)

    def touched(self, truth: CellArray, cell: Cell) -> Ints:
        """Return the cells touched from `cell`, itself included, as row-major indices of the map (height, width)."""
        touched: Ints = _touched(truth, cell.x, cell.y, self._offsets, self._beside)
        return touched


def _beside(offsets: Ints) -> Ints:
    """Return the positions (n, 4) in `offsets` (n, 2) of the four neighbours of each, -1 for those outside."""
    place = {(int(dx), int(dy)): i for i, (dx, dy) in enumerate(offsets)}
    steps = ((1, 0), (-1, 0), (0, 1), (0, -1))
    beside = [[place.get((dx + u, dy + v), -1) for u, v in steps] for dx, dy in place]
    return np.array(beside, dtype=np.int64)


@native
def _touched(truth: CellArray, x: int, y: int, offsets: Ints, beside: Ints) -> Ints:
    """Return the cells touched from (x, y), by breadth-first search; see `Contact.touched` and `_beside`."""
    height, width = truth.shape
    new = np.ones(len(offsets), dtype=np.bool_)
    queue, out = np.empty((2, len(offsets)), dtype=np.int64)
    queue[0] = len(offsets) // 2  # the middle of the disc, which is the robot's own cell
    new[queue[0]] = False
    head, tail, count = 0, 1, 0
    while head < tail:
        k = queue[head]
        head += 1
        u, v = x + offsets[k, 0], y + offsets[k, 1]
        if u < 0 or v < 0 or u >= width or v >= height:
            continue
        out[count] = v * width + u
        count += 1
        if truth[v, u] == OBSTACLE and k != queue[0]:
            continue
        for i in range(4):
            near = beside[k, i]
            if near >= 0 and new[near]:
                new[near] = False
                queue[tail] = near
                tail += 1
    return out[:count].copy()
