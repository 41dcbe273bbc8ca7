"""Carry out what is left of a comparison, and keep it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import closing
from pathlib import Path

from marsupial.bench.compare.folder import opened, read_rows, sort_lines
from marsupial.bench.compare.header import header_of
from marsupial.bench.compare.plan import Comparison
from marsupial.bench.compare.rows import Row
from marsupial.bench.compare.runner import Runner

Watch = Callable[[Row | None, int, int], None]
"""Told, after each mission and once before the first, its row, how many missions are done, and how many there are."""


def conduct(comparison: Comparison, runner: Runner, out: Path, watch: Watch, *, drop: Sequence[str] = ()) -> None:
    """Carry out the missions whose row is not in the folder `out` yet.

    Whenever this is left, the folder can be resumed. Missions with a status in `drop` are carried out again.

    Raises
    ------
    UsageError, InputError
        If the folder can't be used.
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
