"""Run every planner on every instance of the suite with the same budgets, in this process and warmed up.

The bench uses its own clock. It counts a plan only if it arrives by the deadline and our checker accepts it, and checks
after the run, so that checking takes no time from the engine. Ratios are to the best known plan, including this run's.
"""

import time
from collections.abc import Callable, Iterable
from contextlib import closing
from dataclasses import dataclass
from typing import NamedTuple

from marsupial.bench.suite.best import Best, with_bound, with_plan
from marsupial.bench.suite.catalogue import INSTANCES, Instance
from marsupial.library.plans import engine_events
from marsupial.model import Budget, Engine, Finished, Outcome, Plan, Situation
from marsupial.planning.engines import ENGINES, PART_SIZES, engine, mission_engine
from marsupial.planning.incumbent import Incumbent

BUDGETS_S = (0.1, 1.0, 10.0)
IN_PARTS = " in parts"
WARM_UP = ("pressure-1x1-3", "in-flight-3x2-12")
# Runs of half a second, until one ends at most a quarter of a second late: then nothing is compiled any more.
WARM_UP_S, WARM_UP_OVER_S, WARM_UPS = 0.5, 0.25, 6
CLOSE = 1.01  # greatest ratio to the best makespan that counts as close

# Tolerance after the budget, in seconds and as a share of it: plans in transit, and noise of the machine.
GRACE_S, GRACE_SHARE = 0.01, 0.02


@dataclass(frozen=True, slots=True, kw_only=True)
class BenchEngine:
    """An engine in the bench. `make` takes the budget in seconds; `missing` is the reason if it can't be used here."""

    name: str
    make: Callable[[float], Engine]
    missing: str | None


class Arrival(NamedTuple):
    """A plan for all targets that arrived in time and became the incumbent; the time is since the engine was asked."""

    elapsed_s: float
    makespan_ms: int


@dataclass(frozen=True, slots=True, kw_only=True)
class EngineRun:
    """One engine on one instance."""

    instance: str
    engine: str
    budget_s: float
    # arrivals, plan: the incumbents that arrived in time, each better than the one before, and the last one
    arrivals: tuple[Arrival, ...]
    plan: Plan | None
    served: int  # most targets explored by any plan, partial plans included
    # refused, late: numbers of plans that the checker refused, and that arrived too late
    refused: int
    late: int
    finished: Finished | None  # None if the engine had to be stopped
    wall_s: float  # time until the engine finished or was stopped

    @property
    def makespan_ms(self) -> int | None:
        return None if self.plan is None else self.plan.makespan_ms

    @property
    def bound_ms(self) -> int | None:
        """The engine's lower bound of the makespan; None if it gave none in time."""
        if self.finished is None or self.wall_s > deadline_s(self.budget_s):
            return None
        if self.finished.outcome is Outcome.OPTIMAL and self.finished.lower_bound_ms is None:
            return self.makespan_ms
        return self.finished.lower_bound_ms


@dataclass(frozen=True, slots=True, kw_only=True)
class Round:
    """All runs on one instance, and the best plan known after them, if any."""

    instance: Instance
    best: Best | None
    runs: tuple[EngineRun, ...]


def deadline_s(budget_s: float) -> float:
    """Return the time by which plans must arrive to count."""
    return budget_s + GRACE_S + GRACE_SHARE * budget_s


def contenders(names: Iterable[str] = ()) -> tuple[BenchEngine, ...]:
    """Return the named engines, or all: each alone, and in parts if missions use it so."""
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
    """Run an engine on small instances until it has compiled and imported everything and keeps its budget."""
    for name in WARM_UP:
        for _ in range(WARM_UPS):
            if run(INSTANCES[name], contender, WARM_UP_S, clock).wall_s <= WARM_UP_S + WARM_UP_OVER_S:
                break


def play(
    instance: Instance,
    engines: Iterable[BenchEngine],
    budgets_s: Iterable[float],
    known: Best | None,
    report: Callable[[EngineRun], None],
) -> Round:
    """Run every engine with every budget, calling `report` after each run."""
    # The best known plan only improves: by shorter plans and by higher bounds.
    runs = []
    for budget_s in budgets_s:
        for contender in engines:
            runs.append(run(instance, contender, budget_s))
            report(runs[-1])
    return Round(instance=instance, best=improved(known, instance.situation(), runs), runs=tuple(runs))


def improved(known: Best | None, situation: Situation, runs: Iterable[EngineRun]) -> Best | None:
    """Return the best known plan and bound after these runs."""
    runs = tuple(runs)
    for done in runs:
        if done.plan is not None:
            known = with_plan(known, situation, done.plan, done.engine)
    # bounds after plans: a plan of this round may refute one
    for done in runs:
        if known is not None and done.finished is not None and done.finished.lower_bound_ms is not None:
            known = with_bound(known, done.finished.lower_bound_ms, done.engine)
    return known


def run(
    instance: Instance, contender: BenchEngine, budget_s: float, clock: Callable[[], float] = time.perf_counter
) -> EngineRun:
    """Ask an engine for plans until the deadline, then check those that arrived in time; `clock` returns seconds."""
    situation = instance.situation()
    came, finished, wall_s = _answers(contender.make(budget_s), situation, budget_s, clock)
    timely = [(at, plan) for at, plan in came if at <= deadline_s(budget_s)]
    # checked here, after the run, so that checking costs the engine no time
    incumbent = Incumbent(situation, partial=True)
    better = [(at, plan) for at, plan in timely if incumbent.take(plan)]
    whole = [(at, plan) for at, plan in better if len(plan.explored) == len(situation.targets)]
    return EngineRun(
        instance=instance.name,
        engine=contender.name,
        budget_s=budget_s,
        arrivals=tuple(Arrival(at, plan.makespan_ms) for at, plan in whole),
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
    """Return an engine's plans with their arrival times, how it ended, and how many seconds it ran."""
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
    except Exception as error:  # a crash is a result too: the bench continues
        finished = Finished(outcome=Outcome.CRASHED, detail=f"{type(error).__name__}: {error}")
    return came, finished, clock() - begun
