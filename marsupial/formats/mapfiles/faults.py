"""The faults of a map file, as many of them as somebody reads."""

from __future__ import annotations

from collections.abc import Sequence

from marsupial.errors import MapError, Problem

MAX_PROBLEMS = 10
"""A file with more faults than this is cut short in the report: it is probably no such file at all."""


def raise_any(problems: Sequence[Problem], source: str) -> None:
    """Raise a MapError with the first of the problems, if there are any, and how many more there are."""
    shown, rest = list(problems[:MAX_PROBLEMS]), len(problems) - MAX_PROBLEMS
    if rest > 0:
        shown.append(Problem("", f"and {rest} more faults like these"))
    if shown:
        raise MapError(shown, source=source)
