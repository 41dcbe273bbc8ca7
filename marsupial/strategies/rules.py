"""The common part of strategies that follow rules instead of asking a planner.

While targets are left, each explores by its own rule. Afterwards all recover rovers and drive home by list scheduling,
since the literature's strategies do not cover that.
"""

from time import perf_counter

from marsupial.model import Briefing, Decision, Outcome, Plan, PlanningReport, Strategy
from marsupial.planning.greedy import serve


class RuleStrategy(Strategy):
    """Base of strategies that explore by a rule."""

    def explore(self, briefing: Briefing) -> tuple[Plan, frozenset[str]]:
        """Return a plan for a briefing with targets, and the targets that the plan can't explore."""
        raise NotImplementedError

    def decide(self, briefing: Briefing) -> Decision:
        began = perf_counter()
        plan, stuck = self.explore(briefing) if briefing.situation.targets else serve(briefing.situation)
        wall = perf_counter() - began
        outcome = Outcome.SATISFICING if plan.actions else Outcome.NO_PLAN
        detail = f"no way to explore {', '.join(sorted(stuck))}" if stuck else ""
        report = PlanningReport(planner=self.name, outcome=outcome, wall_s=wall, first_plan_s=wall, detail=detail)
        return Decision(plan=plan, report=report)
