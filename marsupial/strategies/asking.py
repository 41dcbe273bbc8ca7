"""The common part of strategies that ask a planner: the request, and the report of its result.

Robots always follow the first of equal plans, so the previous plan comes first. List scheduling completes plans that
omit targets, and finds the targets that no robot can serve: an engine would have no plan for a problem with those.
"""

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from time import perf_counter

from marsupial.model.objective import MAKESPAN, Objective
from marsupial.model.plan import Plan
from marsupial.model.planning import Budget, Engine, EngineInfo, Finished, Outcome
from marsupial.model.situation import Situation
from marsupial.model.strategy import Briefing, Decision, PlanningReport
from marsupial.planning.checker import check
from marsupial.planning.incumbent import Incumbent
from marsupial.planning.list_scheduling.greedy import Listing

NO_ANSWER = Finished(outcome=Outcome.NO_PLAN)

Served = tuple[Plan, frozenset[str]]
"""A plan and the targets that it omits."""


@dataclass(frozen=True, slots=True, kw_only=True)
class EngineAnswer:
    """An engine's answer: its best plan, the number of invalid ones, when the first new one came, the last event."""

    plan: Plan | None = None
    refused: int = 0
    first_s: float | None = None
    end: Finished = NO_ANSWER


Explored = tuple[Plan, frozenset[str], EngineAnswer]
"""The plan to follow, the targets that no robot can serve, and the engine's answer."""


class AskedPlanner:
    """An engine with its budget for each call."""

    def __init__(self, engine: Engine, budget: Budget) -> None:
        self._engine = engine
        self.budget = budget

    @property
    def info(self) -> EngineInfo:
        return self._engine.info

    def decide(self, briefing: Briefing, explore: Callable[[Briefing], Explored]) -> Decision:
        """Return the decision: by `explore` while targets are left, else the shortest plan that ends the mission."""
        began = perf_counter()
        decide = explore if briefing.situation.targets else self._finish
        plan, unserved, answer = decide(briefing)
        end, detail = answer.end, ""
        if answer.plan is None or not answer.plan.actions:
            detail = f"{self.info.name}: {end.outcome}{f' ({end.detail})' if end.detail else ''}"
        if unserved:
            detail += f"; nobody can serve {', '.join(sorted(unserved))}"
        report = PlanningReport(
            planner=self.info.name,
            outcome=end.outcome,
            wall_s=perf_counter() - began,
            first_plan_s=answer.first_s,
            refused=answer.refused,
            detail=detail,
        )
        return Decision(plan=plan, report=report)

    def _finish(self, briefing: Briefing) -> Explored:
        """Return the shortest plan that recovers rovers or brings carriers home, as the goal asks."""
        situation, answer = briefing.situation, EngineAnswer()
        listing = Listing(situation)
        kept = completed(listing, briefing.previous)
        if situation.goal.aboard:
            answer = self.ask(situation, MAKESPAN, shortest(situation, kept))
        found = [*kept, *completed(listing, answer.plan), listing.serve()]
        plan, unserved = min(found, key=lambda served: (not check(situation, served[0]).valid, served[0].makespan_ms))
        return plan, unserved, answer

    def ask(self, situation: Situation, objective: Objective, start: Plan | None) -> EngineAnswer:
        """Ask the engine for plans by this objective, or by makespan if it does not support the objective."""
        asked = objective if objective.name in self._engine.info.objectives else MAKESPAN
        # a completed plan may still miss targets or rovers, and engines may rely on a valid start
        if start is not None and not check(situation, start).valid:
            start = None
        incumbent = Incumbent(situation, asked, partial=True)
        first_s, end = None, NO_ANSWER
        for event in self._engine.solve(situation, self.budget, objective=asked, start=start):
            if isinstance(event, Finished):
                end = event
            elif incumbent.take(event.plan) and first_s is None and event.plan != start:
                first_s = event.elapsed_s
        return EngineAnswer(plan=incumbent.plan, refused=len(incumbent.refused), first_s=first_s, end=end)


def completed(listing: Listing, *plans: Plan | None) -> list[Served]:
    """Return the plans that are not None, each completed with the targets that it omits."""
    return [listing.serve(plan) for plan in plans if plan is not None]


def shortest(situation: Situation, plans: Iterable[Served]) -> Plan | None:
    """Return the shortest plan that reaches the whole goal, or None."""
    whole = (plan for plan, _ in plans if check(situation, plan).valid)
    return min(whole, key=lambda plan: plan.makespan_ms, default=None)


def without(situation: Situation, targets: frozenset[str]) -> Situation:
    """Return the situation without these targets."""
    if not targets:
        return situation
    return situation.restricted(targets=frozenset(situation.target_by_name) - targets)
