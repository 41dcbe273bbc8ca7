"""The clairvoyant as a strategy and a replanning policy: one plan, made from the true map, until all has been seen.

Robots see and report as in any mission, but the reports only count the cells left. Once all of the reachable area is
known, a greedy plan reaches the rest of the mission's goal.
"""

from collections.abc import Callable, Sequence
from functools import partial
from time import perf_counter

import numpy as np

from marsupial.maps.survey import Survey, Surveyor, placed
from marsupial.maps.territory import Territory
from marsupial.model import Action, Budget, Cell, Goal, Grid, Mask, News, Outcome, Plan, RobotType, World
from marsupial.model.mission import Cause, MapMeeting, Remaining, Status, Trigger, Triggers
from marsupial.model.strategy import Briefing, Decision, PlanningReport, PlanProgress, Strategy
from marsupial.planning.greedy import serve
from marsupial.strategies.clairvoyant import CLAIRVOYANT
from marsupial.strategies.clairvoyant.ground import Ground
from marsupial.strategies.clairvoyant.outline import Outline
from marsupial.strategies.clairvoyant.search import best_outline

# the clairvoyant plans once, other strategies about a hundred times
ROUNDS_PER_STEP = 1.5  # search rounds per step of a strategy's planning budget
SECONDS = 5.0  # factor on the seconds of that budget

SEED = 1


class Clairvoyant(Strategy):
    """Plans with the true map until the cells `reachable` (height, width) have been seen in `world`.

    `budget` is the planning budget of the strategies that it is compared with, see `ROUNDS_PER_STEP`.
    """

    name = CLAIRVOYANT
    explored = "all of the reachable area is known"
    wake_ms: int | None = None

    def __init__(
        self,
        truth: Grid,
        kinds: Sequence[RobotType],
        world: World,
        goal: Goal,
        reachable: Mask,
        budget: Budget,
        cancelled: Callable[[], bool] | None = None,
    ) -> None:
        self._truth, self._kinds, self._world, self._goal = truth, tuple(kinds), world, goal
        self._budget, self._cancelled = budget, cancelled
        self._homes = {robot.name: robot.cell for robot in world.robots() if robot.cell is not None}
        self._surveyor = Surveyor(Territory(truth.solid(), self._kinds), self._homes, goal)
        self._reachable = reachable.ravel()
        self._left = int(np.count_nonzero(reachable))
        self._outline: Outline | None = None
        self._search_s = 0.0
        self._exploring = False
        self.exploration_ms: int | None = None

    def decide(self, briefing: Briefing) -> Decision:
        # the search runs in `survey`, before this call, but counts as planning
        began = perf_counter() - self._search_s
        plan, detail = Plan(actions=()), ""
        goal = briefing.situation.goal
        if not self._left or goal.aboard:
            plan, _ = serve(briefing.situation)
            detail = "" if plan.actions else "not every rover can be brought back"
        elif self._exploring:
            detail = "the plan leaves a part of the reachable area unexplored"
        elif self._outline is not None:
            plan = self._outline.plan
        self._exploring, self._search_s = self._left > 0, 0.0
        wall_s = perf_counter() - began
        report = PlanningReport(planner=CLAIRVOYANT, outcome=Outcome.SATISFICING, wall_s=wall_s, detail=detail)
        return Decision(plan=plan, report=report)

    def update(self, news: News) -> None:
        for _, indices in news.revealed:
            self._left -= int(np.count_nonzero(self._reachable[indices]))
        if not self._left and self.exploration_ms is None:
            self.exploration_ms = news.t_ms

    def look(self, news: News, done: Sequence[Action], work: PlanProgress) -> Triggers:
        if not self._left and (self._exploring or work.idle):
            return (Trigger(Cause.EXPLORED),)
        return (Trigger(Cause.CARRIED_OUT),) if work.idle else ()

    def survey(self, work: PlanProgress, keep: Sequence[MapMeeting], *, late: bool = False) -> Survey:
        if self._left:
            return self._best().survey
        # rovers can always be picked up where they were set down
        deployed_at = set(work.deployed_at.values())
        kept = sorted((point for point in keep if point.name in deployed_at), key=lambda point: point.name)
        return self._surveyor.survey(self._world.robots(), self._world.now_ms, kept)

    def route(self, kind: str, start: Cell, goal: Cell, _heading: int | None) -> Sequence[Cell] | None:
        # the plan was made with routes that ignore the heading
        return self._surveyor.route(kind, start, goal)

    def follow(self, survey: Survey, since: Survey | None = None) -> None:
        pass  # newly seen cells don't change the plan

    def remaining(self, status: Status, reason: str) -> tuple[Remaining, ...]:
        known = Surveyor(Territory(self._world.grid, self._kinds), self._homes, self._goal)
        targets = known.targets(self._world.robots())
        return known.remaining(targets, reason if self._left else "nothing reachable is behind it")

    def _best(self) -> Outline:
        """Return the best outline; the first call runs the search."""
        if self._outline is None:
            began = perf_counter()
            ground = Ground(self._truth, self._kinds, placed(self._world.robots()))
            self._outline = best_outline(ground, partial(self._used, began), SEED)
            self._search_s = perf_counter() - began
        return self._outline

    def _used(self, began: float, rounds: int) -> float:
        """Return the used share of the budget after `rounds` rounds; 1 or more ends the search."""
        if self._cancelled is not None and self._cancelled():
            return 1.0
        if self._budget.steps is not None:
            return rounds / (ROUNDS_PER_STEP * self._budget.steps)
        return (perf_counter() - began) / (SECONDS * (self._budget.seconds or 0.0))
