"""Read JSON from outside as plain values: one exception for whatever `json` raises, and finite numbers only."""

import json
import math
from typing import Any, NoReturn


class JsonFault(ValueError):
    """The reason why a text can't be read as JSON, in one line."""


def parse_json(text: str) -> Any:
    """Return the value of a JSON text; raise a `JsonFault` if it is invalid, too deep, or has an infinite number."""
    try:
        return json.loads(text, parse_constant=_no_number, parse_float=_finite)
    except RecursionError:
        raise JsonFault("is nested too deep") from None
    except ValueError as error:
        raise JsonFault(str(error).partition(";")[0]) from None


def _finite(text: str) -> float:
    value = float(text)
    return value if math.isfinite(value) else _no_number(text)


def _no_number(text: str) -> NoReturn:
    raise ValueError(f"{text[:40]} is no finite number")
