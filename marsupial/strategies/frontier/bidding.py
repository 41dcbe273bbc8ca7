"""Bidding: each robot takes the frontier cell that it bids most for, and bids anew at every cell it comes to.

All robots bid on the same map, in the order of the team. Of equal bids the one for the first cell counts, row by row. A
robot that goes to and fro between two cells, since the bids for two targets change with every step, is sent to a
neighbouring cell by lot.

References
----------
Al-Khawaldah, Livatino, Lee: Frontier-based Exploration with Two Cooperating Mobile Robots, sections II-B and III, Eqs.
1 and 2; W. Sheng, Q. Yang, J. Tan, N. Xi: Distributed multi-robot coordination in area exploration, Robotics and
Autonomous Systems 54(12), 2006.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from marsupial.arrays import Flags, Floats, Ints
from marsupial.maps.footprint import disc
from marsupial.model.grid import UNKNOWN, Grid
from marsupial.paths.routes import STEPS
from marsupial.strategies.frontier.view import Explorer, FrontierView

EQUAL = 1e-9
"""Bids that differ by no more are equal."""


@dataclass(frozen=True, slots=True, kw_only=True)
class _Bidders(ABC):
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


@dataclass(frozen=True, slots=True, kw_only=True)
class Bidding(_Bidders):
    """Eq. 1: B = W_n N_u + W_p D_p - W_c D_r.

    Parameters
    ----------
    W_n
        Weight of N_u, how many of the eight neighbours are unknown.
    W_p
        Weight of D_p, how far the nearest other robot is from the cell in a straight line, in cells.
    W_c
        Weight of D_r, the length of the way there, in cells.
    """

    name: ClassVar[str] = "bidding"

    W_n: float = 2.0
    W_p: float = 2.0
    W_c: float = 1.0

    def bids(
        self, view: FrontierView, robot: Explorer, ways: Floats, others: list[Explorer], aims: list[int]
    ) -> Floats:
        """Return the bids (n,) for the frontier cells."""
        cells = view.frontier(robot).cells
        x, y = view.xy(cells)
        apart = [np.hypot(x - other.cell.x, y - other.cell.y) for other in others]
        partner = np.min(apart, axis=0) if apart else np.zeros(len(cells))
        unknown = counted(view.grid.cells == UNKNOWN, np.array([(0, 0), *STEPS]), cells)
        return np.asarray(self.W_n * unknown + self.W_p * partner - self.W_c * ways)


@dataclass(frozen=True, slots=True, kw_only=True)
class Sheng(_Bidders):
    """Eq. 2 without the nearness measure: g = w_1 I - w_2 D.

    The paper leaves that measure out, too (w_3 = 0), where robots can always communicate.

    Parameters
    ----------
    w_1
        Weight of I, how many cells in sensor range of the cell are unknown and neither in range of another robot nor of
        the cell that it goes to.
    w_2
        Weight of D, the length of the way there, in cells.
    """

    name: ClassVar[str] = "sheng"

    w_1: float = 1.0
    w_2: float = 1.0

    def bids(
        self, view: FrontierView, robot: Explorer, ways: Floats, others: list[Explorer], aims: list[int]
    ) -> Floats:
        """Return the bids (n,) for the frontier cells."""
        width = view.grid.width
        left = view.grid.cells == UNKNOWN
        for other in others:
            around = _around(other, view.grid)
            aim = [view.cell(cell) for cell in aims]
            for cell in (other.cell, *aim):
                near = around + np.array(cell)
                near = near[((near >= 0) & (near < (width, view.grid.height))).all(axis=1)]
                left[near[:, 1], near[:, 0]] = False
        around = _around(robot, view.grid)
        gain = counted(left, around, view.frontier(robot).cells)
        return np.asarray(self.w_1 * gain - self.w_2 * ways)


def _around(robot: Explorer, grid: Grid) -> Ints:
    """Return the offsets (k, 2) of the cells in a robot's range; none that lead off the map from everywhere on it."""
    across = math.hypot(grid.width, grid.height)
    offsets = disc(min(robot.kind.sensor_range_m / grid.resolution_m, across))
    return offsets[(np.abs(offsets) < (grid.width, grid.height)).all(axis=1)]


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
