"""Report the faults of a map file, but only as many as somebody reads."""

from __future__ import annotations

from collections.abc import Sequence

from marsupial.errors import MapError, Problem

MAX_PROBLEMS = 10
"""Most faults to report: a file with more is probably of another kind."""


def raise_any(problems: Sequence[Problem], source: str) -> None:
    """Raise a MapError with the first problems and the number of the others; do nothing if there are none."""
    shown, rest = list(problems[:MAX_PROBLEMS]), len(problems) - MAX_PROBLEMS
    if rest > 0:
        shown.append(Problem("", f"and {rest} more faults like these"))
    if shown:
        raise MapError(shown, source=source)
