"""Robots that bid: each takes the frontier cell that it bids most for, and bids anew at every cell it comes to.

All robots bid on the same map, in the order of the team. Of equal bids the one for the first cell counts, row by row. A
robot that goes to and fro between two cells, since the bids for two targets change with every step, is sent to a
neighbouring cell by lot.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from marsupial.arrays import Flags, Floats, Ints
from marsupial.strategies.frontier.view import Explorer, FrontierView

EQUAL = 1e-9
"""Bids that differ by no more are equal."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Bidders(ABC):
    """Robots that bid one after the other."""

    each_step: ClassVar[bool] = True
    gives_up: ClassVar[bool] = True
    most_robots: ClassVar[int | None] = None

    def choose(self, view: FrontierView) -> Mapping[str, int]:
        """Return the cell with the highest bid for each robot that can get to one."""
        goals = {robot.name: robot.goal for robot in view.robots}
        for robot in view.robots:
            others = [other for other in view.robots if other is not robot]
            aims = [goal for other in others if (goal := goals[other.name]) is not None]
            ways = view.ways(robot)
            bids = self.bids(view, robot, ways, others, aims)
            bids[~np.isfinite(ways)] = -np.inf
            if robot.oscillates:
                goals[robot.name] = _aside(view, robot)
            elif np.isfinite(bids).any():
                best = int(np.argmax(bids >= bids.max() - EQUAL))
                goals[robot.name] = int(view.frontier(robot).cells[best])
            else:
                goals[robot.name] = None
        return {name: goal for name, goal in goals.items() if goal is not None}

    @abstractmethod
    def bids(
        self, view: FrontierView, robot: Explorer, ways: Floats, others: list[Explorer], aims: list[int]
    ) -> Floats:
        """Return the bids (n,) of a robot for its frontier cells.

        Parameters
        ----------
        ways
            (n,) lengths of its ways there, in cells.
        others
            The other robots.
        aims
            The frontier cells that they go to.
        """


def counted(mask: Flags, around: Ints, cells: Ints) -> Floats:
    """Return how many cells of a mask lie around each of some cells.

    Parameters
    ----------
    mask
        (height, width).
    around
        (k, 2): dx, dy of the cells that count, from a cell; (0, 0) at least.
    cells
        (n,) row-major indices.
    """
    reach = int(np.abs(around).max())
    shape = (mask.shape[0] + 2 * reach, mask.shape[1] + 2 * reach)
    kernel = np.zeros(shape)
    kernel[-around[:, 1], -around[:, 0]] = 1.0  # negative ones count from the end, where the transform goes on
    found = np.fft.irfft2(np.fft.rfft2(mask, shape) * np.fft.rfft2(kernel), shape)
    return np.rint(found[: mask.shape[0], : mask.shape[1]].ravel()[cells])


def _aside(view: FrontierView, robot: Explorer) -> int | None:
    """Return one of the cells around a robot that it can step to, by lot."""
    near = view.around(robot)
    return int(view.rng.choice(near)) if len(near) else None
