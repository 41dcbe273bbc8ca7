"""Runs a frontier rule in a mission: robots drive to the cells that the rule chooses.

The cells become the targets of a situation, so that the plan is checked, carried out and logged like any other. The
mission ends as with every other strategy: when nothing is left to explore, and carriers are home if required.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence, Set
from dataclasses import replace
from time import perf_counter

import numpy as np

from marsupial.arrays import Floats, Ints
from marsupial.errors import ScenarioError
from marsupial.maps.survey import Survey
from marsupial.maps.targets import Frontier, Target, cell_at
from marsupial.model import Action, Cell, FrameShift, Goal, MapMeeting, Plan, RobotType, Role, Routes, Triggers
from marsupial.model.strategy import Briefing, Decision, PlanProgress
from marsupial.model.world import News, RobotReport, World
from marsupial.planning.schedule.timeline import Timeline
from marsupial.strategies.frontier.arrival import OnArrival
from marsupial.strategies.frontier.rule import TRAIL, Explorer, FrontierRule, FrontierView
from marsupial.strategies.rules import RuleStrategy


class FrontierStrategy(RuleStrategy):
    """A strategy that sends robots to the cells chosen by a rule; its name may have the rule's parameters."""

    def __init__(self, rule: FrontierRule, name: str = "") -> None:
        self.name = name or rule.name
        self._rule = rule
        self._pace: FrontierPace | None = None

    def suits(self, roles: Iterable[Role]) -> None:
        team = Counter(roles)
        rovers, most = team[Role.ROVER], self._rule.most_robots
        if rovers:
            raise ScenarioError(f"the strategy {self.name} is for teams without rovers, this one has {rovers}")
        if most is not None and team.total() > most:
            raise ScenarioError(f"strategy {self.name} leads {most} at most, the team has {team.total()} robots")

    def replanning(
        self, world: World, kinds: Mapping[str, RobotType], homes: Mapping[str, Cell], goal: Goal
    ) -> FrontierPace:
        self._pace = FrontierPace(self._rule, world, kinds, homes, goal)
        return self._pace

    def decide(self, briefing: Briefing) -> Decision:
        decision = super().decide(briefing)
        wall_s = decision.report.wall_s + (0.0 if self._pace is None else self._pace.choosing_s)
        return replace(decision, report=replace(decision.report, wall_s=wall_s, first_plan_s=wall_s))

    def explore(self, briefing: Briefing) -> tuple[Plan, frozenset[str]]:
        timeline = Timeline.of(briefing.situation)
        for robot, target in ({} if self._pace is None else self._pace.ways).items():
            timeline.explore(robot, target)
        return timeline.plan, frozenset()


class FrontierPace(OnArrival):
    """Asks the rule whenever a robot needs a new goal."""

    def __init__(
        self, rule: FrontierRule, world: World, kinds: Mapping[str, RobotType], homes: Mapping[str, Cell], goal: Goal
    ) -> None:
        super().__init__(world, kinds, homes, goal)
        self._rule = rule
        # seeded by the starts: missions with the same starts are the same
        starts = [value for robot in world.robots() if robot.cell is not None for value in robot.cell]
        self._rng = np.random.default_rng(starts)
        self._goals: dict[str, int] = {}
        self._trails: dict[str, tuple[Cell, ...]] = {}
        self._steps: dict[str, Cell] = {}
        self.ways: dict[str, str] = {}  # the target of each robot with a goal
        self.choosing_s = 0.0  # wall-clock seconds that the rule took

    def _move(self, shift: FrameShift) -> None:
        super()._move(shift)
        self._goals = {name: shift.index(goal) for name, goal in self._goals.items()}
        self._trails = {name: tuple(map(shift.cell, trail)) for name, trail in self._trails.items()}
        self._steps = shift.cells(self._steps)

    def look(self, news: News, done: Sequence[Action], work: PlanProgress) -> Triggers:
        if not self._rule.each_step:
            for action in done:
                self._goals.pop(action.robot, None)
        return super().look(news, done, work)

    def survey(self, work: PlanProgress, keep: Sequence[MapMeeting], *, late: bool = False) -> Survey:
        self.choosing_s = 0.0
        return super().survey(work, keep, late=late)

    def _aims(self, work: PlanProgress) -> Mapping[str, int]:
        return self._goals if self._rule.gives_up else {}

    def _seen_through(self, aims: Mapping[str, int]) -> list[str]:
        gone = super()._seen_through(aims)
        for name in gone:
            del self._goals[name]
        return gone

    def _targets(self, robots: Sequence[RobotReport]) -> tuple[Target, ...]:
        """Return the frontier cells that the rule chooses as targets; note which robot drives to which."""
        robots = self._surveyor.outside(robots)
        standing = {robot.name for robot in robots if robot.free_at_ms <= self._world.now_ms}
        self._goals = self._open_goals(robots, standing)
        view = self._view(robots)
        began = perf_counter()
        chosen = {**self._goals, **self._rule.choose(view)}
        self.choosing_s = perf_counter() - began
        self._goals, self.ways = {}, {}
        targets: dict[str, Target] = {}
        for robot in view.robots:
            if robot.name not in chosen:
                continue
            stop = self._next_stop(view, robot, chosen[robot.name])
            # an action that ends at the robot's own cell would reveal nothing, and be replanned for ever
            if stop is None or (stop == robot.cell and robot.name in standing):
                continue
            name = view.grid.name_of("t", stop)
            self._goals[robot.name], self.ways[robot.name] = chosen[robot.name], name
            viewpoints = {**(targets[name].viewpoints if name in targets else {}), robot.kind.name: stop}
            seed = np.array([stop.y * view.grid.width + stop.x])
            targets[name] = self._surveyor.finder.target(int(seed[0]), seed, viewpoints)
        return tuple(targets.values())

    def _open_goals(self, robots: Sequence[RobotReport], standing: Set[str]) -> dict[str, int]:
        """Return the goals that were not reached yet and can still be explored."""
        frontiers = self._surveyor.frontiers(self._world.robots())
        kept = {}
        for robot in robots:
            goal, frontier = self._goals.get(robot.name), frontiers[robot.type]
            if goal is None or goal not in frontier.cells:
                continue
            if robot.name not in standing or robot.cell != self._viewpoint(frontier, goal):
                kept[robot.name] = goal
        return kept

    def _viewpoint(self, frontier: Frontier, goal: int) -> Cell:
        """Return the cell from which a goal is explored: the viewpoint of a frontier cell, any other cell itself."""
        width = self._world.grid.width
        return frontier.approach(goal, width) if goal in frontier.cells else cell_at(goal, width)

    def _next_stop(self, view: FrontierView, robot: Explorer, goal: int) -> Cell | None:
        """Return the next cell to drive to on the way to a goal, or None if there is no route."""
        place = self._viewpoint(view.frontier(robot), goal)
        route = self._surveyor.route(robot.kind.name, robot.cell, place, robot.heading)
        if route is None:
            return None
        if not self._rule.each_step:
            return place
        # route lengths by least energy are not additive, since turns between parts count: `step_towards` would err
        if robot.kind.routes is Routes.ENERGY:
            return route[min(1, len(route) - 1)]
        # a drawn step is kept while the plan is fitted to the planning time; otherwise it would be lost
        step = view.step_towards(robot, place, before=self._steps.get(robot.name))
        self._steps[robot.name] = step
        return step

    def _view(self, robots: Sequence[RobotReport]) -> FrontierView:
        kinds = self._kinds
        for robot in robots:
            trail = self._trails.get(robot.name, ())
            if robot.cell is not None and robot.cell not in trail[-1:]:
                self._trails[robot.name] = (*trail, robot.cell)[-TRAIL:]
        explorers = tuple(
            Explorer(
                name=robot.name,
                kind=kinds[robot.type],
                cell=robot.cell,
                heading=robot.heading,
                goal=self._goals.get(robot.name),
                trail=self._trails[robot.name],
            )
            for robot in robots
            if robot.cell is not None
        )

        def lengths(robot: Explorer, cells: Ints) -> Floats:
            return self._surveyor.lengths(robot.kind.name, robot.cell, cells, robot.heading)

        territory = self._surveyor.territory
        return FrontierView(
            grid=territory.grid,
            robots=explorers,
            frontiers=self._surveyor.frontiers(robots),
            standable={name: footprint.standable for name, footprint in territory.footprints.items()},
            lengths=lengths,
            rng=self._rng,
        )
