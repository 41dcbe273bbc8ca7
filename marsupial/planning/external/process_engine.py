"""Engines that run in a child process: the part that Tamer and Aries share.

The child builds the engine's encoding, runs it and sends back plans in our own terms; here they are compared and
passed on, and the end of the process is put into the words of `Outcome`. What needs no engine is settled here: nothing
to do, or a goal that can't be reached by anybody.
"""

from __future__ import annotations

import importlib.util
from collections.abc import Callable, Generator
from dataclasses import dataclass, replace

from marsupial.errors import EngineUnavailable, UsageError
from marsupial.model.plan import Plan
from marsupial.model.planning import Budget, EngineInfo, Finished, Improved, Outcome
from marsupial.model.situation import Situation
from marsupial.planning.checker import check
from marsupial.planning.external.encodings import Task, Verdict
from marsupial.planning.reachability import impossible
from marsupial.processes import launcher as processes
from marsupial.processes.jobs import GIB, Ended, Ending, Job, Limits

Finder = Callable[[str], object | None]
"""Finds a module without importing it, as `importlib.util.find_spec` does."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Requirement:
    """A module an engine needs and the distribution to install for it."""

    module: str
    distribution: str


class ProcessEngine:
    """An engine whose search is the generator `function` (``package.module:name``), run in a child process.

    Parameters
    ----------
    info
        What it is; `missing` is found out here.
    function
        Takes a `Task`, yields every `Plan` it finds and may end with a `Verdict`.
    """

    def __init__(
        self,
        info: EngineInfo,
        function: str,
        requirements: tuple[Requirement, ...],
        *,
        finder: Finder = importlib.util.find_spec,
        memory_bytes: int = 2 * GIB,
    ) -> None:
        self._function = function
        self._memory_bytes = memory_bytes
        self.info = replace(info, missing=_missing(requirements, finder))

    def solve(self, situation: Situation, budget: Budget, *, start: Plan | None = None) -> Events:
        """Start the search and return its events; see `Engine`. The time counts once the launcher is warm."""
        if self.info.missing is not None:
            raise EngineUnavailable(f"{self.info.name}: {self.info.missing}")
        if budget.seconds is None:
            raise UsageError(f"{self.info.name} can't count steps: give it a budget in seconds")
        without_search = settled(situation) if start is None else None
        if without_search is not None:
            return Events(None, without_search)
        first = (Improved(plan=start, elapsed_s=0.0),) if start is not None else ()
        below = None if start is None else start.makespan_ms
        task = Task(situation=situation, seconds=budget.seconds, below_ms=below)
        return Events(processes.run(self.job(task)), first)

    def job(self, task: Task) -> Job:
        """Return the job of one search; engines whose function takes more than a `Task` have their own."""
        limits = Limits(wall_s=task.seconds, memory_bytes=self._memory_bytes)
        return Job(function=self._function, argument=task, limits=limits)


class Events:
    """The events of one search. `cancel` may be called from another thread; `close` ends the search and waits."""

    def __init__(self, run: processes.Run | None, first: tuple[Improved | Finished, ...]) -> None:
        self._run = run
        self._steps = self._follow(run, first)

    def __iter__(self) -> Events:
        """Return itself."""
        return self

    def __next__(self) -> Improved | Finished:
        """Wait for the next event."""
        return next(self._steps)

    def cancel(self) -> None:
        """Ask for the search to be ended; returns at once."""
        if self._run is not None:
            self._run.cancel()

    def close(self) -> None:
        """End the search if it is still running; when this returns nothing of it is left."""
        if self._run is not None:
            self._run.close()
        self._steps.close()

    @staticmethod
    def _follow(run: processes.Run | None, first: tuple[Improved | Finished, ...]) -> Generator[Improved | Finished]:
        yield from first
        best = min((event.plan.makespan_ms for event in first if isinstance(event, Improved)), default=None)
        verdict: Verdict | None = None
        for event in run or ():
            if isinstance(event, Ended):
                yield _finished(event, verdict, best is not None)
            elif isinstance(event.value, Verdict):
                verdict = event.value
            elif isinstance(event.value, Plan) and (best is None or event.value.makespan_ms < best):
                best = event.value.makespan_ms
                yield Improved(plan=event.value, elapsed_s=event.elapsed_s)


def _missing(requirements: tuple[Requirement, ...], finder: Finder) -> str | None:
    if not processes.SUPPORTED:
        return "needs a system that can fork processes (Linux or macOS)"
    lacking = [need.distribution for need in requirements if finder(need.module) is None]
    if not lacking:
        return None
    return f"not installed; to get it: pip install {' '.join(lacking)}"


def settled(situation: Situation) -> tuple[Improved | Finished, ...] | None:
    """Return the events where no search is needed."""
    nothing = Plan(actions=())
    if check(situation, nothing).valid:
        done = Finished(outcome=Outcome.OPTIMAL, detail="there is nothing to do", lower_bound_ms=0)
        return Improved(plan=nothing, elapsed_s=0.0), done
    proof = impossible(situation)
    return None if proof is None else (Finished(outcome=Outcome.UNSOLVABLE, detail=proof),)


_OUTCOMES = {
    Ending.CRASHED: Outcome.CRASHED,
    Ending.KILLED: Outcome.KILLED,
    Ending.CANCELLED: Outcome.KILLED,
    Ending.MEMORY: Outcome.MEMORY,
    Ending.TIMEOUT: Outcome.TIMEOUT,
}
_WITHOUT_PLAN = (Outcome.NO_PLAN, Outcome.TIMEOUT, Outcome.MEMORY)


def _finished(ended: Ended, verdict: Verdict | None, has_plan: bool) -> Finished:
    if ended.ending is Ending.FINISHED:
        outcome = Outcome.NO_PLAN if verdict is None else verdict.outcome
        detail = "" if verdict is None else verdict.detail
    else:
        outcome, detail = _OUTCOMES[ended.ending], _with_last_words(ended)
    if has_plan and outcome in _WITHOUT_PLAN:
        outcome = Outcome.SATISFICING
    return Finished(outcome=outcome, detail=detail, elapsed_s=ended.wall_s)


def _with_last_words(ended: Ended) -> str:
    """Add the last line a crashed engine wrote, which is mostly its reason."""
    lines = [line.strip() for line in ended.output.splitlines() if line.strip()]
    if ended.ending is not Ending.CRASHED or not lines or lines[-1] in ended.detail:
        return ended.detail
    return f"{ended.detail}; its last words: {lines[-1][-200:]}"
