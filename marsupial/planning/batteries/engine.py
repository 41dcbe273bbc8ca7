"""Engines that know no batteries, made to plan for situations with batteries.

The engine plans as if batteries had no limit, and each of its plans is changed so that they suffice
(`marsupial.planning.batteries.repair`). Without the limit no plan takes longer, so its bounds stay bounds, and
its proof that there is no plan stays a proof.
"""

from collections.abc import Callable, Iterator
from dataclasses import replace

from marsupial.model import (
    MAKESPAN,
    Budget,
    Engine,
    EngineInfo,
    Finished,
    Improved,
    Objective,
    Outcome,
    Plan,
    Situation,
)
from marsupial.planning.checker import check
from marsupial.planning.external.process_engine import ProcessEngine
from marsupial.planning.incumbent import Incumbent

SolveMethod = Callable[..., Iterator[Improved | Finished]]  # as `Engine.solve`


def keeping(situation: Situation) -> list[Callable[[Plan], Plan]]:
    """Return the ways to change a plan that is valid without limits of batteries so that they suffice."""
    from marsupial.planning.batteries.repair import RESERVE, BatteryPlanner  # imports numba

    return [BatteryPlanner(situation, reserve).kept for reserve in (RESERVE, 0.0)]


class BatteryEngine:
    """An engine for all situations, by one that ignores batteries."""

    def __init__(self, engine: Engine) -> None:
        self._engine = engine

    @property
    def info(self) -> EngineInfo:
        return self._engine.info

    def solve(
        self, situation: Situation, budget: Budget, *, objective: Objective = MAKESPAN, start: Plan | None = None
    ) -> Iterator[Improved | Finished]:
        return self._solve(self._engine.solve, situation, budget, objective, start)

    def solve_here(
        self, situation: Situation, budget: Budget, *, objective: Objective = MAKESPAN, start: Plan | None = None
    ) -> Iterator[Improved | Finished]:
        """Solve in this process, also with an engine that otherwise has one of its own."""
        search = self._engine.solve_here if isinstance(self._engine, ProcessEngine) else self._engine.solve
        return self._solve(search, situation, budget, objective, start)

    def _solve(
        self, search: SolveMethod, situation: Situation, budget: Budget, objective: Objective, start: Plan | None
    ) -> Iterator[Improved | Finished]:
        if not situation.batteries:
            return search(situation, budget, objective=objective, start=start)
        return self._with_batteries(search, situation, budget, objective, start)

    def _with_batteries(
        self, search: SolveMethod, situation: Situation, budget: Budget, objective: Objective, start: Plan | None
    ) -> Iterator[Improved | Finished]:
        best, unlimited = Incumbent(situation, objective), situation.without_batteries()
        changes = keeping(situation)
        reached = None  # the best value without the limit
        for event in search(unlimited, budget, objective=objective, start=start):
            if isinstance(event, Finished):
                yield _ended(event, best, proven=best.value is not None and best.value == reached)
                return
            if not check(unlimited, event.plan).valid:
                yield event  # to be refused
                continue
            reached = objective.value(situation, event.plan)
            better = [best.take(kept(event.plan)) for kept in changes]
            if any(better) and best.plan is not None:
                yield replace(event, plan=best.plan)


def _ended(event: Finished, best: Incumbent, *, proven: bool) -> Finished:
    if best.plan is not None and event.outcome is Outcome.OPTIMAL and not proven:
        return replace(event, outcome=Outcome.SATISFICING, detail="optimal without limits of batteries")
    if best.plan is None and event.outcome in (Outcome.OPTIMAL, Outcome.SATISFICING):
        return replace(event, outcome=Outcome.NO_PLAN, detail="found no plan that batteries suffice for")
    return event
