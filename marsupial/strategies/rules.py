"""What strategies have in common that follow rules and ask no planner.

While targets are left each explores by rules of its own. Once none is, rovers are picked up and carriers drive home by
list scheduling, as no strategy of the literature treats that.
"""

from __future__ import annotations

from collections.abc import Callable
from time import perf_counter

from marsupial.model.plan import Plan
from marsupial.model.planning import Outcome
from marsupial.model.strategy import Briefing, Decision, PlanningReport
from marsupial.planning.list_scheduling.greedy import serve

Rule = Callable[[Briefing], tuple[Plan, frozenset[str]]]
"""Makes a plan for a briefing with targets, and names those it has no way to explore."""


def decide_by(name: str, explore: Rule, briefing: Briefing) -> Decision:
    """Return what the strategy `name` decides: by its rule `explore` while targets are left, else to recover."""
    began = perf_counter()
    plan, stuck = explore(briefing) if briefing.situation.targets else serve(briefing.situation)
    wall = perf_counter() - began
    outcome = Outcome.SATISFICING if plan.actions else Outcome.NO_PLAN
    detail = f"no way to explore {', '.join(sorted(stuck))}" if stuck else ""
    report = PlanningReport(planner=name, outcome=outcome, wall_s=wall, first_plan_s=wall, detail=detail)
    return Decision(plan=plan, report=report)
