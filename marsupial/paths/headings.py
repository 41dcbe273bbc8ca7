"""Headings of robots, and counts of their stops and turns.

A heading is a step digit (`marsupial.paths.routes`). To change direction a robot stops and turns on the spot, by 45 to
180 degrees; one that stood still also starts from a stop. A robot that has not driven yet, or was carried, has no
heading: its first step needs no turn.

References
----------
Mei, Lu, Lee and Hu, Energy-Efficient Mobile Robot Exploration, ICRA 2006, sections III-B and IV-C.
"""

from __future__ import annotations

from dataclasses import dataclass, field

from marsupial.model import Cell, Manoeuvres
from marsupial.paths.routes import heading_of


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
