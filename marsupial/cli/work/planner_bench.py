"""The work of `marsupial bench planners`: select runs, print progress on stderr, write files after every round."""

import json as json_text
import math
from collections.abc import Sequence
from fnmatch import fnmatchcase
from pathlib import Path

from marsupial.bench.planner_report import RunRow, progress_line, rows_of
from marsupial.bench.planners import BUDGETS_S, BenchEngine, EngineRun, Round, contenders, play, warm_up
from marsupial.bench.suite.best import Best, better, known_best, read_best, verified, write_best
from marsupial.bench.suite.catalogue import INSTANCES, Instance
from marsupial.cli.display.messages import say
from marsupial.errors import InputError, UsageError
from marsupial.formats.files import about, read_text, write_file


def rows_of_bench(
    engines: Sequence[str],
    patterns: Sequence[str],
    budgets_s: Sequence[float],
    *,
    json: Path | None,
    update: Path | None,
) -> tuple[tuple[RunRow, ...], list[BenchEngine]]:
    """Run all rounds of these engines, instances and budgets, of all if none are named; write files after every round.

    Return the rows, and the engines that can't be used here. Rows go to `json`, better plans to `update`.
    """
    asked = contenders(engines)
    present = [contender for contender in asked if contender.missing is None]
    if not present:
        raise UsageError("; ".join(f"planner {contender.name}: {contender.missing}" for contender in asked))
    for budget_s in budgets_s:
        if not (math.isfinite(budget_s) and budget_s > 0):
            raise UsageError(f"--budget: must be positive, got {budget_s:g}")
    instances, budgets_s = _instances(patterns), sorted(set(budgets_s)) or BUDGETS_S
    best = known_best()
    _merge(best, update)
    for contender in present:
        say(f"warming up {contender.name}")
        warm_up(contender)
    rounds: list[Round] = []
    for instance in instances:
        number = f"{len(rounds) + 1}/{len(instances)}"
        known = best.get(instance.name)

        def report(run: EngineRun, number: str = number) -> None:
            say(f"{number}  {progress_line(run)}")

        rounds.append(play(instance, present, budgets_s, known, report))
        if json is not None:
            write_file(json, json_text.dumps([row.values() for row in rows_of(rounds)], indent=1) + "\n")
        _store(rounds[-1], best)
        # another process may have improved the file meanwhile: merge before writing
        if update is not None:
            _merge(best, update)
            write_file(update, write_best(best))
    return rows_of(rounds), [contender for contender in asked if contender.missing is not None]


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


def _instances(patterns: Sequence[str]) -> tuple[Instance, ...]:
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
