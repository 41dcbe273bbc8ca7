"""Run the remaining missions of a comparison and store their results.

A `MissionRunner` runs missions on this machine (`LocalPool`) or on a cluster (`RayPool`). Both take them from a
`TrialQueue`, which hands out a mission again if its worker died.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Generator, Sequence
from contextlib import closing
from pathlib import Path
from typing import Protocol

from marsupial.bench.compare.folder import opened, read_rows, sort_lines
from marsupial.bench.compare.header import header_of
from marsupial.bench.compare.plan import Comparison, Trial
from marsupial.bench.compare.rows import CRASHED, MissionRow, Result

MOST_TRIES = 2  # how often a mission is started whose worker dies


class MissionRunner(Protocol):
    """Runs missions in parallel; made with the `Comparison`, so that each worker gets the scenarios only once."""

    def results(self, trials: Sequence[Trial]) -> Generator[Result]:
        """Yield exactly one result for each of `trials`, as they are done.

        A mission whose worker dies is run once more; if that one dies too, the result is a row of status `CRASHED`.
        Closing the generator stops all workers.
        """
        ...


class TrialQueue:
    """The missions that wait for a worker, and how often each was started. Thread-safe."""

    def __init__(self, trials: Sequence[Trial]) -> None:
        self._trials = deque(trials)
        self._tries = dict.fromkeys(trials, 0)

    def __len__(self) -> int:
        return len(self._trials)

    def take(self) -> Trial | None:
        """Return the next mission to start, None if there is none."""
        try:  # asking for the length first would race with other threads
            trial = self._trials.popleft()
        except IndexError:
            return None
        self._tries[trial] += 1
        return trial

    def lost(self, trial: Trial, how: str) -> Result | None:
        """Queue a mission again whose worker died, or return its result if that happened too often."""
        if self._tries[trial] < MOST_TRIES:
            self._trials.appendleft(trial)
            return None
        return Result(
            row=MissionRow(trial=trial, status=CRASHED, reason=f"the worker process died {MOST_TRIES} times: {how}")
        )


Watch = Callable[[MissionRow | None, int, int], None]
"""Called after each mission with its row, the number of missions done and their total; with None at the start."""


def conduct(
    comparison: Comparison, runner: MissionRunner, out: Path, watch: Watch, *, drop: Sequence[str] = ()
) -> None:
    """Run the missions whose row is not in the folder `out` yet, and those with a status in `drop`.

    The folder can be resumed whenever this ends. Raise a `UsageError` or `InputError` if it can't be used.
    """
    trials = tuple(comparison.trials())
    with opened(out, header_of(comparison), drop=drop) as add:
        done = {row.trial for row in read_rows(out)}
        left = [trial for trial in trials if trial not in done]
        watch(None, len(done), len(trials))
        if left:
            with closing(runner.results(left)) as results:
                for result in results:
                    add(result)
                    done.add(result.row.trial)
                    watch(result.row, len(done), len(trials))
    sort_lines(out, trials)
