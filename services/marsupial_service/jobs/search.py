"""Ask an engine from inside a worker, a process that is limited and swept already.

Engines that run in a child process are asked for the function they would run there, and it runs here.
"""

from __future__ import annotations

import importlib
from collections.abc import Iterator

from marsupial.errors import UsageError
from marsupial.model.plan import Plan
from marsupial.model.planning import Budget, Engine, Finished, Improved, Outcome
from marsupial.model.situation import Situation
from marsupial.planning.external.encodings import Task, Verdict
from marsupial.planning.external.process_engine import ProcessEngine, settled
from marsupial.processes.jobs import Job


def events(engine: Engine, situation: Situation, budget: Budget, start: Plan | None) -> Iterator[Improved | Finished]:
    """Return the events of a search as `Engine.solve` does."""
    if isinstance(engine, ProcessEngine):
        return _here(engine, situation, budget, start)
    return engine.solve(situation, budget, start=start)


def _here(
    engine: ProcessEngine, situation: Situation, budget: Budget, start: Plan | None
) -> Iterator[Improved | Finished]:
    if budget.seconds is None:
        raise UsageError(f"planner {engine.info.name} can't count steps: give it a budget in seconds")
    without_search = settled(situation)
    if without_search is not None:
        yield from without_search
        return
    below_ms = None if start is None else start.makespan_ms
    verdict = Verdict(outcome=Outcome.NO_PLAN)
    for value in _results(engine.job(Task(situation=situation, seconds=budget.seconds, below_ms=below_ms))):
        if isinstance(value, Verdict):
            verdict = value
        elif isinstance(value, Plan):
            yield Improved(plan=value, elapsed_s=0.0)
    yield Finished(outcome=verdict.outcome, detail=verdict.detail)


def _results(job: Job) -> Iterator[object]:
    module, _, name = job.function.partition(":")
    results: Iterator[object] = getattr(importlib.import_module(module), name)(job.argument)
    return results
