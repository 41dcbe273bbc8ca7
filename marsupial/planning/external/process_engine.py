"""Engines that run in a child process: the part that Tamer and Aries share.

The child builds the engine's encoding, runs it and sends back plans in our own terms; this module compares them, passes
them on, and translates the end of the process into an `Outcome`. It also handles cases that need no engine: nothing to
do, or an unreachable goal.
"""

from __future__ import annotations

import importlib.util
import sys
import time
from collections.abc import Callable, Generator, Iterable, Iterator
from dataclasses import dataclass, replace

from marsupial.errors import EngineUnavailable, UsageError
from marsupial.model import MAKESPAN, Budget, EngineInfo, Finished, Improved, Objective, Outcome, Plan, Situation
from marsupial.planning.checker import check
from marsupial.planning.external.encodings import SearchRequest
from marsupial.planning.incumbent import Incumbent
from marsupial.planning.reachability import impossible
from marsupial.processes import launcher as processes
from marsupial.processes.jobs import GIB, Ended, Ending, Job, JobLimits, Message
from marsupial.wording import counted

# a module's generator function that takes a `SearchRequest` and yields every plan, and possibly how it ended
PlanSearch = Callable[..., Iterator[Plan | Finished]]
Finder = Callable[[str], object | None]  # finds a module without importing it, like `importlib.util.find_spec`


@dataclass(frozen=True, slots=True, kw_only=True)
class Requirement:
    """A module that an engine needs, the distribution to install, and the first Python without wheels of it."""

    module: str
    distribution: str
    no_wheels_from: tuple[int, int] | None = None


class ProcessEngine:
    """An engine whose generator `search` runs in a child process; `preload` loads its libraries once for all."""

    def __init__(
        self,
        info: EngineInfo,
        search: PlanSearch,
        requirements: tuple[Requirement, ...],
        *,
        preload: tuple[processes.Preload, ...] = (),
        finder: Finder = importlib.util.find_spec,
        memory_bytes: int = 2 * GIB,
    ) -> None:
        self._search = search
        self._preload = (sys.modules[search.__module__], *preload)
        self._memory_bytes = memory_bytes
        self.info = replace(info, missing=_missing(requirements, finder))

    def solve(
        self, situation: Situation, budget: Budget, *, objective: Objective = MAKESPAN, start: Plan | None = None
    ) -> Events:
        """Start the search and return its events; see `Engine`. Its time begins once the libraries are loaded."""
        if self.info.missing is not None:
            raise EngineUnavailable(f"{self.info.name}: {self.info.missing}")
        request = self._request(situation, budget, objective, start)
        settled = _settled(request)
        if settled is not None:
            return settled
        processes.warm_up(wait=False, preload=self._preload)
        run = processes.run(self.job(request))
        return Events(run, _follow(request, run))

    def solve_here(
        self, situation: Situation, budget: Budget, *, objective: Objective = MAKESPAN, start: Plan | None = None
    ) -> Events:
        """Search in this process instead, which must already have limits and cleanup."""
        request = self._request(situation, budget, objective, start)
        return _settled(request) or Events(None, _follow(request, _run_here(self.job(request))))

    def _request(self, situation: Situation, budget: Budget, objective: Objective, start: Plan | None) -> SearchRequest:
        if budget.seconds is None:
            raise UsageError(f"planner {self.info.name} can't count steps: give it a budget in seconds")
        self.info.require(objective)
        return SearchRequest(situation=situation, seconds=budget.seconds, start=start)

    def job(self, request: SearchRequest) -> Job:
        """Return the job of one search; engines override it if the search needs more than a `SearchRequest`."""
        limits = JobLimits(wall_s=request.seconds, memory_bytes=self._memory_bytes)
        return Job(function=self._search, argument=request, limits=limits)


class Events:
    """The events of one search. `cancel` may be called from another thread; `close` ends the search and waits."""

    def __init__(self, run: processes.JobRun | None, steps: Generator[Improved | Finished]) -> None:
        self._run, self._steps = run, steps

    def __iter__(self) -> Events:
        return self

    def __next__(self) -> Improved | Finished:
        return next(self._steps)

    def cancel(self) -> None:
        """Request the end of the search; return at once."""
        if self._run is not None:
            self._run.cancel()

    def close(self) -> None:
        """End the search if it is running; return when all its processes have ended."""
        if self._run is not None:
            self._run.close()
        self._steps.close()


def _follow(request: SearchRequest, messages: Iterable[Message | Ended]) -> Generator[Improved | Finished]:
    """Yield the known plan, those that are better, and the end of a search."""
    incumbent = Incumbent(request.situation)
    if request.start is not None and incumbent.take(request.start):
        yield Improved(plan=request.start, elapsed_s=0.0)
    said = Finished(outcome=Outcome.NO_PLAN)
    for message in messages:
        if isinstance(message, Ended):
            yield _finished(message, said, incumbent)
        elif isinstance(message.value, Finished):
            said = message.value
        elif isinstance(message.value, Plan) and incumbent.take(message.value):
            yield Improved(plan=message.value, elapsed_s=message.elapsed_s)


def _run_here(job: Job) -> Iterator[Message | Ended]:
    began = time.monotonic()
    for value in job.function(job.argument) or ():
        yield Message(value=value, elapsed_s=time.monotonic() - began)
    yield Ended(ending=Ending.FINISHED, detail="", wall_s=time.monotonic() - began)


def _missing(requirements: tuple[Requirement, ...], finder: Finder) -> str | None:
    if not processes.SUPPORTED:
        return "needs a system that can fork processes (Linux or macOS)"
    lacking = [need for need in requirements if finder(need.module) is None]
    for need in lacking:
        if need.no_wheels_from is not None and sys.version_info >= need.no_wheels_from:
            below = ".".join(map(str, need.no_wheels_from))
            return f"not installed; {need.distribution} has wheels for Python below {below} only"
    if not lacking:
        return None
    return f"not installed; to get it: pip install {' '.join(need.distribution for need in lacking)}"


def _settled(request: SearchRequest) -> Events | None:
    """Return the events where no search is needed."""
    if request.start is not None:
        return None
    events: list[Improved | Finished] = []
    nothing = Plan(actions=())
    if check(request.situation, nothing).valid:
        done = Finished(outcome=Outcome.OPTIMAL, detail="there is nothing to do", lower_bound_ms=0)
        events = [Improved(plan=nothing, elapsed_s=0.0), done]
    elif (proof := impossible(request.situation)) is not None:
        events = [Finished(outcome=Outcome.UNSOLVABLE, detail=proof)]
    return Events(None, (event for event in events)) if events else None


_WITHOUT_PLAN = (Outcome.NO_PLAN, Outcome.TIMEOUT, Outcome.MEMORY)


def _finished(ended: Ended, said: Finished, incumbent: Incumbent) -> Finished:
    outcome, detail = said.outcome, said.detail
    if ended.ending is not Ending.FINISHED:
        # All other endings have an outcome of the same name.
        outcome = Outcome.KILLED if ended.ending is Ending.CANCELLED else Outcome(ended.ending.value)
        detail = _with_last_words(ended)
    if incumbent.plan is not None and outcome in _WITHOUT_PLAN:
        outcome = Outcome.SATISFICING
    if incumbent.refused:
        detail = f"{detail}; {counted(len(incumbent.refused), 'plan')} refused (first: {incumbent.refused[0]})"
    return Finished(outcome=outcome, detail=detail, elapsed_s=ended.wall_s)


def _with_last_words(ended: Ended) -> str:
    """Append the last line that a crashed engine wrote, which is mostly the reason."""
    lines = [line.strip() for line in ended.output.splitlines() if line.strip()]
    if ended.ending is not Ending.CRASHED or not lines or lines[-1] in ended.detail or ended.detail in lines[-1]:
        return ended.detail
    return f"{ended.detail}; its last words: {lines[-1][-200:]}"
