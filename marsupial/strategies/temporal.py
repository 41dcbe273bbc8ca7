"""The temporal strategy: asks a planner for concurrent plans that weigh deploying and retrieving against driving.

This is the paper's strategy with two changes: plans are made for known *and* guessed targets, and the objective is
not the makespan alone.

How it works
------------
::

    Briefing ---> guess: known targets + guessed ones in the unknown
                    |
                    v
    candidates:   previous plan, plans of rules, an empty plan
                    |  each completed by the greedy planner, so that it serves all targets
                    v
                  best candidate ---> engine.solve(situation, budget, objective, start)
                    |                    |  every improving plan is checked (`Incumbent`); the best one is completed
                    v                    v
                  best of all by (targets unserved, objective)
                    |
                    v
                  real part of that plan ---> Decision

- *Why a guess.* The shortest plan for the known targets does not explore an unknown map fastest, as most targets are
  still unknown (`marsupial.strategies.guess`).
- *The objective* is priced arrival: a plan is better if it reaches valuable targets sooner, those that may reveal more
  before others. The makespan and driving have smaller prices.
- *Plans end with all rovers aboard,* if the mission does. So setting a rover down costs what retrieving it will cost,
  and robots without a target begin to meet while others still explore.
- *Robots never wait for a planner.* If the engine has no answer within its budget, another candidate is the best plan.
  The previous plan comes first among equals, so robots do not change plans without a gain.
- *Engines that minimise only the makespan* get only the known targets: by makespan alone, guessed targets made missions
  longer (docs/strategies.md). All candidates are still compared on the guess.
- *Progress does not depend on the guess.* Robots follow only the real part of a plan for a guess, so such plans could
  lead in circles. If the targets stay the same for `MOST_REPEATS` plans, the guess is left out until they change. All
  of a plan is real then, and it is replaced only by a better one.
- *Once no target is left,* the engine is asked for the shortest plan that recovers the rovers or brings the team home.

Teams without rovers need no docking plans, and gain more from replanning often. They replan as soon as they have seen
behind a frontier, and their targets are whole frontiers, each at its cell nearest to a robot (`WholeFrontiers`), so
they do not drive to ground already seen. If robots see hardly farther than the next cell, no frontier reveals much, and
the task is to cover ground. On small maps, and unless the engine minimises only the makespan, they then follow tours
that see everything, with unknown cells assumed free (`marsupial.strategies.frontier.covering`).

References
----------
Wurm et al. 2010, sections III-A (the loop) and III-C (the planning problem).
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace

from marsupial.model import Budget, Cell, Engine, Goal, Grid, RobotType, Role, SituationGoal, World
from marsupial.model.objective import MAKESPAN, Objective, ObjectiveName, PricedArrival, Value
from marsupial.model.strategy import Briefing, Decision, Strategy, Unseen
from marsupial.planning.checker import check
from marsupial.planning.greedy import Listing
from marsupial.strategies.asking import Explored, PlanningStrategy, Served, charged, completed, shortest, without
from marsupial.strategies.frontier.arrival import OnArrival, WholeFrontiers
from marsupial.strategies.frontier.covering import Covering
from marsupial.strategies.frontier.exploration import FrontierStrategy
from marsupial.strategies.guess import guess
from marsupial.strategies.heuristic import Heuristic
from marsupial.strategies.one_step import OneStep
from marsupial.strategies.reasons import Candidate, reasons

MAKESPAN_SHARE, DRIVING = 0.3, 0.15
"""Prices of 1 ms of makespan (as a share of the worth of all targets) and of 1 ms of driving; 1 ms until a real target
is reached costs 1."""

NEAR_CELLS, MOST_CELLS = 2.0, 12_000
"""Covering tours are used if every sensor range is below this many cells, on maps of at most this many cells."""

RULES: tuple[Strategy, ...] = (Heuristic(), OneStep())
"""Strategies whose plans are candidates, so that the result is never worse than theirs by the objective."""

MOST_REPEATS = 10
"""Consecutive plans for the same targets that may be made with a guess."""

ROUNDS_PER_STEP = 0.5
"""Rounds of the search for covering tours, for each step of the planning budget."""


@dataclass(frozen=True, slots=True, kw_only=True)
class TemporalParts:
    """What the strategy adds to the shortest plan for the known targets; 0 disables a part, to measure its value."""

    guess: float = 1.0  # plan for guessed targets as well
    price: float = 1.0  # plan by priced arrival, not by makespan alone
    early: float = 1.0  # weigh targets by the area that they may reveal, to this power: most of the map is known sooner
    choice: float = 1.0  # compare the planner's plan also with those of the rules and of list scheduling


class Temporal(PlanningStrategy):
    """Follows the best plan for known and guessed targets.

    `engine` is called with `budget` at each replanning; `parts` are those in use, `name` is its name in logs.
    """

    def __init__(
        self, engine: Engine, budget: Budget, parts: TemporalParts = TemporalParts(), name: str = "temporal"
    ) -> None:
        super().__init__(engine, budget)
        self.name, self._parts = name, parts
        self._covering: FrontierStrategy | None = None
        self._recovers = True
        self._targets: frozenset[str] = frozenset()  # of the last plan, and how many plans before it had the same
        self._repeats = 0

    def replanning(
        self, world: World, kinds: Mapping[str, RobotType], homes: Mapping[str, Cell], goal: Goal
    ) -> OnArrival | None:
        """Return the policy for a team without rovers; None for others."""
        self._recovers = goal.aboard
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
        return super().decide(briefing)

    def explore(self, briefing: Briefing) -> Explored:
        """Return the real part of the best plan for the guess, the real targets that no robot can serve, the report."""
        parts, known = self._parts, briefing.situation
        targets = frozenset(known.target_by_name)
        self._repeats = self._repeats + 1 if targets == self._targets else 0
        self._targets = targets
        guesses = parts.guess and self._repeats < MOST_REPEATS
        guessed = guess(briefing if guesses else replace(briefing, unseen=Unseen), early=parts.early)
        situation = replace(guessed.situation, goal=SituationGoal(recover_rovers=self._recovers))
        objective: Objective = MAKESPAN
        if parts.price:
            objective = PricedArrival(worth=guessed.worth, makespan=MAKESPAN_SHARE, driving=DRIVING)

        def rank(served: Served) -> tuple[int, Value]:
            plan, unserved = served
            return len(unserved), objective.value(situation, plan)

        listing, previous = Listing(situation), briefing.previous
        rules = {rule.name: rule.decide(briefing).plan for rule in RULES} if parts.choice else {}
        rules = {
            name: plan
            for name, plan in rules.items()
            if plan.actions and check(known, plan, targets=plan.explored).valid
        }
        by_rule = list(rules.values())
        kept, others = completed(listing, previous), completed(listing, *by_rule)
        if parts.choice or not kept:
            others.append(listing.serve())
        if objective.name in self._engine.info.objectives:
            plan, unserved = min(kept + others, key=rank)
            # what no plan can reach, targets or rovers, would make the problem unsolvable for the engine
            asked = without(situation, unserved)
            if not check(asked, plan).valid:
                asked = replace(asked, goal=SituationGoal())
            best, report = self.ask(asked, objective, plan)
        else:
            best, report = self.ask(known, objective, shortest(known, completed(Listing(known), previous, *by_rule)))
        # the first of equals is followed: the previous plan, then the engine's
        answer = completed(listing, best)
        found = kept + answer + others
        makers = ["previous"] * len(kept) + [self._engine.info.name] * len(answer) + [*rules, "greedy"]
        _, unserved = min(found, key=rank)
        if briefing.charged is not None:
            found = charged(found, situation, briefing.charged)
        candidates = [Candidate(maker, one[0], *rank(one)) for maker, one in zip(makers, found, strict=False)]
        candidates.sort(key=lambda one: (one.left_out, one.value))
        scale = (objective.total_worth if isinstance(objective, PricedArrival) else 0.0) or 1.0
        why = reasons(candidates, scale, guessed.ground, guessed.real_actions)
        plan = guessed.real_part(candidates[0].plan)
        return Explored(plan, unserved & known.target_by_name.keys(), report, why)
