"""Read JSON from outside as plain values: one exception for whatever `json` raises, no field twice, finite numbers."""

import json
import math
import re
from typing import Any, NoReturn

_LONGEST_SHOWN = 100  # characters of a field's name

# names of fields with their colon, other texts (which may hold brackets), and the brackets of objects
_PARTS = re.compile(r'("(?:[^"\\]|\\.)*")(\s*:)?|[{}]')


class JsonFault(ValueError):
    """The reason why a text can't be read as JSON, in one line."""


class _Repeated(ValueError):
    """A field is given twice."""


def parse_json(text: str) -> Any:
    """Return the value of a JSON text; raise a `JsonFault` if it is invalid, too deep, or has an infinite number."""
    try:
        return load_json(text, parse_constant=_no_number, parse_float=_finite)
    except JsonFault:
        raise
    except RecursionError:
        raise JsonFault("is nested too deep") from None
    except ValueError as error:
        raise JsonFault(str(error).partition(";")[0]) from None


def load_json(text: str, **hooks: Any) -> Any:
    """Return what `json.loads` returns, with its `hooks`; raise a `JsonFault` for a field that is given twice."""
    try:
        return json.loads(text, object_pairs_hook=_unique, **hooks)
    except _Repeated:
        name, line = _repeated(text)
        where = f"line {line}: " if "\n" in text.strip() else ""
        raise JsonFault(f"{where}field {name[:_LONGEST_SHOWN]!r} is given twice") from None


def _unique(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    fields = dict(pairs)
    if len(fields) < len(pairs):
        raise _Repeated
    return fields


def _repeated(text: str) -> tuple[str, int]:
    """Return the first field of a valid JSON text that its object has already, and its line."""
    open_objects: list[set[str]] = []
    for part in _PARTS.finditer(text):
        if part[0] == "{":
            open_objects.append(set())
        elif part[0] == "}":
            open_objects.pop()
        elif part[2] is not None:
            name = json.loads(part[1])
            if name in open_objects[-1]:
                return name, text.count("\n", 0, part.start()) + 1
            open_objects[-1].add(name)
    raise AssertionError("no field is given twice")


def _finite(text: str) -> float:
    value = float(text)
    return value if math.isfinite(value) else _no_number(text)


def _no_number(text: str) -> NoReturn:
    raise ValueError(f"{text[:40]} is no finite number")
