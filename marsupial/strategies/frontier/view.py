"""What a strategy of frontiers sees when it decides: the map, its frontiers, the robots and their ways."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np

from marsupial.arrays import Floats, Ints
from marsupial.maps.reach import groups
from marsupial.maps.targets import Frontier, cell_at
from marsupial.model.grid import Cell, Grid, Mask
from marsupial.model.robots import RobotType
from marsupial.paths.kernels import TOLERANCE
from marsupial.paths.routes import STEPS

TRAIL = 4
"""How many cells a trail has at most."""

SHORTEST_DETOUR = 2.0
"""Length in cells of the shortest way to a neighbouring cell that is more than one step."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Explorer:
    """A robot that is sent to frontiers.

    Parameters
    ----------
    cell
        Where it is; while it drives the next cell it passes.
    heading
        Step digit of its last move (`marsupial.paths.routes`), None before the first.
    goal
        The frontier cell (row-major index) that it is on its way to, or None.
    trail
        The last cells where it was at a decision, the present one at the end; four at most.
    """

    name: str
    kind: RobotType
    cell: Cell
    heading: int | None
    goal: int | None
    trail: tuple[Cell, ...] = ()

    @property
    def oscillates(self) -> bool:
        """Whether it has gone to and fro between two cells."""
        return len(self.trail) == TRAIL and self.trail[:2] == self.trail[2:] and self.trail[0] != self.trail[1]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class FrontierView:
    """The moment of a decision; cells are row-major indices (y * width + x).

    Parameters
    ----------
    grid
        The known map.
    robots
        Those that are not lost, in the order of the team.
    frontiers
        What each robot type can explore, by its name.
    standable
        Where each robot type can stand (height, width), by its name.
    lengths
        Gives the lengths (n,) in cells of a robot's shortest ways to n cells, inf where there is none.
    rng
        For whatever is drawn by chance; the same in each mission with the same starts.
    """

    grid: Grid
    robots: tuple[Explorer, ...]
    frontiers: Mapping[str, Frontier]
    standable: Mapping[str, Mask]
    lengths: Callable[[Explorer, Ints], Floats]
    rng: np.random.Generator

    def frontier(self, robot: Explorer) -> Frontier:
        """Return what a robot can explore."""
        return self.frontiers[robot.kind.name]

    def cell(self, index: int) -> Cell:
        """Return the cell of an index."""
        return cell_at(index, self.grid.width)

    def groups(self, robot: Explorer) -> list[Ints]:
        """Return the frontiers as a whole: the groups of frontier cells that touch, corners included."""
        return groups(self.frontier(robot).cells, self.grid.cells.shape)

    def ways(self, robot: Explorer) -> Floats:
        """Return the lengths (n,) of a robot's ways to where it can see behind each of its frontier cells."""
        return self.lengths(robot, self.frontier(robot).viewpoints)

    def closest(self, robot: Explorer, ways: Floats) -> int | None:
        """Return the frontier cell of the shortest of a robot's `ways` (n,); None where it can get to none."""
        return int(self.frontier(robot).cells[np.argmin(ways)]) if np.isfinite(ways).any() else None

    def around(self, robot: Explorer) -> Ints:
        """Return the neighbours of a robot's cell, at most eight, to which it is one step."""
        x, y = robot.cell
        width, height = self.grid.width, self.grid.height
        sides = [(x + dx, y + dy) for dx, dy in STEPS if 0 <= x + dx < width and 0 <= y + dy < height]
        cells = np.array([v * width + u for u, v in sides], dtype=np.int64)
        return cells[self.lengths(robot, cells) < SHORTEST_DETOUR]

    def step_towards(self, robot: Explorer, place: Cell, before: Cell | None = None) -> Cell:
        """Return the next cell of a shortest way to another one: `before` if it is one, otherwise one by lot."""
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
