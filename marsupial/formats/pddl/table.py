"""The facts of a PDDL problem, with their lines: `marsupial.formats.pddl.read` fills the table.

If facts contradict each other, `marsupial.formats.pddl.assemble` notes it at their lines.
"""

from collections import defaultdict
from collections.abc import Mapping
from dataclasses import dataclass, field
from fractions import Fraction

from marsupial.errors import SituationError
from marsupial.formats.pddl.domain import PLAIN
from marsupial.formats.pddl.names import decode_name, decode_type, encode_name, encode_type
from marsupial.formats.pddl.sexpr import at_line
from marsupial.model.bounds import BOUNDS, Bound

FactKey = tuple[str, ...]  # a predicate or function with its arguments


@dataclass(slots=True)
class FactTable:
    """Objects with their types, facts, numbers and goals, each with its line."""

    domain: str = PLAIN
    kinds: dict[str, str] = field(default_factory=dict)
    lines: dict[str, int] = field(default_factory=dict)
    facts: dict[FactKey, int] = field(default_factory=dict)
    values: dict[FactKey, tuple[Fraction, int]] = field(default_factory=dict)
    goals: dict[FactKey, int] = field(default_factory=dict)
    goal_line: int = 1
    problems: list[tuple[int, str]] = field(default_factory=list)

    def wrong(self, line: int, message: str) -> None:
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

    def firsts(self, name: str) -> Mapping[str, set[str]]:
        """Return the first arguments of a predicate's facts by their second argument; none for others."""
        found: defaultdict[str, set[str]] = defaultdict(set)
        for key in self.facts:
            if key[0] == name:
                found[key[2]].add(key[1])
        return found

    def single(self, name: str, first: str) -> str | None:
        """Return the second argument of the predicate's only fact with that first argument, or None; note several."""
        found = self.args(name, first)
        if len(found) > 1:
            self.wrong(self.facts[name, first, found[1]], f"{first} has {found[0]} already: ({name} {first} ...)")
        return found[0] if found else None

    def line_of(self, key: FactKey) -> int:
        return self.values[key][1]

    def own(self) -> dict[str, str]:
        """Return the objects by the names under which they are written: odd ones by hand, such as `home`, differ."""
        types = {encode_type(decode_type(word)): word for word in self.of_kind("robot_type")}
        return types | {encode_name(decode_name(word)): word for word in self.kinds if word not in types.values()}

    def ms(self, key: FactKey) -> int | None:
        """Return a time in ms, or None if it is not given."""
        return self._whole(key, 1000, BOUNDS["duration_ms"], "seconds with at most three decimals")

    def count(self, key: FactKey) -> int | None:
        """Return a whole number, or None if it is not given."""
        return self._whole(key, 1, BOUNDS["capacity"], "a whole number")

    def number(self, key: FactKey) -> float | None:
        """Return a number, or None if it is not given."""
        return float(self.values[key][0]) if key in self.values else None

    def _whole(self, key: FactKey, scale: int, bound: Bound, wanted: str) -> int | None:
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
