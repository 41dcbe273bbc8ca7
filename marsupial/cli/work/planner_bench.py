"""The work of `marsupial bench planners`: select runs, print progress on stderr, write files after every round."""

from __future__ import annotations

import json as json_text
import math
from collections.abc import Iterable
from dataclasses import dataclass
from fnmatch import fnmatchcase
from pathlib import Path

from marsupial.bench.planner_report import RunRow, progress_line, rows_of
from marsupial.bench.planners import BUDGETS_S, BenchEngine, EngineRun, Round, contenders, play, warm_up
from marsupial.bench.suite.best import Best, better, known_best, read_best, verified, write_best
from marsupial.bench.suite.catalogue import INSTANCES, Instance
from marsupial.cli.display.messages import say
from marsupial.errors import InputError, UsageError
from marsupial.formats.files import about, read_text, write_file


@dataclass(frozen=True, slots=True, kw_only=True)
class Selection:
    """The engines, instances and budgets to run; `absent` engines can't be used here."""

    engines: tuple[BenchEngine, ...]
    absent: tuple[BenchEngine, ...]
    instances: tuple[Instance, ...]
    budgets_s: tuple[float, ...]

    @classmethod
    def of(cls, engines: Iterable[str], patterns: Iterable[str], budgets_s: Iterable[float]) -> Selection:
        """Return the selection of these options; all engines, instances or budgets if none are named."""
        patterns, budgets_s = tuple(patterns), tuple(budgets_s) or BUDGETS_S
        asked = contenders(tuple(engines))
        present = tuple(contender for contender in asked if contender.missing is None)
        if not present:
            raise UsageError("; ".join(f"planner {contender.name}: {contender.missing}" for contender in asked))
        for budget_s in budgets_s:
            if not (math.isfinite(budget_s) and budget_s > 0):
                raise UsageError(f"--budget: must be positive, got {budget_s:g}")
        return cls(
            engines=present,
            absent=tuple(contender for contender in asked if contender.missing is not None),
            instances=_instances(patterns),
            budgets_s=tuple(sorted(set(budgets_s))),
        )


def rows_of_bench(chosen: Selection, *, json: Path | None, update: Path | None) -> tuple[RunRow, ...]:
    """Run all rounds and return their rows; write them to `json`, and better plans to `update`, after every round."""
    best = known_best()
    _merge(best, update)
    for contender in chosen.engines:
        say(f"warming up {contender.name}")
        warm_up(contender)
    rounds: list[Round] = []
    for instance in chosen.instances:
        number = f"{len(rounds) + 1}/{len(chosen.instances)}"
        known = best.get(instance.name)

        def report(run: EngineRun, number: str = number) -> None:
            say(f"{number}  {progress_line(run)}")

        rounds.append(play(instance, chosen.engines, chosen.budgets_s, known, report))
        if json is not None:
            write_file(json, json_text.dumps([row.values() for row in rows_of(rounds)], indent=1) + "\n")
        _store(rounds[-1], best)
        # another process may have improved the file meanwhile: merge before writing
        if update is not None:
            _merge(best, update)
            write_file(update, write_best(best))
    return rows_of(rounds)


def _merge(best: dict[str, Best], file: Path | None) -> None:
    if file is None or not file.exists():
        return
    text = read_text(file, InputError)
    with about(file):
        found = read_best(text)
    for name, one in found.items():
        if name not in INSTANCES:
            raise InputError(f"there is no instance {name!r}", source=str(file))
        known = best.get(name)
        if one != known:
            best[name] = better(known, verified(one, INSTANCES[name].situation()))


def _instances(patterns: tuple[str, ...]) -> tuple[Instance, ...]:
    for pattern in patterns:
        if not any(fnmatchcase(name, pattern) for name in INSTANCES):
            raise UsageError(f"--instance: no instance matches {pattern!r}; there are {', '.join(INSTANCES)}")
    return tuple(
        instance
        for name, instance in INSTANCES.items()
        if not patterns or any(fnmatchcase(name, pattern) for pattern in patterns)
    )


def _store(done: Round, best: dict[str, Best]) -> None:
    name, known = done.instance.name, best.get(done.instance.name)
    if done.best is None or done.best == known:
        return
    best[name] = done.best
    if known is None or done.best.makespan_ms < known.makespan_ms:
        say(f"{name}: a new best plan, {done.best.makespan_ms / 1000:.3f} s, by {done.best.found_by}")
    if done.best.optimal:
        say(f"{name}: proven optimal by {done.best.bound_by}")
