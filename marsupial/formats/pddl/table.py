"""The objects, facts, numbers and goals of a PDDL problem by name, with their lines, and all problems found.

`marsupial.formats.pddl.read` fills the table, `marsupial.formats.pddl.assemble` reads it; both note problems in it.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from fractions import Fraction

from marsupial.errors import SituationError
from marsupial.formats.pddl.sexpr import at_line
from marsupial.model.bounds import BOUNDS, Bound

Key = tuple[str, ...]
"""A predicate or function with its arguments."""


@dataclass(slots=True)
class FactTable:
    """Objects with their types, facts, numbers and goals, each with its line."""

    kinds: dict[str, str] = field(default_factory=dict)
    lines: dict[str, int] = field(default_factory=dict)
    facts: dict[Key, int] = field(default_factory=dict)
    values: dict[Key, tuple[Fraction, int]] = field(default_factory=dict)
    goals: dict[Key, int] = field(default_factory=dict)
    goal_line: int = 1
    problems: list[tuple[int, str]] = field(default_factory=list)

    def wrong(self, line: int, message: str) -> None:
        """Note a problem."""
        self.problems.append((line, message))

    def check(self) -> None:
        """Raise `SituationError` with all problems noted, by line."""
        if self.problems:
            raise SituationError([at_line(line, message) for line, message in sorted(self.problems)])

    def of_kind(self, *kinds: str) -> tuple[str, ...]:
        """Return the objects of these types, in order."""
        return tuple(name for name, kind in self.kinds.items() if kind in kinds)

    def args(self, name: str, first: str) -> list[str]:
        """Return the second arguments of a predicate's facts whose first argument is `first`."""
        return [key[2] for key in self.facts if key[0] == name and key[1] == first]

    def single(self, name: str, first: str) -> str | None:
        """Return the second argument of the predicate's only fact with that first argument, or None; note several."""
        found = self.args(name, first)
        if len(found) > 1:
            self.wrong(self.facts[name, first, found[1]], f"{first} has {found[0]} already: ({name} {first} ...)")
        return found[0] if found else None

    def line_of(self, key: Key) -> int:
        """Return the line of a number."""
        return self.values[key][1]

    def ms(self, key: Key) -> int | None:
        """Return a time in ms, or None if it is not given."""
        return self._whole(key, 1000, BOUNDS["duration_ms"], "seconds with at most three decimals")

    def count(self, key: Key) -> int | None:
        """Return a whole number, or None if it is not given."""
        return self._whole(key, 1, BOUNDS["capacity"], "a whole number")

    def _whole(self, key: Key, scale: int, bound: Bound, wanted: str) -> int | None:
        if key not in self.values:
            return None
        value, line = self.values[key]
        if value < 0 or (value * scale).denominator != 1:
            self.wrong(line, f"({' '.join(key)}) must be {wanted}, 0 or more, got {float(value):g}")
            return None
        if value * scale > bound.most:
            self.wrong(line, f"({' '.join(key)}) must be at most {bound.most / scale:g}, got {float(value):g}")
            return None
        return int(value * scale)
