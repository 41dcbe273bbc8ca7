"""Frontier rules: their protocol, their input, their parameters, and the base of rules by bids.

Bidders take the frontier cell with the highest bid one after the other, in the order of the team, on the same map, and
bid again at every cell they reach. Of equal bids that for the first cell wins, row by row. As bids may change with
every step, a robot may oscillate between two cells: the strategy then sends it to a random neighbouring cell.
"""

import math
from abc import abstractmethod
from collections.abc import Callable, Mapping
from dataclasses import dataclass, fields, replace
from typing import ClassVar, Protocol, TypeVar

import numpy as np

from marsupial.arrays import Flags, Floats, Ints
from marsupial.errors import UsageError
from marsupial.maps.reach import groups
from marsupial.maps.targets import Frontier, cell_at
from marsupial.model import Cell, Grid, Mask, RobotType
from marsupial.paths.kernels import TOLERANCE
from marsupial.paths.routes import STEPS

EQUAL = 1e-9  # greatest difference of equal bids
TRAIL = 4  # most cells of a trail
SHORTEST_DETOUR = 2.0  # length in cells of the shortest route to a neighbouring cell that is blocked from here


@dataclass(frozen=True, slots=True, kw_only=True)
class Explorer:
    """A robot that explores frontiers."""

    name: str
    kind: RobotType
    cell: Cell  # its cell; while it drives, the next cell that it passes
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
        """Return the frontier cell of the shortest of a robot's `ways` (n,); None if all are unreachable."""
        return int(self.frontier(robot).cells[np.argmin(ways)]) if np.isfinite(ways).any() else None

    def around(self, robot: Explorer) -> Ints:
        """Return the neighbours of a robot's cell, at most eight, that it reaches in one step."""
        x, y = robot.cell
        width, height = self.grid.width, self.grid.height
        sides = [(x + dx, y + dy) for dx, dy in STEPS if 0 <= x + dx < width and 0 <= y + dy < height]
        cells = np.array([v * width + u for u, v in sides], dtype=np.int64)
        return cells[self.lengths(robot, cells) < SHORTEST_DETOUR]

    def step_towards(self, robot: Explorer, place: Cell, before: Cell | None = None) -> Cell:
        """Return the next cell of a shortest route to `place`: `before` if such a cell, otherwise a random one."""
        if place == robot.cell:
            return place
        cells = self.around(robot)
        ways = self.lengths(robot, cells) + self.lengths(replace(robot, cell=place), cells)
        shortest = cells[ways <= ways.min() + TOLERANCE]
        if before is not None and before.y * self.grid.width + before.x in shortest:
            return before
        return self.cell(int(self.rng.choice(shortest)))

    def priorities(self, cells: Ints) -> Floats:
        """Return how much more each of n cells is worth than others (n,)."""
        weights = None if self.grid.zoning is None else self.grid.zoning.weights
        return np.ones(len(cells)) if weights is None else weights.ravel()[cells]

    def xy(self, cells: Ints) -> tuple[Ints, Ints]:
        """Return columns and rows of cells."""
        return cells % self.grid.width, cells // self.grid.width


class FrontierRule(Protocol):
    """Chooses a frontier cell for each robot. Its dataclass fields are the parameters of the paper."""

    name: ClassVar[str]
    # whether it is asked at each cell that a robot reaches; if not, whenever a robot has arrived
    each_step: ClassVar[bool] = True
    # whether it is asked as soon as any robot has seen the cells behind a frontier cell that a robot drives to
    gives_up: ClassVar[bool] = True
    most_robots: ClassVar[int | None] = None  # None for any number

    def choose(self, view: FrontierView) -> Mapping[str, int]:
        """Return a frontier cell (row-major) for robots by name, or one beside them; the others keep their goals."""


P = TypeVar("P")


def with_parameters(rule: type[P], name: str) -> P:
    """Return the rule with the values after its name, as in ``bidding/W_n=1``, and the paper's values for all others.

    Raises
    ------
    UsageError
        If a value is not a finite number of 0 or more, or the rule has no such parameter.
    """
    known = [each.name for each in fields(rule) if each.init]  # type: ignore[arg-type]
    values: dict[str, float] = {}
    base, *parts = name.split("/")
    for part in parts:
        key, _, number = part.partition("=")
        if key not in known or key in values:
            takes = f"the parameters {', '.join(known)}, once each" if known else "no parameters"
            raise UsageError(f"strategy {base}: takes {takes}, got {part!r}")
        try:
            values[key] = float(number)
        except ValueError:
            values[key] = math.nan
        if not 0 <= values[key] < math.inf:
            raise UsageError(f"strategy {base}: {key}: must be a number, 0 or more, got {number!r}")
    return rule(**values)


@dataclass(frozen=True, slots=True, kw_only=True)
class Bidders(FrontierRule):
    """Base of the rules by bids: robots bid one after the other."""

    def choose(self, view: FrontierView) -> Mapping[str, int]:
        goals = {robot.name: robot.goal for robot in view.robots}
        for robot in view.robots:
            others = [other for other in view.robots if other is not robot]
            aims = [goal for other in others if (goal := goals[other.name]) is not None]
            ways = view.ways(robot)
            bids = self.bids(view, robot, ways, others, aims)
            bids[~np.isfinite(ways)] = -np.inf
            if robot.oscillates:
                near = view.around(robot)
                goals[robot.name] = int(view.rng.choice(near)) if len(near) else None
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
        """Return the bids (n,) of a robot for its frontier cells, at `ways` cells; `aims` are the others' goals."""


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
