"""Who carries out the missions of a comparison: one protocol, whatever machines are behind it."""

from __future__ import annotations

from collections.abc import Generator, Sequence
from typing import Protocol

from marsupial.bench.compare.plan import Trial
from marsupial.bench.compare.rows import Result


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
