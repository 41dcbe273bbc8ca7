"""The common part of strategies that follow rules instead of asking a planner.

While targets are left, each explores by its own rule. Afterwards all recover rovers and drive home by list scheduling,
since the literature's strategies do not cover that.
"""

from __future__ import annotations

from collections.abc import Callable
from time import perf_counter

from marsupial.model import Briefing, Decision, Outcome, Plan, PlanningReport
from marsupial.planning.list_scheduling.greedy import serve

Rule = Callable[[Briefing], tuple[Plan, frozenset[str]]]
"""Makes a plan for a briefing with targets; returns it with the targets that it can't explore."""


def decide_by(name: str, explore: Rule, briefing: Briefing) -> Decision:
    """Return the decision of strategy `name`: by its rule `explore` while targets are left, else to recover rovers."""
    began = perf_counter()
    plan, stuck = explore(briefing) if briefing.situation.targets else serve(briefing.situation)
    wall = perf_counter() - began
    outcome = Outcome.SATISFICING if plan.actions else Outcome.NO_PLAN
    detail = f"no way to explore {', '.join(sorted(stuck))}" if stuck else ""
    report = PlanningReport(planner=name, outcome=outcome, wall_s=wall, first_plan_s=wall, detail=detail)
    return Decision(plan=plan, report=report)
