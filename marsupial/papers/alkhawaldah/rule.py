"""Bids for frontier cells by unknown neighbours, distance from the other robot, and route length.

References: Al-Khawaldah, Livatino, Lee, section 3 ("Experimental Work"), Eq. 1.
"""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from marsupial.arrays import Floats
from marsupial.model.grid import UNKNOWN
from marsupial.paths.routes import STEPS
from marsupial.strategies.frontier.rule import Bidders, Explorer, FrontierView, counted


@dataclass(frozen=True, slots=True, kw_only=True)
class Bidding(Bidders):
    """Eq. 1: B = W_n N_u + W_p D_p - W_c D_r."""

    name: ClassVar[str] = "bidding"

    W_n: float = 2.0  # weight of N_u, the number of unknown cells among the eight neighbours
    W_p: float = 2.0  # weight of D_p, the straight distance of the nearest other robot from the cell, in cells
    W_c: float = 1.0  # weight of D_r, the length of the route there, in cells

    def bids(
        self, view: FrontierView, robot: Explorer, ways: Floats, others: list[Explorer], aims: list[int]
    ) -> Floats:
        cells = view.frontier(robot).cells
        x, y = view.xy(cells)
        apart = [np.hypot(x - other.cell.x, y - other.cell.y) for other in others]
        partner = np.min(apart, axis=0) if apart else np.zeros(len(cells))
        unknown = counted(view.grid.cells == UNKNOWN, np.array([(0, 0), *STEPS]), cells) * view.priorities(cells)
        return np.asarray(self.W_n * unknown + self.W_p * partner - self.W_c * ways)
