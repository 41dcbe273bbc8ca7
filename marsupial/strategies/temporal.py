"""The temporal strategy: asks a planner for concurrent plans that weigh deploying and retrieving against driving.

The engine's best plan that the checker accepts is followed, unless what is left of the plan so far is as good. The
engine begins from the better of that and the deployment heuristic's plan. An engine that plans only a part of a large
situation, or has no answer in time, is helped by the greedy one, which adds what is left, so that no robot waits for
a planner.

References
----------
Wurm et al. 2010, sections III-A (the loop) and III-C (the planning problem).
"""

from __future__ import annotations

from collections.abc import Iterator
from time import perf_counter

from marsupial.model.plan import ActionName, Plan
from marsupial.model.planning import Budget, Engine, Finished, Improved, Outcome
from marsupial.model.situation import Situation
from marsupial.model.strategy import Briefing, Decision, PlanningReport
from marsupial.planning.checker import check
from marsupial.planning.greedy import serve
from marsupial.strategies.heuristic import Heuristic

Served = tuple[Plan, frozenset[str]]
"""A plan and the targets it leaves out."""


class Temporal:
    """Follows the best plan an engine finds within a budget.

    Parameters
    ----------
    engine
        Asked anew at each replanning.
    budget
        For each replanning.
    """

    name = "temporal"

    def __init__(self, engine: Engine, budget: Budget) -> None:
        self._engine = engine
        self._budget = budget

    def decide(self, briefing: Briefing) -> Decision:
        """Return the best checked plan: the engine's, the previous one's remainder, the heuristic or the greedy one."""
        began = perf_counter()
        situation = briefing.situation
        best: Plan | None = None
        first: float | None = None
        refused = 0
        last = Finished(outcome=Outcome.NO_PLAN)
        previous, baseline = _continued(situation, briefing.previous), _continued(situation, _baseline(briefing))
        start = _start(situation, previous + baseline)
        for event in self._events(situation, start):
            if isinstance(event, Finished):
                last = event
            elif event.plan != start and not check(situation, event.plan, targets=event.plan.explored).valid:
                refused += 1
            elif event.plan.actions:
                best = event.plan
                if first is None and event.plan != start:
                    first = event.elapsed_s
        found = [] if best == start else _continued(situation, best)
        plan, unserved = min(previous + found + baseline + [serve(situation)], key=_rank)
        detail = "" if best else f"{self._engine.info.name}: {last.outcome}{f' ({last.detail})' if last.detail else ''}"
        if unserved:
            detail += f"; nobody can serve {', '.join(sorted(unserved))}"
        report = PlanningReport(
            planner=self._engine.info.name,
            outcome=last.outcome,
            wall_s=perf_counter() - began,
            first_plan_s=first,
            refused=refused,
            detail=detail,
        )
        return Decision(plan=plan, report=report)

    def _events(self, situation: Situation, start: Plan | None) -> Iterator[Improved | Finished]:
        if not situation.targets and not _wanting(situation):
            return iter(())
        return self._engine.solve(situation, self._budget, start=start)


def _baseline(briefing: Briefing) -> Plan | None:
    """Return the deployment heuristic's plan, if there is something to explore."""
    plan = Heuristic().decide(briefing).plan if briefing.situation.targets else Plan(actions=())
    usable = plan.actions and check(briefing.situation, plan, targets=plan.explored).valid
    return plan if usable else None


def _continued(situation: Situation, plan: Plan | None) -> list[Served]:
    """Return a plan, if there is one, with what it leaves of the goal added at its end as far as can be."""
    return [] if plan is None else [serve(situation, plan)]


def _start(situation: Situation, candidates: list[Served]) -> Plan | None:
    """Return the best of the plans that reach the whole goal, the first among equals."""
    whole = (plan for plan, unserved in sorted(candidates, key=_rank) if check(situation, plan).valid)
    return next(whole, None)


def _rank(served: Served) -> tuple[int, int, int]:
    """Order plans by the targets left out, the makespan, the sum of the times at which targets are reached."""
    plan, unserved = served
    return len(unserved), plan.makespan_ms, _target_times_ms(plan)


def _target_times_ms(plan: Plan) -> int:
    return sum(action.end_ms for action in plan.actions if action.name is ActionName.EXPLORE)


def _wanting(situation: Situation) -> bool:
    return situation.goal.recover_rovers or situation.goal.return_home
