"""The temporal strategy: asks a planner for concurrent plans that weigh deploying and retrieving against driving.

The engine's best plan that the checker accepts is followed; what is left of the plan so far stays where it is at least
as good. An engine without an answer is covered by the greedy one, so that robots never wait for a planner.

References
----------
Wurm et al. 2010, sections III-A (the loop) and III-C (the planning problem).
"""

from __future__ import annotations

from collections.abc import Iterator
from time import perf_counter

from marsupial.model.plan import Plan
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
        for event in self._events(situation, _complete(situation, briefing.previous)):
            if isinstance(event, Finished):
                last = event
            elif not _acceptable(situation, event.plan):
                refused += 1
            else:
                best = event.plan
                first = event.elapsed_s if first is None else first
        plan, detail = self._choose(briefing, best, last)
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

    def _choose(self, briefing: Briefing, best: Plan | None, last: Finished) -> tuple[Plan, str]:
        previous = briefing.previous
        if best is not None:
            return (previous if previous is not None and _as_good(briefing.situation, previous, best) else best), ""
        plan, unserved = serve(briefing.situation)
        detail = f"{self._engine.info.name}: {last.outcome}{f' ({last.detail})' if last.detail else ''}"
        if unserved:
            detail += f"; nobody can serve {', '.join(sorted(unserved))}"
        if previous is not None and previous.explored >= plan.explored and _as_good(briefing.situation, previous, plan):
            plan = previous
        return plan, detail


def _acceptable(situation: Situation, plan: Plan) -> bool:
    """Say whether a plan may be followed: valid for the targets it explores, and for the rest of the goal."""
    return bool(plan.actions) and check(situation, plan, targets=plan.explored).valid


def _complete(situation: Situation, plan: Plan | None) -> Plan | None:
    """Return `plan` if it reaches the whole goal."""
    return plan if plan is not None and check(situation, plan).valid else None


def _as_good(situation: Situation, plan: Plan, other: Plan) -> bool:
    """Say whether `plan` does all that `other` does, as fast."""
    return (
        plan.explored >= other.explored
        and plan.makespan_ms <= other.makespan_ms
        and check(situation, plan, targets=plan.explored).valid
    )


def _wanting(situation: Situation) -> bool:
    return situation.goal.recover_rovers or situation.goal.return_home
