"""The temporal strategy: asks a planner for concurrent plans that weigh deploying and retrieving against driving.

This is the paper's strategy with two changes: plans are made for known *and* guessed targets, and the objective is
not the makespan alone.

How it works
------------
::

    Briefing ---> guess: known targets + guessed ones in the unknown
                    |
                    v
    candidates:   previous plan, the plans of rules, nothing
                    |  each completed by the greedy planner, so that it serves all targets
                    v
                  best candidate ---> engine.solve(situation, budget, objective, start)
                    |                    |  every improving plan is checked (`Incumbent`); the best one is completed
                    v                    v
                  best of all by (targets unserved, objective)
                    |
                    v
                  real part of that plan ---> Decision

- *Why a guess.* The shortest plan for the known targets does not explore an unknown map fastest, as most of the work
  has yet to turn up (`marsupial.strategies.guess`).
- *The objective* is priced arrival: a plan is better if it reaches valuable targets sooner. Smaller prices are on the
  makespan, on driving, and on setting a rover down: undocking and docking take time, and a carrier has to come back for
  it. If the goal leaves rovers out in the end, that costs nothing.
- *Robots never wait for a planner.* If the engine has no answer within its budget, another candidate is the best plan.
  The previous plan comes first among equals, so robots do not change their minds without a gain.
- *Engines that minimise only the makespan* get the known targets and plan for these: by makespan alone, guessed targets
  made missions longer (docs/strategies.md). All candidates are still compared on the guess.
- *Once no target is left,* the engine is asked for the shortest plan that recovers the rovers or brings the team home.

Teams without rovers need no docking plans, and gain more from replanning often. They replan as soon as they know what
is behind a frontier, and their targets are whole frontiers, each at its cell nearest to a robot (`WholeFrontiers`), so
they do not drive to ground that is seen already. If robots see hardly farther than the next cell, no frontier reveals
much, and the task is to cover ground. On small maps, and unless the engine minimises only the makespan, they then
follow tours that see everything, with the unknown taken as free (`marsupial.strategies.frontier.covering`).

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
from marsupial.model.strategy import Briefing, Decision, PlanningReport, Strategy
from marsupial.model.world import World
from marsupial.planning.checker import check
from marsupial.planning.incumbent import Incumbent
from marsupial.planning.list_scheduling.greedy import Listing
from marsupial.strategies.frontier.arrival import OnArrival, WholeFrontiers
from marsupial.strategies.frontier.covering import Covering
from marsupial.strategies.frontier.exploration import FrontierStrategy
from marsupial.strategies.guess import guess
from marsupial.strategies.heuristic import Heuristic
from marsupial.strategies.one_step import OneStep

MAKESPAN_SHARE, DRIVING = 0.3, 0.15
"""Prices of 1 ms of makespan (as a share of the worth of all targets) and of 1 ms of driving; 1 ms until a real target
is reached costs 1."""

NEAR_CELLS, MOST_CELLS = 2.0, 12_000
"""Covering tours are used if every sensor range is below so many cells, on maps of at most so many cells."""

RULES: tuple[Strategy, ...] = (Heuristic(), OneStep())
"""Strategies whose plans are candidates, so that it can do at least what they see."""

NO_ANSWER = Finished(outcome=Outcome.NO_PLAN)

ROUNDS_PER_STEP = 0.5
"""Rounds of the search for covering tours, for each step of the planning budget."""

Served = tuple[Plan, frozenset[str]]
"""A plan and the targets that it leaves out."""


class Temporal(Strategy):
    """Follows the best plan for known and guessed targets.

    Parameters
    ----------
    engine
        The planner, called at each replanning.
    budget
        Its budget for each call.
    """

    name = "temporal"
    asks_planner = True

    def __init__(self, engine: Engine, budget: Budget) -> None:
        self._engine = engine
        self._budget = budget
        self._covering: FrontierStrategy | None = None
        self._recovers = True

    def replanning(
        self, world: World, kinds: Mapping[str, RobotType], homes: Mapping[str, Cell], goal: Goal
    ) -> OnArrival | None:
        """Return the policy for a team without rovers; None for others."""
        self._recovers = goal.recover_rovers
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
        """Return whether the team follows covering tours."""
        able = ObjectiveName.PRICED_ARRIVAL in self._engine.info.objectives
        near = all(kind.sensor_range_m < NEAR_CELLS * grid.resolution_m for kind in team.values())
        return able and near and grid.cells.size <= MOST_CELLS

    def decide(self, briefing: Briefing) -> Decision:
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
        """Return the real part of the best plan for the guess, the real targets that no robot can serve, the answer."""
        guessed, known = guess(briefing), briefing.situation
        situation = guessed.situation
        handling_ms = [kind.dock_ms + kind.undock_ms for kind in known.types if kind.role is Role.ROVER]
        objective = PricedArrival(
            worth=guessed.worth,
            makespan=MAKESPAN_SHARE,
            driving=DRIVING,
            undocking_ms=max(handling_ms, default=0) if self._recovers else 0,
        )

        def rank(served: Served) -> tuple[int, Value]:
            plan, unserved = served
            return len(unserved), objective.value(situation, plan)

        listing = Listing(situation)
        previous, by_rule = briefing.previous, _by_rule(briefing)
        kept, others = _served(listing, previous), [*_served(listing, *by_rule), listing.serve()]
        if objective.name in self._engine.info.objectives:
            plan, unserved = min(kept + others, key=rank)
            # targets that nobody can serve would make the problem unsolvable for the engine
            answer = self._ask(_without(situation, unserved), objective, plan)
        else:
            served = _served(Listing(known), previous, *by_rule)
            answer = self._ask(known, objective, _shortest(known, served))
        # `min` takes the first of equals: the previous plan, then the engine's
        plan, unserved = min(kept + _served(listing, answer.plan) + others, key=rank)
        return guessed.real_part(plan), unserved & known.target_by_name.keys(), answer

    def _finish(self, briefing: Briefing) -> tuple[Plan, frozenset[str], _EngineResult]:
        """Return the shortest plan that recovers rovers or brings carriers home, as the goal asks."""
        situation, answer = briefing.situation, _EngineResult()
        listing = Listing(situation)
        kept = _served(listing, briefing.previous)
        if situation.goal.recover_rovers or situation.goal.return_home:
            answer = self._ask(situation, MAKESPAN, _shortest(situation, kept))
        found = [*kept, *_served(listing, answer.plan), listing.serve()]
        plan, unserved = min(found, key=lambda served: (not check(situation, served[0]).valid, served[0].makespan_ms))
        return plan, unserved, answer

    def _ask(self, situation: Situation, objective: Objective, start: Plan | None) -> _EngineResult:
        """Ask the engine for plans by this objective, or by makespan if it does not support the objective."""
        asked = objective if objective.name in self._engine.info.objectives else MAKESPAN
        # a completed plan may still miss targets or rovers, and engines may rely on a valid start
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


@dataclass(frozen=True, slots=True, kw_only=True)
class _EngineResult:
    """An engine's answer: its best plan, the number of invalid ones, when the first new one came, the last event."""

    plan: Plan | None = None
    refused: int = 0
    first_s: float | None = None
    end: Finished = NO_ANSWER


def _by_rule(briefing: Briefing) -> list[Plan]:
    """Return the valid plans of the rules."""
    plans = (rule.decide(briefing).plan for rule in RULES)
    return [plan for plan in plans if plan.actions and check(briefing.situation, plan, targets=plan.explored).valid]


def _served(listing: Listing, *plans: Plan | None) -> list[Served]:
    """Return the plans that are not None, each completed with the targets that it leaves out."""
    return [listing.serve(plan) for plan in plans if plan is not None]


def _shortest(situation: Situation, served: Iterable[Served]) -> Plan | None:
    """Return the shortest plan that reaches the whole goal, or None."""
    whole = (plan for plan, _ in served if check(situation, plan).valid)
    return min(whole, key=lambda plan: plan.makespan_ms, default=None)


def _without(situation: Situation, targets: frozenset[str]) -> Situation:
    if not targets:
        return situation
    return situation.restricted(targets=frozenset(situation.target_by_name) - targets)
