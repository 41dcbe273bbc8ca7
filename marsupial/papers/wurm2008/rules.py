"""Two rules: each robot gets its own segment of the map (a room, corridor or part of one), or the closest frontier.

Segments with something left to explore are assigned to robots by the Hungarian method, at the cost of the route to
their nearest frontier. A robot's own segment costs less, so that robots finish what they began. Robots in the same
segment share its frontiers in the same way. A frontier is a group of touching frontier cells.

The closest frontier is the baseline. Its distance is that of its nearest cell. Robots without a frontier choose one
after the other, in the order of the team; once every frontier has a robot they choose among all.

References: Wurm, Stachniss, Burgard, IROS 2008, sections III, V and VI-A, Algorithm 1, Eq. 4. In their simulations the
segmentation was given; ours is computed from the known map, as in section IV and on their robots.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from marsupial.arrays import Floats, Ints
from marsupial.maps.reach import groups
from marsupial.papers.wurm2008.segmentation import segment
from marsupial.planning.matching import least_assignment
from marsupial.strategies.frontier.rule import FrontierRule, FrontierView


@dataclass(frozen=True, slots=True, kw_only=True)
class Segments(FrontierRule):
    """Algorithm 1."""

    name: ClassVar[str] = "segmentation"
    each_step: ClassVar[bool] = False

    discount: float = 0.5  # factor on the cost of a robot's own segment, a constant that the paper does not give

    def choose(self, view: FrontierView) -> Mapping[str, int]:
        cells = np.unique(np.concatenate([frontier.cells for frontier in view.frontiers.values()]))
        ways = _ways(view, cells)
        terrains = frozenset[int]().union(*(robot.kind.terrains for robot in view.robots))
        labels = segment(view.grid, terrains, cells).labels.ravel()
        costs, segments = _cheapest(ways, labels[cells])
        here = np.array([labels[robot.cell.y * view.grid.width + robot.cell.x] for robot in view.robots])
        costs[here[:, None] == segments] *= self.discount
        assigned = assignment(costs)
        chosen: dict[str, int] = {}
        for k, label in enumerate(segments.tolist()):
            members, inside = np.flatnonzero(assigned == k), labels[cells] == label
            goals = _share(ways[np.ix_(members, inside)], cells[inside], view.grid.cells.shape)
            chosen |= {view.robots[i].name: goal for i, goal in zip(members.tolist(), goals, strict=True)}
        return chosen


@dataclass(frozen=True, slots=True, kw_only=True)
class ClosestFrontier(FrontierRule):
    """Assigns the closest frontier without a robot."""

    name: ClassVar[str] = "closest-frontier"
    each_step: ClassVar[bool] = False

    def choose(self, view: FrontierView) -> Mapping[str, int]:
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


def assignment(costs: Floats) -> Ints:
    """Return the column assigned to each row of costs, of which inf forbids; -1 for rows with no finite cost left.

    If there are more rows than columns, columns are duplicated, so that they are used equally often among finite
    costs. The sum of the costs is minimal under these conditions.
    """
    rows, columns = costs.shape
    if not costs.size:
        return np.full(rows, -1, dtype=np.int64)
    finite = np.isfinite(costs)
    # more than any two assignments of finite costs differ by: a copy of a column is used only if nothing else is left
    more = 1.0 + rows * costs[finite].max(initial=0.0)
    copies = -(-rows // columns)
    layered = np.concatenate([costs + more * copy for copy in range(copies)], axis=1)
    # the solver needs finite costs: one that is forbidden costs more than the last copy and all changes elsewhere
    layered[~np.isfinite(layered)] = more * copies
    found = least_assignment(layered)[1] % columns
    return np.where(finite[np.arange(rows), found], found, -1).astype(np.int64)


def _ways(view: FrontierView, cells: Ints) -> Floats:
    """Return the lengths (robots, n) of the routes to the cells' viewpoints, inf for unreachable ones."""
    lengths = np.full((len(view.robots), len(cells)), np.inf)
    for i, robot in enumerate(view.robots):
        lengths[i, np.searchsorted(cells, view.frontier(robot).cells)] = view.ways(robot)
    return lengths


def _cheapest(ways: Floats, of: Ints) -> tuple[Floats, Ints]:
    """Return the lengths (robots, k) of the shortest ways to cells of k classes, and the classes, ascending."""
    classes, place = np.unique(of, return_inverse=True)
    shortest = np.full((len(ways), len(classes)), np.inf)
    for row, lengths in zip(shortest, ways, strict=True):
        np.minimum.at(row, place, lengths)
    return shortest, classes


def _share(ways: Floats, cells: Ints, shape: tuple[int, int]) -> list[int]:
    """Return the goal of each robot (row of `ways`) in a segment: the nearest cell of the frontier assigned to it."""
    frontier = np.empty(len(cells), dtype=np.int64)
    for k, group in enumerate(groups(cells, shape)):
        frontier[np.searchsorted(cells, group)] = k
    costs, _ = _cheapest(ways, frontier)
    found = assignment(costs)
    return [int(cells[np.argmin(np.where(frontier == k, way, np.inf))]) for way, k in zip(ways, found, strict=True)]
