"""The temporal strategy: asks a planner for concurrent plans that weigh deploying and retrieving against driving.

The shortest plan for the targets known is not what explores an unknown map soonest: most of the work has yet to turn
up. So plans are made for a guess of all that may still have to be done (`marsupial.strategies.guess`), and the
objective is priced arrival: the better plan is the one that reaches what is worth most sooner, with some weight on the
makespan, on driving, and on setting rovers down, which have to be picked up again.

By this objective the best is followed of the engine's plan, what is left of the plan so far, the deployment
heuristic's and the greedy one, all of which the greedy planner completes. Engines that can take the objective plan for
the guess. The others are asked for the shortest plan for the targets known: by makespan alone, the guess made missions
longer rather than shorter (docs/strategies.md). No robot waits for a planner: without an answer in time one of the
other plans is the best.

Teams without rovers are told anew where to go as soon as they know what is behind a frontier, and their targets are
whole frontiers, each at its cell that is nearest to a robot: so they waste no way on what is seen already. Robots that
see no farther than the next cells have ground to cover, rather than frontiers to look behind. They follow ways that see
everything, with the unknown taken for free ground (`marsupial.strategies.frontier.covering`); the search for them plans
with the same annealing, and is kept to small maps.

Once no target is left, the engine is asked for the shortest plan that recovers the rovers or brings the team home.

References
----------
Wurm et al. 2010, sections III-A (the loop) and III-C (the planning problem).
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from time import perf_counter

from marsupial.model.grid import Cell, Grid
from marsupial.model.objective import MAKESPAN, Objective, ObjectiveName, PricedArrival, Value
from marsupial.model.plan import Plan
from marsupial.model.planning import Budget, Engine, Finished, Outcome
from marsupial.model.robots import RobotType, Role
from marsupial.model.scenario import Goal
from marsupial.model.situation import Situation
from marsupial.model.strategy import Briefing, Decision, PlanningReport
from marsupial.model.world import World
from marsupial.planning.checker import check
from marsupial.planning.incumbent import Incumbent
from marsupial.planning.list_scheduling.greedy import Listing
from marsupial.strategies.frontier.arrival import OnArrival, WholeFrontiers
from marsupial.strategies.frontier.covering import Covering
from marsupial.strategies.frontier.exploration import FrontierStrategy
from marsupial.strategies.guess import guess
from marsupial.strategies.heuristic import Heuristic

MAKESPAN_SHARE, DRIVING, UNDOCKING_MS = 0.3, 0.15, 40_000
"""The prices of a ms of the makespan (as a share of what all targets are worth), of a ms of driving, of setting a
rover down, where a ms until a target is reached costs 1."""

NEAR_CELLS, MOST_CELLS = 2.0, 12_000
"""Ways that see everything are searched for if no robot sees as far as so many cells, on maps of so many at most."""

ROUNDS_PER_STEP = 0.5
"""Of that search, for each step of the budget of a planning."""

Served = tuple[Plan, frozenset[str]]
"""A plan and the targets it leaves out."""


class Temporal:
    """Follows the best plan for the guess of what is to be done.

    Parameters
    ----------
    engine
        Asked at each replanning.
    budget
        For each replanning.
    """

    name = "temporal"

    def __init__(self, engine: Engine, budget: Budget) -> None:
        self._engine = engine
        self._budget = budget
        self._covering: FrontierStrategy | None = None

    def replanning(
        self, world: World, kinds: Mapping[str, RobotType], homes: Mapping[str, Cell], goal: Goal
    ) -> OnArrival | None:
        """Return when to plan anew, and from what, for a team without rovers; None for others."""
        team = {robot.type: kinds[robot.type] for robot in world.robots()}
        if any(kind.role is Role.ROVER for kind in team.values()):
            return None
        if not self._covers(world.grid, team):
            return WholeFrontiers(world, kinds, homes, goal)
        steps, seconds = self._budget.steps, self._budget.seconds
        covering = Covering(
            rounds=math.inf if steps is None else max(1.0, ROUNDS_PER_STEP * steps),
            seconds=math.inf if seconds is None else seconds,
        )
        self._covering = FrontierStrategy(covering, self.name)
        return self._covering.replanning(world, kinds, homes, goal)

    def _covers(self, grid: Grid, team: Mapping[str, RobotType]) -> bool:
        """Say whether ways that see everything are searched for."""
        able = ObjectiveName.PRICED_ARRIVAL in self._engine.info.objectives
        near = all(kind.sensor_range_m < NEAR_CELLS * grid.resolution_m for kind in team.values())
        return able and near and grid.cells.size <= MOST_CELLS

    def decide(self, briefing: Briefing) -> Decision:
        """Return the best plan: the engine's, what is left of the previous one, the heuristic or the greedy one."""
        if self._covering is not None:
            return self._covering.decide(briefing)
        began = perf_counter()
        decide = self._explore if briefing.situation.targets else self._finish
        plan, unserved, answer = decide(briefing)
        end, detail = answer.end, ""
        if answer.plan is None or not answer.plan.actions:
            detail = f"{self._engine.info.name}: {end.outcome}{f' ({end.detail})' if end.detail else ''}"
        if unserved:
            detail += f"; nobody can serve {', '.join(sorted(unserved))}"
        report = PlanningReport(
            planner=self._engine.info.name,
            outcome=end.outcome,
            wall_s=perf_counter() - began,
            first_plan_s=answer.first_s,
            refused=answer.refused,
            detail=detail,
        )
        return Decision(plan=plan, report=report)

    def _explore(self, briefing: Briefing) -> tuple[Plan, frozenset[str], _EngineResult]:
        """Return what is real of the best plan for the guess, and the real targets that no robot can serve."""
        guessed, known = guess(briefing), briefing.situation
        situation = guessed.situation
        objective = PricedArrival(
            worth=guessed.worth, makespan=MAKESPAN_SHARE, driving=DRIVING, undocking_ms=UNDOCKING_MS
        )

        def rank(served: Served) -> tuple[int, Value]:
            plan, unserved = served
            return len(unserved), objective.value(situation, plan)

        listing = Listing(situation)
        previous, baseline = briefing.previous, _baseline(briefing)
        kept, others = _served(listing, previous), [*_served(listing, baseline), listing.serve()]
        if objective.name in self._engine.info.objectives:
            plan, unserved = min(kept + others, key=rank)
            answer = self._ask(_without(situation, unserved), objective, plan)
        else:
            served = _served(Listing(known), previous, baseline)
            answer = self._ask(known, objective, _shortest(known, served))
        plan, unserved = min(kept + _served(listing, answer.plan) + others, key=rank)
        return guessed.real_part(plan), unserved & known.target_by_name.keys(), answer

    def _finish(self, briefing: Briefing) -> tuple[Plan, frozenset[str], _EngineResult]:
        """Return the shortest plan that recovers rovers and brings carriers home, as far as that is asked for.

        Of plans as short the previous one is kept.
        """
        situation, answer = briefing.situation, _EngineResult()
        listing = Listing(situation)
        kept = _served(listing, briefing.previous)
        if situation.goal.recover_rovers or situation.goal.return_home:
            answer = self._ask(situation, MAKESPAN, _shortest(situation, kept))
        found = [*kept, *_served(listing, answer.plan), listing.serve()]
        plan, unserved = min(found, key=lambda served: (not check(situation, served[0]).valid, served[0].makespan_ms))
        return plan, unserved, answer

    def _ask(self, situation: Situation, objective: Objective, start: Plan | None) -> _EngineResult:
        """Ask the engine for plans that get better by an objective, or by makespan if that is all it can take."""
        asked = objective if objective.name in self._engine.info.objectives else MAKESPAN
        if start is not None and not check(situation, start).valid:
            start = None
        incumbent = Incumbent(situation, asked, partial=True)
        first_s, end = None, NO_ANSWER
        for event in self._engine.solve(situation, self._budget, objective=asked, start=start):
            if isinstance(event, Finished):
                end = event
            elif incumbent.take(event.plan) and first_s is None and event.plan != start:
                first_s = event.elapsed_s
        return _EngineResult(plan=incumbent.plan, refused=len(incumbent.refused), first_s=first_s, end=end)


NO_ANSWER = Finished(outcome=Outcome.NO_PLAN)


@dataclass(frozen=True, slots=True, kw_only=True)
class _EngineResult:
    """What an engine said: its best plan, how many the checker refuses, when the first new one came, the end."""

    plan: Plan | None = None
    refused: int = 0
    first_s: float | None = None
    end: Finished = NO_ANSWER


def _baseline(briefing: Briefing) -> Plan | None:
    plan = Heuristic().decide(briefing).plan
    usable = plan.actions and check(briefing.situation, plan, targets=plan.explored).valid
    return plan if usable else None


def _served(listing: Listing, *plans: Plan | None) -> list[Served]:
    """Return the plans there are with what they leave of the goal added at their ends, as far as can be."""
    return [listing.serve(plan) for plan in plans if plan is not None]


def _shortest(situation: Situation, served: Iterable[Served]) -> Plan | None:
    """Return the shortest of the plans that reach the whole goal, if any does."""
    whole = (plan for plan, _ in served if check(situation, plan).valid)
    return min(whole, key=lambda plan: plan.makespan_ms, default=None)


def _without(situation: Situation, targets: frozenset[str]) -> Situation:
    if not targets:
        return situation
    return situation.restricted(targets=frozenset(situation.target_by_name) - targets)
