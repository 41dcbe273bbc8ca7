"""Reading a tree of fields so that everything wrong with it is reported at once.

`Notes` gather what is wrong, each problem with its path. `Fields` are notes on one mapping of a file: their methods
take one field each, check it, note what is wrong, and hand back a placeholder of the right type so that reading goes
on. The caller raises at the end if there are problems, so that no placeholder ever gets out.
A boolean is not a number, and a number has to be finite.
"""

from __future__ import annotations

import math
import re
import reprlib
from collections.abc import Callable, Iterable, Mapping
from typing import Any

from marsupial.errors import InputError, Problem
from marsupial.model.bounds import BOUNDS, LONGEST_NAME, MOST, Bound
from marsupial.wording import suggestion

_SHORT = reprlib.Repr()
_SHORT.maxstring = _SHORT.maxlong = 60

FINITE = Bound(-math.inf, math.inf)

_DECIMAL_COMMA = re.compile(r"([-+]?[0-9]+),([0-9]+)\Z")
_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_-]*\Z")


class Notes:
    """What is wrong with one part of a file or request.

    Parameters
    ----------
    path
        Where the part stands, empty for the whole of it.
    problems
        What was found wrong so far; shared by all parts.
    """

    def __init__(self, path: str = "", problems: list[Problem] | None = None) -> None:
        self.path = path
        self.problems: list[Problem] = [] if problems is None else problems

    def at(self, key: str) -> str:
        """Return the path of a field."""
        return f"{self.path}.{key}" if self.path and not key.startswith("[") else f"{self.path}{key}"

    def below(self, key: str) -> Notes:
        """Return the notes on a field."""
        return Notes(self.at(key), self.problems)

    def wrong(self, key: str, message: str) -> None:
        """Note a problem with a field, or with the part itself where `key` is empty."""
        self.problems.append(Problem(self.at(key) if key else self.path, message))

    def take(self, error: InputError) -> None:
        """Note the problems of an error, whose paths begin here."""
        for problem in error.problems:
            self.wrong(problem.path, problem.message)

    def check(self, error: type[InputError]) -> None:
        """Raise an error with all problems, if there are any."""
        if self.problems:
            raise error(self.problems)


class Fields(Notes):
    """One mapping of a file, read field by field.

    A field whose method is given a default may be absent; without one it is required.

    Parameters
    ----------
    data
        The mapping as it was parsed.
    path
        Where it stands in the file, empty for the whole of it.
    problems
        What was found wrong so far; shared by all parts of one file.
    """

    def __init__(self, data: Mapping[Any, Any], path: str, problems: list[Problem]) -> None:
        super().__init__(path, problems)
        self.data = data
        self._known: dict[str, None] = {}  # in the order in which they were asked for
        self._refused: set[str] = set()

    def has(self, key: str) -> bool:
        """Say whether a field is present."""
        self._known[key] = None
        return key in self.data

    def number(self, key: str, default: float | None = None, bound: Bound = FINITE) -> float:
        """Take a finite number within the bound."""
        return float(self._take(key, default, 0.0, lambda value: number_fault(value) or bound.fault(value)))

    def integer(self, key: str, default: int | None = None, bound: Bound = FINITE) -> int:
        """Take an integer within the bound."""
        return int(self._take(key, default, 0, lambda value: _integer_fault(value) or bound.fault(value)))

    def quantity(self, key: str, default: float | None = None) -> float:
        """Take a number within the bound that has the name of the field."""
        return self.number(key, default, BOUNDS[key])

    def count(self, key: str, default: int | None = None) -> int:
        """Take an integer within the bound that has the name of the field."""
        return self.integer(key, default, BOUNDS[key])

    def text(self, key: str, default: str | None = None) -> str:
        """Take a text that is not empty."""
        return str(self._take(key, default, "", _text_fault))

    def name(self, key: str, default: str | None = None) -> str:
        """Take a name: a letter, then letters, digits, ``_`` and ``-``."""
        value = self.text(key, default)
        if value and not _NAME.match(value):
            self.wrong(key, f"must be a letter followed by letters, digits, '_' or '-', got {shown(value)}")
            return ""
        if len(value) > LONGEST_NAME:
            self.wrong(key, f"must have at most {LONGEST_NAME} characters, has {len(value)}")
            return ""
        return value

    def flag(self, key: str, default: bool) -> bool:
        """Take true or false."""
        return bool(self._take(key, default, default, _flag_fault))

    def choice(self, key: str, options: Iterable[str], default: str | None = None, *, what: str = "") -> str:
        """Take one of `options`; `what` says what they are (``robot type``)."""
        value = self.text(key, default)
        options = list(options)
        if not value or value in options:
            return value
        if what:
            self.wrong(key, unknown(what, value, options))
        else:
            self.wrong(key, f"must be {' or '.join(options)}, got {shown(value)}")
        return ""

    def numbers(
        self, key: str, count: int, default: tuple[float, ...] | None = None, bound: Bound = FINITE
    ) -> tuple[float, ...]:
        """Take a list of `count` finite numbers, each within the bound; empty where it is wrong."""
        numbers = self._take(key, default, (), lambda v: _numbers_fault(v, count))
        faults = [(i, fault) for i, number in enumerate(numbers) if (fault := bound.fault(number)) is not None]
        for i, fault in faults:
            self.wrong(f"{key}[{i}]", fault)
        return () if faults else tuple(float(number) for number in numbers)

    def texts(self, key: str) -> list[str]:
        """Take a list of texts that is not empty; empty where it is wrong."""
        if not self._present(key, required=True):
            return []
        value = self.data[key]
        if not isinstance(value, list) or not value:
            self.wrong(key, f"must be a list of texts, got {shown(value)}")
            return []
        wrong = [i for i, item in enumerate(value) if not isinstance(item, str)]
        for i in wrong:
            self.wrong(f"{key}[{i}]", f"must be a text, got {shown(value[i])}")
        return [] if wrong else value

    def part(self, key: str, *, required: bool = True) -> Fields:
        """Take a mapping; one without fields where it is absent or wrong."""
        if not self._present(key, required=required):
            return Fields({}, self.at(key), [])
        value = self.data[key]
        if not isinstance(value, Mapping):
            self.wrong(key, f"must be a mapping of fields, got {shown(value)}")
            return Fields({}, self.at(key), [])
        return Fields(value, self.at(key), self.problems)

    def parts(self, key: str, *, required: bool = True) -> list[Fields]:
        """Take a list of mappings, without those that are none."""
        value = self.data[key] if self._present(key, required=required) else []
        if not isinstance(value, list):
            self.wrong(key, f"must be a list, got {shown(value)}")
            return []
        found = []
        for i, item in enumerate(value):
            if isinstance(item, Mapping):
                found.append(Fields(item, f"{self.at(key)}[{i}]", self.problems))
            else:
                self.wrong(f"{key}[{i}]", f"must be a mapping of fields, got {shown(item)}")
        return found

    def refuse(self, key: str, reason: str) -> None:
        """Note a problem if a field is present that has no place here."""
        self._refused.add(key)
        if self.has(key):
            self.wrong(key, reason)

    def finish(self, also: Iterable[str] = ()) -> None:
        """Note every field that nothing asked for and that is none of `also`, and with the last what may stand here."""
        self._known.update(dict.fromkeys(also))
        strange = [str(key) for key in self.data if key not in self._known]
        offered = [key for key in self._known if key not in self._refused]
        for key in strange:
            listed = f"; the fields here are {', '.join(offered)}" if key == strange[-1] else ""
            self.wrong(key, f"unknown field{suggestion(key, offered)}{listed}")

    def _take(self, key: str, default: Any, placeholder: Any, fault_of: Callable[[Any], str | None]) -> Any:
        """Return the value of a field; `default` where it is absent, `placeholder` where it is wrong."""
        if not self._present(key, required=default is None):
            return placeholder if default is None else default
        fault = fault_of(self.data[key])
        if fault:
            self.wrong(key, fault)
            return placeholder
        return self.data[key]

    def _present(self, key: str, *, required: bool) -> bool:
        if required and not self.has(key):
            self.wrong(key, "missing")
        return self.has(key)


def unknown(what: str, word: str, options: Iterable[str]) -> str:
    """Return that `word` is none of `options`, with the one that it may have been meant for."""
    return f"unknown {what} {word!r}{suggestion(word, options)}"


def shown(value: object) -> str:
    """Return a value as a message shows it: short, in the words of the file."""
    if isinstance(value, bool):
        return "true" if value else "false"
    if value is None:
        return "nothing"
    try:
        text = _SHORT.repr(value)
    except ValueError:  # YAML makes whole numbers of more digits than Python writes
        return "a number of thousands of digits"
    return text if len(text) <= 60 else text[:57] + "..."


def number_fault(value: object) -> str | None:
    """Say what keeps `value` from being a finite number."""
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        meant = isinstance(value, str) and _DECIMAL_COMMA.match(value)
        return f"must be a number, got {shown(value)}" + (f", did you mean {meant[1]}.{meant[2]}?" if meant else "")
    if abs(value) > MOST or not math.isfinite(value):
        return f"must be finite, got {shown(value)}"
    return None


def _integer_fault(value: object) -> str | None:
    whole = isinstance(value, int) and not isinstance(value, bool)
    return None if whole else f"must be an integer, got {shown(value)}"


def _text_fault(value: object) -> str | None:
    return None if isinstance(value, str) and value.strip() else f"must be a text, got {shown(value)}"


def _flag_fault(value: object) -> str | None:
    return None if isinstance(value, bool) else f"must be true or false, got {shown(value)}"


def _numbers_fault(value: object, count: int) -> str | None:
    if isinstance(value, list) and len(value) == count and not any(number_fault(item) for item in value):
        return None
    return f"must be a list of {count} numbers, got {shown(value)}"
