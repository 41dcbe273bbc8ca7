"""Exploring by orientation: what is to the left first, so that nothing is left behind; and the widest frontier.

A single robot. Both rules look at the frontier cells within the sensing region, which are those in line of sight
within sensor range; where there are none, at the closest one outside. The robot looks around at every cell, and chooses
again as soon as the cell that it goes to is no frontier cell any more, as happens long before it gets there.

References
----------
Mei, Lu, Lee and Hu: Energy-Efficient Mobile Robot Exploration, ICRA 2006, sections IV-B and V-C.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise
from typing import ClassVar

import numpy as np

from marsupial.arrays import Ints
from marsupial.maps.reach import groups, middle
from marsupial.maps.sight import Sight
from marsupial.strategies.frontier.view import Explorer, FrontierView

FULL_TURN = 2 * np.pi
ANGLE_DIGITS = 9
"""Angles that agree in so many decimals are the same."""


@dataclass(frozen=True, slots=True, kw_only=True)
class _Sensing(ABC):
    """A robot that goes to a frontier cell of its sensing region, or else to the closest one outside."""

    each_step: ClassVar[bool] = True
    gives_up: ClassVar[bool] = True
    most_robots: ClassVar[int | None] = 1

    def choose(self, view: FrontierView) -> Mapping[str, int]:
        """Return the cell that the robot goes to next, unless it is on its way or can get nowhere."""
        chosen: dict[str, int] = {}
        for robot in view.robots:
            if robot.goal is not None:
                continue
            ways = view.ways(robot)
            closest = view.closest(robot, ways)
            if closest is None:
                continue
            reached = view.frontier(robot).cells[np.isfinite(ways)]
            near = reached[np.isin(reached, _region(view, robot))]
            chosen[robot.name] = self.pick(view, robot, near) if near.size else closest
        return chosen

    @abstractmethod
    def pick(self, view: FrontierView, robot: Explorer, cells: Ints) -> int:
        """Return one of the frontier cells of the sensing region, of which there is at least one."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Orientation(_Sensing):
    """Section IV-B: frontier cells in clockwise order from the robot's left.

    The robot goes as far along the list as its cells are neighbours without a jump and less than a share of the sensor
    range d_s away from the first: so the sensors see what is to the left, and it does not creep along walls.

    Parameters
    ----------
    share
        Of d_s.
    """

    name: ClassVar[str] = "orientation"

    share: float = 0.7

    def pick(self, view: FrontierView, robot: Explorer, cells: Ints) -> int:
        """Return the last cell of the list that is near enough to its head."""
        listed = clockwise(view, robot, cells)
        x, y = view.xy(listed)
        limit = self.share * robot.kind.sensor_range_m / view.grid.resolution_m
        last = 0
        for k, follower in pairwise(range(len(listed))):
            jump = max(abs(x[follower] - x[k]), abs(y[follower] - y[k])) > 1
            if jump or np.hypot(x[follower] - x[0], y[follower] - y[0]) >= limit:
                break
            last = follower
        return int(listed[last])


@dataclass(frozen=True, slots=True, kw_only=True)
class WidestFrontier(_Sensing):
    """Section V-C: the middle of the frontier with the most cells, a frontier being a group of cells that touch."""

    name: ClassVar[str] = "widest-frontier"

    def pick(self, view: FrontierView, robot: Explorer, cells: Ints) -> int:
        """Return the cell of the widest frontier that is nearest to its centre of gravity."""
        widest = max(groups(cells, view.grid.cells.shape), key=len)
        return int(middle(widest, view.grid.width))


def clockwise(view: FrontierView, robot: Explorer, cells: Ints) -> Ints:
    """Return cells in clockwise order from a robot's left; of those in the same direction the farthest first.

    A robot that has not moved yet faces along x.
    """
    x, y = view.xy(cells)
    dx, dy = x - robot.cell.x, y - robot.cell.y
    left = np.pi / 2 + (robot.heading or 0) * FULL_TURN / 8
    behind_left = np.round(np.mod(left - np.arctan2(dy, dx), FULL_TURN), ANGLE_DIGITS)
    behind_left[behind_left >= round(FULL_TURN, ANGLE_DIGITS)] = 0.0
    return cells[np.lexsort((cells, -np.hypot(dx, dy), behind_left))]


def _region(view: FrontierView, robot: Explorer) -> Ints:
    """Return the cells (n,) that a robot sees where it is."""
    sight = Sight(view.grid.cells, view.grid.opaque_codes())
    return sight.visible(robot.cell, robot.kind.sensor_range_m / view.grid.resolution_m)
