"""Routes of least energy compared with shortest ones, as in Mei et al. 2006, section V-B.

Both are planned between many pairs of cells on a map with a fifth of its cells blocked at random. Shortest paths are
those of the textbook version of Dijkstra's algorithm: it keeps the first of equal paths, which need not be straight.
Robots move to any free neighbour, past corners too: "if both cells are free" (section IV-A). With the movement rule of
marsupial's robots, which cuts no corners, the same pairs save less and have longer routes.

References: Mei, Lu, Lee and Hu: Energy-Efficient Mobile Robot Exploration, ICRA 2006, sections IV-A and V-B.
"""

import heapq
from dataclasses import dataclass
from functools import cache

import numpy as np

from marsupial.arrays import Floats, Ints
from marsupial.model import SQRT2, Cell, Mask
from marsupial.native import native
from marsupial.paths.energy import EnergySearch, MotionCosts, route_energy
from marsupial.paths.routes import STEPS, Route, route_length

SIDE = 100  # side of the map in cells: areas of this size take as long to explore as the paper's

SHARE = 0.2
MAPS, ENDS = 24, 13
"""Random maps, and random sources and goals on each: all combinations are 4056 pairs, "more than 3800"."""

PRINTED_SAVED, PRINTED_LONGER = 0.084, 0.007


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class RoutePairs:
    """The shortest path and the route of least energy between pairs of cells."""

    shortest: Floats  # (n, 2): length and energy of the shortest path
    cheapest: Floats  # (n, 2): length and energy of the route of least energy

    @property
    def gains(self) -> tuple[float, float]:
        """Shares of energy saved and of extra length, by the means of the ratios."""
        length, energy = np.mean(self.cheapest / self.shortest, axis=0).tolist()
        return 1.0 - energy, length - 1.0

    @property
    def gains_in_all(self) -> tuple[float, float]:
        """The same by the sums over all pairs."""
        length, energy = (self.cheapest.sum(axis=0) / self.shortest.sum(axis=0)).tolist()
        return 1.0 - energy, length - 1.0


def blocked_at_random(side: int, share: float, seed: int) -> Mask:
    """Return the passable cells of a square map, each blocked with probability `share`."""
    return np.random.default_rng(seed).random((side, side)) >= share


def route_pairs(
    passable: Mask, ends: int, seed: int, *, costs: MotionCosts | None = None, cuts_corners: bool = True
) -> RoutePairs:
    """Plan both routes from each of `ends` random cells to each of as many others; omit pairs without a path."""
    motion = MotionCosts() if costs is None else costs
    sources, goals = _drawn(passable, ends, seed)
    width = passable.shape[1]
    search = EnergySearch(passable, motion, cuts_corners=cuts_corners)
    shortest: list[tuple[float, float]] = []
    cheapest: list[tuple[float, float]] = []
    for source in sources:
        before = shortest_paths(passable, source, cuts_corners=cuts_corners)
        energies, lengths = search.costs(source, goals), search.lengths(source, goals)
        for goal, energy, length in zip(goals, energies.tolist(), lengths.tolist(), strict=True):
            if before[goal.y * width + goal.x] >= 0:
                path = path_to(goal, before, width)
                shortest.append((route_length(path), route_energy(path, motion)))
                cheapest.append((length, energy))
    return RoutePairs(shortest=np.array(shortest).reshape(-1, 2), cheapest=np.array(cheapest).reshape(-1, 2))


@cache  # a report's table and its finding need the same pairs, which take long to compute
def path_table(*, cuts_corners: bool = True, maps: int = MAPS, ends: int = ENDS, side: int = SIDE) -> RoutePairs:
    """Return the pairs of maps with the seeds 1, 2, 3 and so on."""
    seeds = range(1, maps + 1)
    drawn = {seed: blocked_at_random(side, SHARE, seed) for seed in seeds}
    pairs = [route_pairs(drawn[seed], ends, seed, cuts_corners=cuts_corners) for seed in seeds]
    return RoutePairs(
        shortest=np.concatenate([one.shortest for one in pairs]),
        cheapest=np.concatenate([one.cheapest for one in pairs]),
    )


def shortest_paths(passable: Mask, source: Cell, *, cuts_corners: bool) -> Ints:
    """Return the cell before each cell on a shortest path from `source`, both row-major; `source` for itself.

    -1 stands for cells that no path reaches.
    """
    start = source.y * passable.shape[1] + source.x
    before: Ints = _before(passable, start, np.array(STEPS, dtype=np.int64), cuts_corners)
    return before


@native
def _before(passable: Mask, start: int, steps: Ints, cuts_corners: bool) -> Ints:
    height, width = passable.shape
    before, lengths = np.full(height * width, -1, dtype=np.int64), np.full(height * width, np.inf)
    settled = np.zeros(height * width, dtype=np.bool_)
    before[start], lengths[start] = start, 0.0
    queue = [(0.0, start)]
    while queue:
        length, cell = heapq.heappop(queue)
        if settled[cell]:
            continue
        settled[cell] = True
        y, x = cell // width, cell % width
        for dx, dy in steps:
            u, v = x + dx, y + dy
            if not (0 <= u < width and 0 <= v < height and passable[v, u]):
                continue
            if not (cuts_corners or (passable[y, u] and passable[v, x])):
                continue
            side, further = v * width + u, length + (SQRT2 if dx and dy else 1.0)
            if further < lengths[side]:
                lengths[side], before[side] = further, cell
                heapq.heappush(queue, (further, side))
    return before


def path_to(goal: Cell, before: Ints, width: int) -> Route:
    """Return the path of `shortest_paths` from its source to a cell."""
    path = [goal.y * width + goal.x]
    while (last := int(before[path[-1]])) != path[-1]:
        path.append(last)
    return tuple(Cell(cell % width, cell // width) for cell in reversed(path))


def _drawn(passable: Mask, ends: int, seed: int) -> tuple[list[Cell], list[Cell]]:
    y, x = np.nonzero(passable)
    chosen = np.random.default_rng(seed).choice(x.size, 2 * ends, replace=False).tolist()
    cells = [Cell(int(x[i]), int(y[i])) for i in chosen]
    return cells[:ends], cells[ends:]
