"""Routes of least energy: distance, stops and turns over passable cells.

To change direction a robot stops and turns on the spot, and both take energy, so the cheapest route may be longer but
straighter than the shortest. The search is over states: a cell and one of 8 headings. Steps are those of
`marsupial.paths.fields`; among routes of equal energy, the search returns the shortest.

References
----------
Mei, Lu, Lee and Hu, Energy-Efficient Mobile Robot Exploration, ICRA 2006, sections IV-C and V-A.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from marsupial.arrays import Cells, Floats, Ints
from marsupial.errors import UsageError
from marsupial.model import SQRT2, Cell, Mask, RobotType
from marsupial.paths import energy_kernels as kernels
from marsupial.paths.framed import NOWHERE, FramedGrid
from marsupial.paths.routes import Route, heading_of, route_length, route_of, turn_between

_FREE = -1  # heading of a search whose first step needs no turn


@dataclass(frozen=True, slots=True, kw_only=True)
class MotionCosts:
    """The energy of driving; the defaults are those of the paper, in its unit: that of driving one unit of distance."""

    distance: float = 1.0  # energy per unit of distance, the side of a cell
    stop: float = 0.5  # extra energy of a stop; each change of direction takes one
    turn: tuple[float, float, float, float] = (0.4, 0.6, 0.8, 1.0)  # energy of a turn of 45, 90, 135 and 180 degrees

    def __post_init__(self) -> None:
        if not 0 < self.distance < math.inf:
            raise UsageError(f"a distance must take energy for routes to save some, got {self.distance}")
        if not all(0 <= energy < math.inf for energy in (self.stop, *self.turn)):
            raise UsageError(f"stops and turns must take an energy of 0 or more, got {self.stop} and {self.turn}")

    def changing(self, turn: int) -> float:
        """Return the energy of a stop and a turn by `turn` (0 to 4) times 45 degrees; 0 for driving straight on."""
        return self.stop + self.turn[turn - 1] if turn else 0.0


def costs_of(kind: RobotType, resolution_m: float) -> MotionCosts:
    """Return the energy a robot type needs in J: per cell, stop and turn; UsageError if driving uses none."""
    energy = kind.energy
    return MotionCosts(distance=kind.driving_j * resolution_m, stop=energy.stop_j, turn=energy.turn_j)


def route_energy(
    route: Sequence[Cell], costs: MotionCosts, heading: int | None = None, diagonal: float = SQRT2
) -> float:
    """Return the energy of driving a route with an initial heading; None if the first step needs no turn."""
    headings = [heading_of(a, b) for a, b in pairwise(route)]
    before = headings if heading is None else [heading, *headings]
    turns = [turn_between(a, b) for a, b in pairwise(before)]
    return costs.distance * route_length(route, diagonal) + math.fsum(map(costs.changing, turns))


class EnergySearch:
    """Searches on one mask (height, width), which is referenced and may change between calls, as `PathSearch` does.

    Searches reuse buffers, so reuse the instance. Not thread-safe. A heading is a step digit
    (`marsupial.paths.routes`); with None the first step needs no turn. `diagonal` is the length of a diagonal step, 1
    to sqrt 2. With `cuts_corners`, the rule of the paper, diagonal steps may pass impassable cells beside them.
    """

    def __init__(
        self, passable: Mask, costs: MotionCosts, *, diagonal: float = SQRT2, cuts_corners: bool = False
    ) -> None:
        self.passable = passable
        self.motion = costs
        self._diagonal = diagonal
        self._frame = FramedGrid(*passable.shape)
        turning = np.array([costs.changing(turn_between(0, turn)) for turn in range(8)]) / costs.distance
        size = self._frame.size
        # Most are never filled: only the pages that a search writes to use memory.
        self._work = kernels.EnergyBuffers(
            passable=np.zeros(size, dtype=np.uint8),
            cost=np.full(8 * size, np.inf),
            came=np.empty(8 * size, dtype=np.uint8),
            offsets=self._frame.offsets,
            queue=np.empty(kernels.BUCKETS * size, dtype=np.uint32),
            queued=np.zeros(size, dtype=np.uint8),
            touched=np.empty(size, dtype=np.uint32),
            ends=np.zeros(kernels.BUCKETS + 1, dtype=np.uint64),
            turning=turning,
            gain=_gain(turning),
            diagonal=diagonal,
            cuts_corners=cuts_corners,
        )

    def field(self, source: Cell, heading: int | None = None) -> Floats:
        """Return the least energy of driving to each cell (height, width), inf for none; exact to one part in 10^9."""
        self._search(source, None, heading)
        everywhere = np.arange(self._frame.size, dtype=np.uint32)
        return self._frame.inside(self.motion.distance * self._least(everywhere))

    def costs(self, source: Cell, wanted: Sequence[Cell] | Ints, heading: int | None = None) -> Floats:
        """Return the least energy of driving from `source` to each wanted cell; inf where there is no route."""
        counts, reached = self._walked(source, wanted, heading)
        changing = [self.motion.changing(turn) for turn in (1, 2, 3, 4)]
        weights = np.array([self.motion.distance, self.motion.distance * self._diagonal, *changing])
        return np.where(reached, counts @ weights, np.inf)

    def lengths(self, source: Cell, wanted: Sequence[Cell] | Ints, heading: int | None = None) -> Floats:
        counts, reached = self._walked(source, wanted, heading)
        return np.where(reached, counts[:, 0] + counts[:, 1] * self._diagonal, np.inf)

    def matrix(self, cells: Sequence[Cell], headings: Sequence[int | None] | None = None) -> Floats:
        headings = [None] * len(cells) if headings is None else headings
        table = np.full((len(cells), len(cells)), np.inf)
        free = [i for i, heading in enumerate(headings) if heading is None]
        for number, i in enumerate(free):
            rest = free[number:]  # without a heading, the route back is the reversed route
            table[i, rest] = table[rest, i] = self.lengths(cells[i], [cells[j] for j in rest])
        for i, heading in enumerate(headings):
            if heading is not None:
                table[free, i] = self.lengths(cells[i], [cells[j] for j in free])
                table[i] = self.lengths(cells[i], cells, heading)
        return table

    def route(self, start: Cell, goal: Cell, heading: int | None = None) -> Route | None:
        end = self._frame.indices([goal])
        self._search(start, end, heading)
        least = float(self._least(end)[0])
        if not math.isfinite(least):
            return None
        steps = np.empty(int(least) + 1, dtype=np.uint8)
        count = int(kernels.trace(self._work, np.uint64(end[0]), steps))
        return route_of(start, (steps[:count][::-1] + ord("0")).tobytes().decode("ascii"))

    def _search(self, source: Cell, wanted: Cells | None, heading: int | None) -> None:
        """Search from a cell until the wanted ones (None: all) are final."""
        self._frame.inside(self._work.passable)[:] = self.passable
        goals = start = self._frame.indices([source])
        goals = NOWHERE if wanted is None else np.append(start, wanted[self._work.passable[wanted] > 0])
        kernels.spread(self._work, np.uint64(start[0]), _FREE if heading is None else heading, goals)

    def _least(self, at: Cells) -> Floats:
        """Return the least energy of the last search for these framed cells, in straight steps."""
        energies = np.empty(at.size)
        kernels.least(self._work, at, energies)
        return energies

    def _walked(self, source: Cell, wanted: Sequence[Cell] | Ints, heading: int | None) -> tuple[Ints, Mask]:
        """Search; return the steps and turns of the routes (`kernels.tally`), and which wanted cells are reached."""
        at = self._frame.indices(wanted)
        self._search(source, at, heading)
        reached = np.isfinite(self._least(at))
        counts = np.zeros((at.size, 6), dtype=np.int64)
        found = counts[reached]
        kernels.tally(self._work, _FREE if heading is None else heading, at[reached], found)
        counts[reached] = found
        return counts, reached


def _gain(turning: Floats) -> float:
    """Return the most energy that two turns can save over one turn by their sum."""
    saved = [
        turning[(first + second) % 8] - turning[first] - turning[second] for first in range(8) for second in range(8)
    ]
    return max(0.0, *saved)
