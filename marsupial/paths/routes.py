"""Routes: sequences of cells, with their steps as digits, lengths and passing times.

A step is a digit, counter-clockwise from east: 0 is +x, 2 is +y, 4 is -x, 6 is -y, odd digits are diagonals. Lengths
are in cells. Times are snapped to a nanosecond before they are rounded to milliseconds, so the same steps summed in
another order give the same time.

A heading is a step digit as well. To change direction a robot stops and turns on the spot, by 45 to 180 degrees; a
robot that stood still also starts from a stop. A robot that has not driven yet, or was carried, has no heading: its
first step needs no turn.

References
----------
Mei, Lu, Lee and Hu, Energy-Efficient Mobile Robot Exploration, ICRA 2006, sections III-B and IV-C.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np
import numpy.typing as npt

from marsupial.model import SQRT2, UNREACHABLE, Cell, Manoeuvres

STEPS = ((1, 0), (1, 1), (0, 1), (-1, 1), (-1, 0), (-1, -1), (0, -1), (1, -1))  # (dx, dy) of each step digit

Route = tuple[Cell, ...]
Times = npt.NDArray[np.int64]
_DIGITS = {step: digit for digit, step in enumerate(STEPS)}
_SNAP_PER_MS = 1e6


def heading_of(start: Cell, end: Cell) -> int:
    """Return the digit of the step between two neighbouring cells."""
    return _DIGITS[end.x - start.x, end.y - start.y]


def steps_of(route: Sequence[Cell]) -> str:
    """Return the steps of `route` as digits; each cell must be a neighbour of the one before."""
    return "".join(str(heading_of(a, b)) for a, b in pairwise(route))


def route_of(start: Cell, steps: str) -> Route:
    """Return the cells passed from `start` along `steps`, `start` included."""
    cells = [start]
    x, y = start
    for digit in steps:
        dx, dy = STEPS[int(digit)]
        x, y = x + dx, y + dy
        cells.append(Cell(x, y))
    return tuple(cells)


def passed_cells(route: Sequence[Cell]) -> Iterator[Cell]:
    """Yield the cells after the first of a route, and those beside its diagonal steps: robots cut no corners."""
    for a, b in pairwise(route):
        yield b
        if a.x != b.x and a.y != b.y:
            yield Cell(a.x, b.y)
            yield Cell(b.x, a.y)


def route_length(route: Sequence[Cell], diagonal: float = SQRT2) -> float:
    """Return the length of `route` in cells, 0 for a single cell; `diagonal` is the length of a diagonal step."""
    return float(_lengths(route, diagonal)[-1])


def travel_table_ms(lengths: npt.NDArray[np.float64], resolution_m: float, speed_mps: float) -> Times:
    """Return the time in ms to drive each length at constant speed, int64, and `UNREACHABLE` where it is inf."""
    reached = np.isfinite(lengths)
    return np.where(reached, _times(np.where(reached, lengths, 0.0), resolution_m, speed_mps), UNREACHABLE)


def passing_times_ms(route: Sequence[Cell], resolution_m: float, speed_mps: float, diagonal: float = SQRT2) -> Times:
    """Return when the centre of each cell of `route` is passed, in ms after departure."""
    return _times(_lengths(route, diagonal), resolution_m, speed_mps)


def _lengths(route: Sequence[Cell], diagonal: float = SQRT2) -> npt.NDArray[np.float64]:
    # from counts of straight and diagonal steps: a running sum would add up rounding errors
    moved = np.abs(np.diff(np.array(route, dtype=np.int64), axis=0)).sum(axis=1)
    diagonals = np.concatenate(([0], np.cumsum(moved == 2)))
    return np.arange(len(route)) - diagonals + diagonals * diagonal


def _times(lengths: npt.NDArray[np.float64] | np.float64, resolution_m: float, speed_mps: float) -> Times:
    exact = lengths * resolution_m / speed_mps * 1000.0
    snapped = np.rint(exact * _SNAP_PER_MS) / _SNAP_PER_MS
    return np.floor(snapped + 0.5).astype(np.int64)


def turn_between(before: int, after: int) -> int:
    """Return the least turn from one heading to another, in units of 45 degrees: 0 to 4."""
    turn = abs(before - after)
    return min(turn, 8 - turn)


@dataclass(slots=True)
class Odometer:
    """Counts the stops and turns of one robot as it drives."""

    heading: int | None = None  # digit of the last or current step; None for no heading
    _stood: bool = False
    _arrived_ms: int = 0
    _stops: int = 0
    _turns: list[int] = field(default_factory=lambda: [0, 0, 0, 0])

    @property
    def manoeuvres(self) -> Manoeuvres:
        """The stops and turns so far."""
        by_45, by_90, by_135, by_180 = self._turns
        return Manoeuvres(stops=self._stops, turns=(by_45, by_90, by_135, by_180))

    def set_off(self, t_ms: int) -> None:
        """Note the start of a drive."""
        self._stood = t_ms > self._arrived_ms

    def step(self, start: Cell, end: Cell) -> None:
        """Count the stop and turn before a step."""
        before, self.heading = self.heading, heading_of(start, end)
        if before is not None:
            turn = turn_between(before, self.heading)
            if turn:
                self._turns[turn - 1] += 1
            self._stops += bool(turn) or self._stood
        self._stood = False

    def arrive(self, t_ms: int) -> None:
        """Note the end of a drive."""
        self._arrived_ms = t_ms

    def lift(self) -> None:
        """Forget the heading of a robot that is being carried."""
        self.heading = None
