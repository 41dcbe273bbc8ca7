"""Rules by bids: each robot takes the frontier cell with its highest bid, and bids again at every cell it reaches.

All robots bid on the same map, in the order of the team. Of equal bids that for the first cell wins, row by row. Bids
may change with every step, so that a robot oscillates between two cells: it is sent to a random neighbouring cell then.
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
"""Greatest difference of equal bids."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Bidders(ABC):
    """Base of the rules by bids: robots bid one after the other."""

    each_step: ClassVar[bool] = True
    gives_up: ClassVar[bool] = True
    most_robots: ClassVar[int | None] = None

    def choose(self, view: FrontierView) -> Mapping[str, int]:
        """Return the cell with the highest bid for each robot that can reach one."""
        goals = {robot.name: robot.goal for robot in view.robots}
        for robot in view.robots:
            others = [other for other in view.robots if other is not robot]
            aims = [goal for other in others if (goal := goals[other.name]) is not None]
            ways = view.ways(robot)
            bids = self.bids(view, robot, ways, others, aims)
            bids[~np.isfinite(ways)] = -np.inf
            if robot.oscillates:
                goals[robot.name] = _random_step(view, robot)
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
        """Return the bids (n,) of a robot for its frontier cells, at lengths `ways` (n,) in cells.

        `aims` are the frontier cells that the others drive to.
        """


def counted(mask: Flags, around: Ints, cells: Ints) -> Floats:
    """Return how many cells of a mask (height, width) are set around each of n cells, by a Fourier transform.

    `around` (k, 2) are the offsets dx, dy of the cells to count, at least (0, 0).
    """
    reach = int(np.abs(around).max())
    shape = (mask.shape[0] + 2 * reach, mask.shape[1] + 2 * reach)
    kernel = np.zeros(shape)
    kernel[-around[:, 1], -around[:, 0]] = 1.0  # negative indices count from the end, where a periodic signal continues
    found = np.fft.irfft2(np.fft.rfft2(mask, shape) * np.fft.rfft2(kernel), shape)
    return np.rint(found[: mask.shape[0], : mask.shape[1]].ravel()[cells])


def _random_step(view: FrontierView, robot: Explorer) -> int | None:
    """Return a random cell that a robot can step to."""
    near = view.around(robot)
    return int(view.rng.choice(near)) if len(near) else None
