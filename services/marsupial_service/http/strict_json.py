"""JSON as it is meant: UTF-8, no field twice, no NaN, no half of a surrogate pair, nothing endless.

JSON has one kind of number: ``1.0`` and ``1e0`` are read as ``1`` is, so that both are taken where a whole number is
asked, and requests that differ in nothing else are the same request.
"""

from __future__ import annotations

import json
from typing import Any, NoReturn

from marsupial_service.http.problems import HttpProblem

_REASONS = {
    UnicodeDecodeError: "is not UTF-8 text",
    UnicodeEncodeError: "a text has half of a surrogate pair in it",
    RecursionError: "is nested too deep",
    ValueError: "a number has too many digits",
}


_LONGEST_SHOWN = 100
"""Characters of a field's name."""


def parse(data: bytes) -> Any:
    """Return the value that JSON text describes. Raises HttpProblem if it is no such text."""
    try:
        value = json.loads(
            data.decode("utf-8"), object_pairs_hook=_unique, parse_constant=_no_constant, parse_float=_number
        )
        if b"\\u" in data:
            json.dumps(value, ensure_ascii=False).encode("utf-8")
    except json.JSONDecodeError as error:
        raise HttpProblem("bad-json", f"line {error.lineno}, column {error.colno}: {error.msg}") from None
    except (ValueError, RecursionError) as error:
        reason = next(text for kind, text in _REASONS.items() if isinstance(error, kind))
        raise HttpProblem("bad-json", reason) from None
    return value


def _unique(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    fields = dict(pairs)
    if len(fields) < len(pairs):
        seen: set[str] = set()
        twice = next(key for key, _ in pairs if key in seen or seen.add(key))  # type: ignore[func-returns-value]
        raise HttpProblem("bad-json", f"field {twice[:_LONGEST_SHOWN]!r} is given twice")
    return fields


def _number(text: str) -> float:
    """Return an int where the number is whole."""
    value = float(text)
    return int(value) if value.is_integer() else value


def _no_constant(word: str) -> NoReturn:
    raise HttpProblem("bad-json", f"{word} is no number of JSON")
