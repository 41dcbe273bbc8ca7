"""The temporal strategy: asks a planner for concurrent plans that weigh deploying and retrieving against driving.

The engine's best plan that the checker accepts is followed, unless what is left of the plan so far is as good. An
engine that plans only a part of a large situation, or has no answer in time, is helped by the greedy one, which adds
what is left, so that no robot waits for a planner.

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
        """Return the best checked plan: the engine's, the previous one's remainder, or the greedy one."""
        began = perf_counter()
        situation = briefing.situation
        best: Plan | None = None
        first: float | None = None
        refused = 0
        last = Finished(outcome=Outcome.NO_PLAN)
        start = _continued(situation, briefing.previous)
        for event in self._events(situation, start):
            if isinstance(event, Finished):
                last = event
            elif not check(situation, event.plan, targets=event.plan.explored).valid:
                refused += 1
            elif event.plan.actions:
                best = event.plan
                if first is None and event.plan != start:
                    first = event.elapsed_s
        plan, unserved = _best_of(situation, briefing.previous, best)
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


def _continued(situation: Situation, previous: Plan | None) -> Plan | None:
    """Return the previous plan, with what it leaves added at its end, if that reaches the whole goal."""
    if previous is None:
        return None
    plan, _ = serve(situation, previous)
    return plan if check(situation, plan).valid else None


def _best_of(situation: Situation, *starts: Plan | None) -> tuple[Plan, frozenset[str]]:
    """Return the best way to go on, and the targets it leaves out.

    Every start is continued greedily to the whole goal, and so is an empty one. What counts is in turn the targets
    served, the makespan, and the sum of the times at which targets are reached; earlier ones win ties.
    """
    plans = [serve(situation, start) for start in (*starts, Plan(actions=())) if start is not None]
    return min(plans, key=lambda served: (len(served[1]), served[0].makespan_ms, _target_times_ms(served[0])))


def _target_times_ms(plan: Plan) -> int:
    return sum(action.end_ms for action in plan.actions if action.name is ActionName.EXPLORE)


def _wanting(situation: Situation) -> bool:
    return situation.goal.recover_rovers or situation.goal.return_home
