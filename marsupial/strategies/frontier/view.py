"""The input of a frontier rule: the known map, its frontiers, the robots and their routes."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np

from marsupial.arrays import Floats, Ints
from marsupial.maps.reach import groups
from marsupial.maps.targets import Frontier, cell_at
from marsupial.model import Cell, Grid, Mask, RobotType
from marsupial.paths.kernels import TOLERANCE
from marsupial.paths.routes import STEPS

TRAIL = 4  # most cells of a trail
SHORTEST_DETOUR = 2.0  # length in cells of the shortest route to a neighbouring cell that is blocked from here


@dataclass(frozen=True, slots=True, kw_only=True)
class Explorer:
    """A robot that explores frontiers."""

    name: str
    kind: RobotType
    cell: Cell  # its cell; while it drives the next one it passes
    heading: int | None  # step digit of its last move (`marsupial.paths.routes`), None before the first
    goal: int | None  # the frontier cell (row-major index) that it drives to, or None
    trail: tuple[Cell, ...] = ()  # its cells at the last decisions, at most `TRAIL`, the present one at the end

    @property
    def oscillates(self) -> bool:
        """Whether it has been moving to and fro between two cells."""
        return len(self.trail) == TRAIL and self.trail[:2] == self.trail[2:] and self.trail[0] != self.trail[1]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class FrontierView:
    """The moment of a decision; cells are row-major indices (y * width + x)."""

    grid: Grid
    robots: tuple[Explorer, ...]  # those that are not lost, in the order of the team
    frontiers: Mapping[str, Frontier]  # what each robot type can explore, by its name
    standable: Mapping[str, Mask]  # where each robot type may stand (height, width), by its name
    # returns the lengths (n,) in cells of a robot's routes to n cells, inf for none
    lengths: Callable[[Explorer, Ints], Floats]
    rng: np.random.Generator  # the same numbers in each mission with the same starts

    def frontier(self, robot: Explorer) -> Frontier:
        """Return what a robot can explore."""
        return self.frontiers[robot.kind.name]

    def cell(self, index: int) -> Cell:
        """Return the cell of an index."""
        return cell_at(index, self.grid.width)

    def groups(self, robot: Explorer) -> list[Ints]:
        """Return whole frontiers: the groups of touching frontier cells, corners included."""
        return groups(self.frontier(robot).cells, self.grid.cells.shape)

    def ways(self, robot: Explorer) -> Floats:
        """Return the lengths (n,) of a robot's routes to the viewpoints of its frontier cells."""
        return self.lengths(robot, self.frontier(robot).viewpoints)

    def closest(self, robot: Explorer, ways: Floats) -> int | None:
        """Return the frontier cell of the shortest of a robot's `ways` (n,); None if it can reach none."""
        return int(self.frontier(robot).cells[np.argmin(ways)]) if np.isfinite(ways).any() else None

    def around(self, robot: Explorer) -> Ints:
        """Return the neighbours of a robot's cell, at most eight, that it reaches in one step."""
        x, y = robot.cell
        width, height = self.grid.width, self.grid.height
        sides = [(x + dx, y + dy) for dx, dy in STEPS if 0 <= x + dx < width and 0 <= y + dy < height]
        cells = np.array([v * width + u for u, v in sides], dtype=np.int64)
        return cells[self.lengths(robot, cells) < SHORTEST_DETOUR]

    def step_towards(self, robot: Explorer, place: Cell, before: Cell | None = None) -> Cell:
        """Return the next cell of a shortest route to `place`: `before` if it is one, otherwise a random one."""
        if place == robot.cell:
            return place
        cells = self.around(robot)
        ways = self.lengths(robot, cells) + self.lengths(replace(robot, cell=place), cells)
        shortest = cells[ways <= ways.min() + TOLERANCE]
        if before is not None and before.y * self.grid.width + before.x in shortest:
            return before
        return self.cell(int(self.rng.choice(shortest)))

    def xy(self, cells: Ints) -> tuple[Ints, Ints]:
        """Return columns and rows of cells."""
        return cells % self.grid.width, cells // self.grid.width
