"""Read a tree of fields and report all its problems at once.

::

    fields = Fields(data, "", problems := [])
    speed = fields.quantity("speed_mps")        problem "speed_mps: must be positive, got -1"; returns 0.0
    name = fields.name("name")                  problem "name: missing";                       returns ""
    fields.finish()                             problem "colour: unknown field"
    if problems: raise ScenarioError(problems)

`Notes` collect problems by path. `Fields` are the notes on one mapping: each method reads one field, and notes a
problem or returns its value. With a problem it returns a placeholder of the right type, so that reading goes on; the
caller raises at the end if there are problems, so no placeholder is ever used.

A boolean is not a number, and a number must be finite.
"""

from __future__ import annotations

import math
import re
import reprlib
from collections.abc import Callable, Iterable, Iterator, Mapping
from typing import Any

from marsupial.errors import InputError, Problem
from marsupial.model.bounds import BOUNDS, LONGEST_NAME, MOST, Bound, bound_of
from marsupial.model.seats import Seats
from marsupial.wording import no_option, suggestion, unknown

_SHORT = reprlib.Repr()
_SHORT.maxstring = _SHORT.maxlong = 60

FINITE = Bound(-math.inf, math.inf)

_DECIMAL_COMMA = re.compile(r"([-+]?[0-9]+),([0-9]+(?:[eE][-+]?[0-9]+)?)\Z")
_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_-]*\Z")


class Notes:
    """The problems of one part, at `path`, of a file or request; all parts share the list `problems`."""

    def __init__(self, path: str = "", problems: list[Problem] | None = None) -> None:
        self.path = path
        self.problems: list[Problem] = [] if problems is None else problems

    def at(self, key: str) -> str:
        return f"{self.path}.{key}" if self.path and not key.startswith("[") else f"{self.path}{key}"

    def below(self, key: str) -> Notes:
        return Notes(self.at(key), self.problems)

    def wrong(self, key: str, message: str) -> None:
        """Note a problem with a field, or with the part itself where `key` is empty."""
        self.problems.append(Problem(self.at(key) if key else self.path, message))

    def take(self, error: InputError) -> None:
        """Note the problems of an error, whose paths are relative to this part."""
        for problem in error.problems:
            self.wrong(problem.path, problem.message)

    def check(self, error: type[InputError]) -> None:
        """Raise an error with all problems, if there are any."""
        if self.problems:
            raise error(self.problems)


class Fields(Notes):
    """The mapping `data` at `path` of a file, read field by field. A field without a default is required."""

    def __init__(self, data: Mapping[Any, Any], path: str, problems: list[Problem]) -> None:
        super().__init__(path, problems)
        self.data = data
        self._known: dict[str, None] = {}  # an ordered set: messages list the fields in the order they were read
        self._refused: set[str] = set()

    def has(self, key: str) -> bool:
        self._known[key] = None
        return key in self.data

    def number(self, key: str, default: float | None = None, bound: Bound = FINITE) -> float:
        """Read a finite number within the bound."""
        return float(self._take(key, default, 0.0, lambda value: number_fault(value) or bound.fault(value)))

    def integer(self, key: str, default: int | None = None, bound: Bound = FINITE) -> int:
        return int(self._take(key, default, 0, lambda v: _unless(is_whole(v), "an integer", v) or bound.fault(v)))

    def quantity(self, key: str, default: float | None = None) -> float:
        """Read a number within the bound of that field."""
        return self.number(key, default, bound_of(key))

    def count(self, key: str, default: int | None = None) -> int:
        """Read an integer within the bound of that field."""
        return self.integer(key, default, bound_of(key))

    def text(self, key: str, default: str | None = None) -> str:
        """Read a text that is not empty."""

        def fault_of(value: object) -> str | None:
            return _unless(isinstance(value, str) and bool(value.strip()), "a text", value)

        return str(self._take(key, default, "", fault_of))

    def name(self, key: str) -> str:
        """Read a name: a letter, then letters, digits, ``_`` and ``-``."""
        value = self.text(key)
        if value and not _NAME.match(value):
            self.wrong(key, f"must be a letter followed by letters, digits, '_' or '-', got {shown(value)}")
        elif len(value) > LONGEST_NAME:
            self.wrong(key, f"must have at most {LONGEST_NAME} characters, has {len(value)}")
        else:
            return value
        return ""

    def flag(self, key: str, default: bool) -> bool:
        """Read true or false."""
        return bool(self._take(key, default, default, lambda v: _unless(isinstance(v, bool), "true or false", v)))

    def choice(self, key: str, options: Iterable[str], default: str | None = None, *, what: str = "") -> str:
        """Read one of `options`; `what` names their kind (``robot type``)."""
        value = self.text(key, default)
        options = list(options)
        if not value or value in options:
            return value
        self.wrong(key, unknown(what, value, options) if what else no_option(value, options))
        return ""

    def numbers(
        self, key: str, count: int, default: tuple[float, ...] | None = None, bound: Bound = FINITE
    ) -> tuple[float, ...]:
        """Read a list of `count` finite numbers within the bound; empty if it has a problem."""
        if not self._present(key, required=default is None):
            return default or ()
        faults = list(list_faults(self.data[key], count, bound))
        for where, fault in faults:
            self.wrong(key + where, fault)
        return () if faults else tuple(float(number) for number in self.data[key])

    def items(self, key: str, wanted: str, *, required: bool = True, least: int = 0) -> list[Any]:
        """Read a list of at least `least` items, without checking them; empty if it is absent or has a problem."""
        if not self._present(key, required=required):
            return []
        value = self.data[key]
        if isinstance(value, list) and len(value) >= least:
            return value
        self.wrong(key, f"must be {wanted}, got {shown(value)}")
        return []

    def texts(self, key: str) -> list[str]:
        """Read a list of texts that is not empty; empty if it has a problem."""
        value = self.items(key, "a list of texts", least=1)
        wrong = [i for i, item in enumerate(value) if not isinstance(item, str)]
        for i in wrong:
            self.wrong(f"{key}[{i}]", f"must be a text, got {shown(value[i])}")
        return [] if wrong else value

    def part(self, key: str, *, required: bool = True) -> Fields:
        """Read a mapping; return one without fields if it is absent or has a problem."""
        value = self.data[key] if self._present(key, required=required) else None
        if isinstance(value, Mapping):
            return Fields(value, self.at(key), self.problems)
        if self.has(key):
            self.wrong(key, f"must be a mapping of fields, got {shown(value)}")
        return Fields({}, self.at(key), [])  # problems of a placeholder's fields are dropped

    def parts(self, key: str, *, required: bool = True) -> list[Fields]:
        """Read a list of mappings; other items are left out."""
        found = []
        for i, item in enumerate(self.items(key, "a list", required=required)):
            if isinstance(item, Mapping):
                found.append(Fields(item, f"{self.at(key)}[{i}]", self.problems))
            else:
                self.wrong(f"{key}[{i}]", f"must be a mapping of fields, got {shown(item)}")
        return found

    def refuse(self, key: str, reason: str) -> None:
        """Note a problem if a field is present that is not allowed here."""
        self._refused.add(key)
        if self.has(key):
            self.wrong(key, reason)

    def finish(self, also: Iterable[str] = ()) -> None:
        """Note every field that was not read and is not in `also`; the last problem lists the fields allowed here."""
        self._known.update(dict.fromkeys(also))
        strange = [str(key) for key in self.data if key not in self._known]
        offered = [key for key in self._known if key not in self._refused]
        for key in strange:
            listed = f"; the fields here are {', '.join(offered)}" if key == strange[-1] else ""
            self.wrong(key, f"unknown field{suggestion(key, offered)}{listed}")

    def _take(self, key: str, default: Any, placeholder: Any, fault_of: Callable[[Any], str | None]) -> Any:
        """Return the value of a field; `default` if it is absent, `placeholder` if it has a problem."""
        if not self._present(key, required=default is None):
            return placeholder if default is None else default
        if fault := fault_of(self.data[key]):
            self.wrong(key, fault)
            return placeholder
        return self.data[key]

    def _present(self, key: str, *, required: bool) -> bool:
        if required and not self.has(key):
            self.wrong(key, "missing")
        return self.has(key)


def read_places(fields: Fields, capacity: int | None) -> tuple[int, Seats]:
    """Read ``capacity``, which defaults to the number of seats, else to `capacity`, and ``seats`` by rover type."""
    seats: Seats = ()
    fields.has("capacity")  # named before the seats in messages
    if fields.has("seats"):
        part = fields.part("seats")
        seats = tuple((str(kind), part.integer(kind, None, BOUNDS["capacity"])) for kind in part.data)
        if fields.data["seats"] == {}:
            fields.wrong("seats", "must name a rover type; leave it out if all fit")
        capacity = min(sum(number for _, number in seats), int(BOUNDS["capacity"].most))
    return fields.count("capacity", capacity), seats


def shown(value: object) -> str:
    """Return a value for a message: short, in the words of the file."""
    if isinstance(value, bool):
        return "true" if value else "false"
    if value is None:
        return "nothing"
    try:
        text = _SHORT.repr(value)
    except ValueError:  # Python reads YAML's integers of any length, but does not print them
        return "a number of thousands of digits"
    return text if len(text) <= 60 else text[:57] + "..."


def number_fault(value: object) -> str | None:
    """Return why `value` is not a finite number, or None."""
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        meant = isinstance(value, str) and _DECIMAL_COMMA.match(value)
        return f"must be a number, got {shown(value)}" + (f", did you mean {meant[1]}.{meant[2]}?" if meant else "")
    if abs(value) > MOST or not math.isfinite(value):
        return f"must be finite, got {shown(value)}"
    return None


def list_faults(value: object, count: int, bound: Bound = FINITE) -> Iterator[tuple[str, str]]:
    """Yield why `value` is not a list of `count` finite numbers within the bound: the index (``[1]``) and its fault."""
    if isinstance(value, list) and len(value) == count:
        for i, item in enumerate(value):
            if fault := number_fault(item) or bound.fault(item):
                yield f"[{i}]", fault
        return
    split = isinstance(value, list) and len(value) > count and all(map(is_whole, value))
    advice = "; a comma separates numbers: write 2.5, not 2,5" if split else ""
    yield "", f"must be a list of {count} numbers, got {shown(value)}{advice}"


def is_whole(value: object) -> bool:
    """Return whether `value` is an integer; to Python a boolean is one too, but not in a file."""
    return isinstance(value, int) and not isinstance(value, bool)


def _unless(fine: bool, wanted: str, value: object) -> str | None:
    return None if fine else f"must be {wanted}, got {shown(value)}"
