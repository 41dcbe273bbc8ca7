"""Every planner on every instance of the suite, within the same budgets, in this process and warmed up.

The bench keeps its own clock, counts a plan only if it comes by the deadline and our checker accepts it, and checks it
after the run, so that checking costs the engine no time. Ratios are to the best plan known, be it one of the run.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable
from contextlib import closing
from dataclasses import dataclass

from marsupial.bench.suite.best import Best, with_bound, with_plan
from marsupial.bench.suite.catalogue import INSTANCES, Instance
from marsupial.library.plans import engine_events
from marsupial.model.plan import Plan
from marsupial.model.planning import Budget, Engine, Finished, Outcome
from marsupial.model.situation import Situation
from marsupial.planning.engines import ENGINES, PART_SIZES, engine, mission_engine
from marsupial.planning.incumbent import Incumbent

BUDGETS_S = (0.1, 1.0, 10.0)
IN_PARTS = " in parts"
WARM_UP = ("pressure-1x1-3", "in-flight-3x2-12")
WARM_UP_S, WARM_UP_OVER_S, WARM_UPS = 0.5, 0.25, 6
CLOSE = 1.01
"""Ratio to the best that counts as close to it."""

GRACE_S, GRACE_SHARE = 0.01, 0.02
"""A plan counts that comes this long after the end of the budget: one on its way, and the noise of the machine."""


@dataclass(frozen=True, slots=True, kw_only=True)
class BenchEngine:
    """An engine in the bench; `missing` is why it can't be used here. `make` takes the budget in seconds."""

    name: str
    make: Callable[[float], Engine]
    missing: str | None


@dataclass(frozen=True, slots=True, kw_only=True)
class Arrival:
    """A plan for all targets that came in time and was the incumbent: seconds since the engine was asked, makespan."""

    elapsed_s: float
    makespan_ms: int


@dataclass(frozen=True, slots=True, kw_only=True)
class EngineRun:
    """One engine on one instance.

    Parameters
    ----------
    arrivals, plan
        The incumbents that came in time, each better than the last, and the last one.
    served
        Most targets explored by a plan, be it one for a part of the targets only.
    refused, late
        Plans that the checker refused, and accepted or not plans that came too late.
    finished
        None where the engine had to be stopped.
    wall_s
        Until the engine was done or stopped.
    """

    instance: str
    engine: str
    budget_s: float
    arrivals: tuple[Arrival, ...]
    plan: Plan | None
    served: int
    refused: int
    late: int
    finished: Finished | None
    wall_s: float

    @property
    def makespan_ms(self) -> int | None:
        """Of the best plan, or None."""
        return None if self.plan is None else self.plan.makespan_ms

    @property
    def bound_ms(self) -> int | None:
        """No plan is shorter, says the engine; None where it says nothing or says it too late."""
        if self.finished is None or self.wall_s > deadline_s(self.budget_s):
            return None
        if self.finished.outcome is Outcome.OPTIMAL and self.finished.lower_bound_ms is None:
            return self.makespan_ms
        return self.finished.lower_bound_ms

    def within_s(self, limit_ms: float) -> float | None:
        """Return when the first plan came that takes no longer than `limit_ms`."""
        return next((arrival.elapsed_s for arrival in self.arrivals if arrival.makespan_ms <= limit_ms), None)


@dataclass(frozen=True, slots=True, kw_only=True)
class Round:
    """All runs on one instance, and the best that is known after them; None if no plan was ever found."""

    instance: Instance
    best: Best | None
    runs: tuple[EngineRun, ...]


def deadline_s(budget_s: float) -> float:
    """Return until when plans count."""
    return budget_s + GRACE_S + GRACE_SHARE * budget_s


def contenders(names: Iterable[str] = ()) -> tuple[BenchEngine, ...]:
    """Return the engines of these names, or all: as they are, and in parts where missions use them so.

    Raises
    ------
    UsageError
        If there is none of a name.
    """
    everyone = [*ENGINES, *(name + IN_PARTS for name in PART_SIZES)]
    return tuple(_contender(name) for name in names or sorted(everyone))


def _contender(name: str) -> BenchEngine:
    inner = name.removesuffix(IN_PARTS)
    split = name != inner and inner in PART_SIZES
    missing = engine(inner if split else name).info.missing
    if split:
        return BenchEngine(name=name, make=lambda s: mission_engine(inner, Budget(seconds=s)), missing=missing)
    return BenchEngine(name=name, make=lambda _: engine(name), missing=missing)


def warm_up(contender: BenchEngine, clock: Callable[[], float] = time.perf_counter) -> None:
    """Let an engine compile and import what it needs: on small instances, until it keeps a budget or never will."""
    for name in WARM_UP:
        for _ in range(WARM_UPS):
            if run(INSTANCES[name], contender, WARM_UP_S, clock).wall_s <= WARM_UP_S + WARM_UP_OVER_S:
                break


def play(
    instance: Instance,
    engines: Iterable[BenchEngine],
    budgets_s: Iterable[float],
    known: Best | None,
    tell: Callable[[EngineRun], None],
) -> Round:
    """Return the runs of every engine within every budget; each is told as it is done.

    What is known only gets better: shorter plans, and higher bounds of engines that name one.
    """
    runs = []
    for budget_s in budgets_s:
        for contender in engines:
            runs.append(run(instance, contender, budget_s))
            tell(runs[-1])
    return Round(instance=instance, best=improved(known, instance.situation(), runs), runs=tuple(runs))


def improved(known: Best | None, situation: Situation, runs: Iterable[EngineRun]) -> Best | None:
    """Return the best plan and bound known after these runs."""
    runs = tuple(runs)
    for done in runs:
        if done.plan is not None:
            known = with_plan(known, situation, done.plan, done.engine)
    for done in runs:
        if known is not None and done.finished is not None and done.finished.lower_bound_ms is not None:
            known = with_bound(known, done.finished.lower_bound_ms, done.engine)
    return known


def run(
    instance: Instance, contender: BenchEngine, budget_s: float, clock: Callable[[], float] = time.perf_counter
) -> EngineRun:
    """Ask an engine for plans until the deadline, then check those that came in time; `clock` gives seconds."""
    situation = instance.situation()
    came, finished, wall_s = _answers(contender.make(budget_s), situation, budget_s, clock)
    timely = [(at, plan) for at, plan in came if at <= deadline_s(budget_s)]
    incumbent = Incumbent(situation, partial=True)
    better = [(at, plan) for at, plan in timely if incumbent.take(plan)]
    whole = [(at, plan) for at, plan in better if len(plan.explored) == len(situation.targets)]
    return EngineRun(
        instance=instance.name,
        engine=contender.name,
        budget_s=budget_s,
        arrivals=tuple(Arrival(elapsed_s=at, makespan_ms=plan.makespan_ms) for at, plan in whole),
        plan=whole[-1][1] if whole else None,
        served=0 if incumbent.plan is None else len(incumbent.plan.explored),
        refused=len(incumbent.refused),
        late=len(came) - len(timely),
        finished=finished,
        wall_s=wall_s,
    )


def _answers(
    asked: Engine, situation: Situation, budget_s: float, clock: Callable[[], float]
) -> tuple[list[tuple[float, Plan]], Finished | None, float]:
    """Return an engine's plans, each with the seconds until it came, how it ended, and the seconds it took."""
    came: list[tuple[float, Plan]] = []
    finished: Finished | None = None
    begun = clock()
    try:
        with closing(engine_events(asked, situation, Budget(seconds=budget_s))) as events:
            for event in events:
                now = clock() - begun
                if isinstance(event, Finished):
                    finished = event
                else:
                    came.append((now, event.plan))
                if now > deadline_s(budget_s):
                    break
    except Exception as error:  # a broken engine is a result: the bench goes on to the next
        finished = Finished(outcome=Outcome.CRASHED, detail=f"{type(error).__name__}: {error}")
    return came, finished, clock() - begun
