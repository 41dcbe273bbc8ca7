"""Each robot to the closest frontier that no other robot has yet.

A frontier is a group of frontier cells that touch, and as close as the nearest of its cells. Robots that have none
choose one after the other, in the order of the team; once every frontier has a robot they choose among all.

References
----------
Wurm, Stachniss, Burgard: Coordinated Multi-Robot Exploration using a Segmentation of the Environment, IROS 2008,
section VI-A: what the segmentation is compared with.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from marsupial.strategies.frontier.view import FrontierView


@dataclass(frozen=True, slots=True, kw_only=True)
class ClosestFrontier:
    """The closest frontier without a robot."""

    name: ClassVar[str] = "closest-frontier"
    each_step: ClassVar[bool] = False
    gives_up: ClassVar[bool] = True
    most_robots: ClassVar[int | None] = None

    def choose(self, view: FrontierView) -> Mapping[str, int]:
        """Return the nearest cell of the frontier for each robot that has none and can get to one."""
        taken = {robot.goal for robot in view.robots if robot.goal is not None}
        chosen: dict[str, int] = {}
        for robot in view.robots:
            if robot.goal is not None:
                continue
            cells, ways = view.frontier(robot).cells, view.ways(robot)
            free = np.array(ways)
            for group in view.groups(robot):
                if not taken.isdisjoint(group.tolist()):
                    free[np.searchsorted(cells, group)] = np.inf
            best = view.closest(robot, free)
            best = view.closest(robot, ways) if best is None else best
            if best is not None:
                chosen[robot.name] = best
                taken.add(best)
        return chosen
