"""Who carries out the missions of a comparison: one protocol, whatever machines are behind it."""

from __future__ import annotations

from collections.abc import Generator, Sequence
from typing import Protocol

from marsupial.bench.compare.plan import Trial
from marsupial.bench.compare.rows import CRASHED, Result, Row

MOST_TRIES = 2
"""How often a mission is begun whose worker dies."""


class Runner(Protocol):
    """Carries out missions, several at a time.

    A runner gets the `Comparison` when it is made, so that scenarios travel to each worker only once.
    """

    def results(self, trials: Sequence[Trial]) -> Generator[Result]:
        """Yield exactly one result for each of `trials`, as they are done.

        A mission whose worker is lost is carried out once more; if that is lost too, its row says so
        (`marsupial.bench.compare.rows.CRASHED`). Closing the generator stops all workers.
        """
        ...


def lost(trial: Trial, tries: int, how: str) -> Result | None:
    """Return what is to be said of a mission whose worker died at that try; None if it is to be begun again."""
    if tries < MOST_TRIES:
        return None
    return Result(row=Row(trial=trial, status=CRASHED, reason=f"the worker process died {MOST_TRIES} times: {how}"))
