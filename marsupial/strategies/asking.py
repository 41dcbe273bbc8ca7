"""The common part of strategies that ask a planner: the request, and the report of its result.

Robots always follow the first of equal plans, so the previous plan comes first. List scheduling completes plans that
omit targets, and finds the targets that no robot can serve: an engine would have no plan for a problem with those.
"""

from collections.abc import Iterable
from dataclasses import replace
from time import perf_counter
from typing import NamedTuple

from marsupial.model.objective import MAKESPAN, Objective
from marsupial.model.plan import Plan
from marsupial.model.planning import Budget, Engine, Finished, Outcome
from marsupial.model.robots import Role
from marsupial.model.situation import Situation
from marsupial.model.strategy import Briefing, Decision, PlanningReport, Reasons, Strategy
from marsupial.planning.batteries.repair import BatteryPlanner
from marsupial.planning.checker import check
from marsupial.planning.greedy import Listing
from marsupial.planning.incumbent import Incumbent

NO_ANSWER = Finished(outcome=Outcome.NO_PLAN)

Served = tuple[Plan, frozenset[str]]
"""A plan and the targets that it omits."""


class Explored(NamedTuple):
    """The plan to follow, the targets that no robot can serve, the report of the engine's answer, and the reasons."""

    plan: Plan
    unserved: frozenset[str]
    report: PlanningReport
    reasons: Reasons = Reasons()


class PlanningStrategy(Strategy):
    """Base of strategies that ask an engine, with the same budget for each call."""

    asks_planner = True

    def __init__(self, engine: Engine, budget: Budget) -> None:
        self._engine, self._budget = engine, budget

    def explore(self, briefing: Briefing) -> Explored:
        """Return the plan for a briefing with targets."""
        raise NotImplementedError

    def decide(self, briefing: Briefing) -> Decision:
        began = perf_counter()
        explore = self.explore if briefing.situation.targets else self._finish
        plan, unserved, report, reasons = explore(briefing)
        detail = f"{report.detail}; nobody can serve {', '.join(sorted(unserved))}" if unserved else report.detail
        report = replace(report, detail=detail, wall_s=perf_counter() - began)
        return Decision(plan=plan, report=report, reasons=reasons)

    def _finish(self, briefing: Briefing) -> Explored:
        """Return the shortest plan that recovers rovers or brings carriers home, as the goal asks."""
        situation, asked, report = briefing.situation, None, self._report(None, NO_ANSWER)
        listing = Listing(situation)
        kept = completed(listing, briefing.previous)
        if situation.goal.aboard:
            asked, report = self.ask(situation, MAKESPAN, shortest(situation, kept))
        found = [*kept, *completed(listing, asked), listing.serve()]
        plan, unserved = min(found, key=lambda served: (not check(situation, served[0]).valid, served[0].makespan_ms))
        return Explored(plan, unserved, report)

    def ask(self, situation: Situation, objective: Objective, start: Plan | None) -> tuple[Plan | None, PlanningReport]:
        """Ask the engine for plans by this objective, or by makespan if it does not support the objective.

        Return its best plan and a report without the time in total. `start` has to be valid, as engines may rely on
        that.
        """
        asked = objective if objective.name in self._engine.info.objectives else MAKESPAN
        incumbent = Incumbent(situation, asked, partial=True)
        first_s, end = None, NO_ANSWER
        for event in self._engine.solve(situation, self._budget, objective=asked, start=start):
            if isinstance(event, Finished):
                end = event
            elif incumbent.take(event.plan) and first_s is None and event.plan != start:
                first_s = event.elapsed_s
        report = self._report(incumbent.plan, end)
        return incumbent.plan, replace(report, first_plan_s=first_s, refused=len(incumbent.refused))

    def _report(self, plan: Plan | None, end: Finished) -> PlanningReport:
        name, detail = self._engine.info.name, ""
        if plan is None or not plan.actions:
            detail = f"{name}: {end.outcome}{f' ({end.detail})' if end.detail else ''}"
        return PlanningReport(planner=name, outcome=end.outcome, wall_s=0.0, detail=detail)


def completed(listing: Listing, *plans: Plan | None) -> list[Served]:
    """Return the plans that are not None, each completed with the targets that it omits."""
    return [listing.serve(plan) for plan in plans if plan is not None]


def charged(served: Iterable[Served], situation: Situation, known: Situation) -> list[Served]:
    """Return the plans for a situation as the batteries of rovers in the known one allow them.

    Carriers count as without batteries: `situation` may be a guess, and has no charging places.
    """
    kinds, robots = known.type_by_name, known.robot_by_name
    of_rovers = {kind.name: kinds[kind.name].battery for kind in situation.types if kind.role is Role.ROVER}
    limited = replace(
        situation,
        types=tuple(replace(kind, battery=of_rovers.get(kind.name)) for kind in situation.types),
        robots=tuple(
            replace(robot, charge_j=robots[robot.name].charge_j if of_rovers.get(robot.type) else None)
            for robot in situation.robots
        ),
    )
    planner, targets = BatteryPlanner(limited), frozenset(situation.target_by_name)
    # some of the plans are equal
    kept = {plan: planner.kept(plan) for plan in dict.fromkeys(plan for plan, _ in served)}
    return [(kept[plan], targets - kept[plan].explored) for plan, _ in served]


def shortest(situation: Situation, plans: Iterable[Served]) -> Plan | None:
    """Return the shortest plan that reaches the whole goal, or None."""
    whole = (plan for plan, _ in plans if check(situation, plan).valid)
    return min(whole, key=lambda plan: plan.makespan_ms, default=None)


def without(situation: Situation, targets: frozenset[str]) -> Situation:
    """Return the situation without these targets."""
    if not targets:
        return situation
    return situation.restricted(targets=frozenset(situation.target_by_name) - targets)
