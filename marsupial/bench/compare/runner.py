"""Who carries out the missions of a comparison: one protocol, whatever machines are behind it."""

from __future__ import annotations

from collections import deque
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


class Waiting:
    """The missions that wait for a worker, and how often each was begun; for several threads."""

    def __init__(self, trials: Sequence[Trial]) -> None:
        self._trials = deque(trials)
        self._tries = dict.fromkeys(trials, 0)

    def __len__(self) -> int:
        return len(self._trials)

    def take(self) -> Trial | None:
        """Return the next mission to be begun, None if there is none."""
        try:
            trial = self._trials.popleft()
        except IndexError:
            return None
        self._tries[trial] += 1
        return trial

    def lost(self, trial: Trial, how: str) -> Result | None:
        """Let a mission whose worker died wait again, or return what is to be said if that was too often."""
        if self._tries[trial] < MOST_TRIES:
            self._trials.appendleft(trial)
            return None
        return Result(row=Row(trial=trial, status=CRASHED, reason=f"the worker process died {MOST_TRIES} times: {how}"))
