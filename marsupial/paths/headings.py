"""Which way a robot faces, and how often it stops and turns on its way.

A heading is the digit of a step (`marsupial.paths.routes`). To go on in another direction a robot stops and turns on
the spot, by 45 to 180 degrees; one that has stood still starts from a stop as well. A robot that has not driven yet,
or was carried, faces no way in particular: its first step is free.

References
----------
Mei, Lu, Lee and Hu, Energy-Efficient Mobile Robot Exploration, ICRA 2006, sections III-B and IV-C.
"""

from __future__ import annotations

from dataclasses import dataclass, field

from marsupial.model.grid import Cell
from marsupial.model.world import Manoeuvres
from marsupial.paths.routes import STEPS

_HEADINGS = {step: digit for digit, step in enumerate(STEPS)}


def heading_of(start: Cell, end: Cell) -> int:
    """Return the digit of the step between two neighbouring cells."""
    return _HEADINGS[end.x - start.x, end.y - start.y]


def turn_between(before: int, after: int) -> int:
    """Return the least turn from one heading to another, in units of 45 degrees: 0 to 4."""
    turn = abs(before - after)
    return min(turn, 8 - turn)


@dataclass(slots=True)
class Odometer:
    """Counts the stops and turns of one robot as it drives.

    Attributes
    ----------
    heading
        Digit of the last step, or of the one under way; None where it faces no way in particular.
    """

    heading: int | None = None
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
        """Take in that a drive begins."""
        self._stood = t_ms > self._arrived_ms

    def step(self, start: Cell, end: Cell) -> None:
        """Take in that a step begins."""
        before, self.heading = self.heading, heading_of(start, end)
        if before is not None:
            turn = turn_between(before, self.heading)
            if turn:
                self._turns[turn - 1] += 1
            self._stops += bool(turn) or self._stood
        self._stood = False

    def arrive(self, t_ms: int) -> None:
        """Take in that a drive has ended."""
        self._arrived_ms = t_ms

    def lift(self) -> None:
        """Take in that the robot is carried from now on."""
        self.heading = None
