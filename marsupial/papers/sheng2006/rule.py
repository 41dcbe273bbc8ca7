"""Bids for frontier cells by the number of cells that would be seen from there, and by route length.

References: W. Sheng, Q. Yang, J. Tan, N. Xi: Distributed multi-robot coordination in area exploration, Robotics and
Autonomous Systems 54(12), 2006; as compared with in Al-Khawaldah, Livatino, Lee: Frontier-based Exploration with Two
Cooperating Mobile Robots, section III, Eq. 2.
"""

import math
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from marsupial.arrays import Floats, Ints
from marsupial.maps.discs import disc
from marsupial.model.grid import UNKNOWN, Grid
from marsupial.strategies.frontier.rule import Bidders, Explorer, FrontierView, counted


@dataclass(frozen=True, slots=True, kw_only=True)
class Sheng(Bidders):
    """Eq. 2 of Al-Khawaldah et al. without the nearness measure: g = w_1 I - w_2 D.

    They omit that measure too (w_3 = 0) if robots can always communicate.
    """

    name: ClassVar[str] = "sheng"

    # weight of I, the number of unknown cells in sensor range of the cell that are in range neither of another robot
    # nor of its goal
    w_1: float = 1.0
    w_2: float = 1.0  # weight of D, the length of the route there, in cells

    def bids(
        self, view: FrontierView, robot: Explorer, ways: Floats, others: list[Explorer], aims: list[int]
    ) -> Floats:
        width = view.grid.width
        left = view.grid.cells == UNKNOWN
        # cells that others see, or will see from their goals, count for no other robot
        for other in others:
            around = _around(other, view.grid)
            aim = [view.cell(cell) for cell in aims]
            for cell in (other.cell, *aim):
                near = around + np.array(cell)
                near = near[((near >= 0) & (near < (width, view.grid.height))).all(axis=1)]
                left[near[:, 1], near[:, 0]] = False
        around = _around(robot, view.grid)
        cells = view.frontier(robot).cells
        gain = counted(left, around, cells) * view.priorities(cells)
        return np.asarray(self.w_1 * gain - self.w_2 * ways)


def _around(robot: Explorer, grid: Grid) -> Ints:
    """Return the offsets (k, 2) of the cells in a robot's range, limited to the size of the map."""
    across = math.hypot(grid.width, grid.height)
    offsets = disc(min(robot.kind.sensor_range_m / grid.resolution_m, across))
    return offsets[(np.abs(offsets) < (grid.width, grid.height)).all(axis=1)]
