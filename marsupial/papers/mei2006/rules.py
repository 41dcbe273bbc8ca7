"""Two rules for a single robot: by orientation, what is to the left first so that nothing is left behind; and the
widest frontier.

Both consider the frontier cells of the sensing region, those in line of sight within sensor range; if there are none,
the closest one outside. The robot senses at every cell, and chooses again as soon as its goal is no longer a frontier
cell, which happens long before it arrives.

References: Mei, Lu, Lee and Hu: Energy-Efficient Mobile Robot Exploration, ICRA 2006, sections IV-B and V-C.
"""

from abc import abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise
from typing import ClassVar

import numpy as np

from marsupial.arrays import Ints
from marsupial.maps.reach import groups, middle
from marsupial.maps.sight import Sight
from marsupial.strategies.frontier.rule import Explorer, FrontierRule, FrontierView

FULL_TURN = 2 * np.pi
ANGLE_DIGITS = 9  # decimals to which equal angles agree


@dataclass(frozen=True, slots=True, kw_only=True)
class _SensingRule(FrontierRule):
    """Base of both rules: go to a frontier cell of the sensing region, else to the closest one outside."""

    most_robots: ClassVar[int | None] = 1

    def choose(self, view: FrontierView) -> Mapping[str, int]:
        chosen: dict[str, int] = {}
        for robot in view.robots:
            if robot.goal is not None:
                continue
            ways = view.ways(robot)
            closest = view.closest(robot, ways)
            if closest is None:
                continue
            reached = view.frontier(robot).cells[np.isfinite(ways)]
            sight = Sight(view.grid.cells, view.grid.opaque_codes())
            region = sight.visible(robot.cell, robot.kind.sensor_range_m / view.grid.resolution_m)
            near = reached[np.isin(reached, region)]
            chosen[robot.name] = self.pick(view, robot, near) if near.size else closest
        return chosen

    @abstractmethod
    def pick(self, view: FrontierView, robot: Explorer, cells: Ints) -> int:
        """Choose one of the frontier cells of the sensing region, of which there is at least one."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Orientation(_SensingRule):
    """Section IV-B: frontier cells in clockwise order from the robot's left.

    The robot goes as far along the list as cells are neighbours and less than a share of the sensor range d_s away from
    the first: so it sees the area to its left without following walls closely.
    """

    name: ClassVar[str] = "orientation"

    share: float = 0.7  # share of d_s

    def pick(self, view: FrontierView, robot: Explorer, cells: Ints) -> int:
        listed = clockwise(view, robot, cells)
        x, y = view.xy(listed)
        limit = self.share * robot.kind.sensor_range_m / view.grid.resolution_m
        last = 0
        for k, follower in pairwise(range(len(listed))):
            # a gap in the list means that a wall or another frontier lies between
            jump = max(abs(x[follower] - x[k]), abs(y[follower] - y[k])) > 1
            if jump or np.hypot(x[follower] - x[0], y[follower] - y[0]) >= limit:
                break
            last = follower
        return int(listed[last])


@dataclass(frozen=True, slots=True, kw_only=True)
class WidestFrontier(_SensingRule):
    """Section V-C: the middle of the frontier (group of touching cells) with the most cells."""

    name: ClassVar[str] = "widest-frontier"

    def pick(self, view: FrontierView, robot: Explorer, cells: Ints) -> int:
        widest = max(groups(cells, view.grid.cells.shape), key=len)
        return int(middle(widest, view.grid.width))


def clockwise(view: FrontierView, robot: Explorer, cells: Ints) -> Ints:
    """Return cells clockwise from a robot's left (at first it faces along x), the farthest first in each direction."""
    x, y = view.xy(cells)
    dx, dy = x - robot.cell.x, y - robot.cell.y
    left = np.pi / 2 + (robot.heading or 0) * FULL_TURN / 8
    # rounded, so that cells in one direction have equal angles; 360 degrees wrap to 0 afterwards
    behind_left = np.round(np.mod(left - np.arctan2(dy, dx), FULL_TURN), ANGLE_DIGITS)
    behind_left[behind_left >= round(FULL_TURN, ANGLE_DIGITS)] = 0.0
    return cells[np.lexsort((cells, -np.hypot(dx, dy), behind_left))]
