"""One mission from a scenario: world, team, strategy and planner put together.

What `marsupial run` and every comparison call.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from time import perf_counter

import numpy as np

from marsupial.maps.territory import Territory
from marsupial.mission.loop import Mission, MissionOrder
from marsupial.mission.observer import Observer, Observers
from marsupial.mission.placement import place_team
from marsupial.model.grid import Mask
from marsupial.model.mission import MissionEnded, MissionStarted, PlacedRobot
from marsupial.model.planning import Budget
from marsupial.model.robots import Role
from marsupial.model.scenario import PlanningTime, Scenario
from marsupial.model.strategy import PlanningReport
from marsupial.sim.world import SimulatedWorld
from marsupial.strategies.clairvoyant import CLAIRVOYANT
from marsupial.strategies.clairvoyant.strategy import Clairvoyant
from marsupial.strategies.registry import strategy


@dataclass(frozen=True, slots=True, kw_only=True)
class PlanningStats:
    """Wall-clock seconds spent planning, over the replannings of one mission; 0 where there was none."""

    median: float
    p95: float
    max: float
    total: float
    first_plan: float

    @classmethod
    def of(cls, reports: list[PlanningReport]) -> PlanningStats:
        """Return the statistics of these reports; `first_plan` is the median time to the first plan."""
        walls = np.array([report.wall_s for report in reports] or [0.0])
        firsts = [report.first_plan_s for report in reports if report.first_plan_s is not None]
        return cls(
            median=float(np.median(walls)),
            p95=float(np.percentile(walls, 95)),
            max=float(walls.max()),
            total=float(walls.sum()) if reports else 0.0,
            first_plan=float(np.median(firsts)) if firsts else 0.0,
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class MissionSummary:
    """A mission's end together with what it was and what it cost in wall-clock time.

    `refused` counts engine plans that the checker did not let through.
    """

    scenario: str
    strategy: str
    planner: str
    carriers: int
    rovers: int
    seed: int
    ended: MissionEnded
    planning: PlanningStats
    refused: int
    wall_s: float

    @property
    def quality(self) -> float:
        """Exploration quality in m2 per m: area explored over the sum of distances driven (README, metrics)."""
        driven = sum(distance for _, distance in self.ended.distance_m)
        return self.ended.explored_area_m2 / driven if driven else 0.0


class _Reports(Observer):
    def __init__(self) -> None:
        self.reports: list[PlanningReport] = []

    def planned(self, report: PlanningReport) -> None:
        self.reports.append(report)


def reachable_area(scenario: Scenario, robots: tuple[PlacedRobot, ...]) -> Mask:
    """Return the cells (height, width) that a robot of the team could come to stand on, knowing the whole map.

    Carriers from their starts, rovers from theirs and from wherever a carrier can set them down.
    """
    reach = Territory(scenario.grid.solid(), scenario.robot_types).reach(robots)
    return np.logical_or.reduce(list(reach.by_type.values()))


def _started(
    scenario: Scenario, robots: tuple[PlacedRobot, ...], strategy_name: str, planner: str, seed: int
) -> MissionStarted:
    grid = scenario.grid
    return MissionStarted(
        t_ms=0,
        scenario=scenario.name,
        strategy=strategy_name,
        planner=planner,
        seed=seed,
        width=grid.width,
        height=grid.height,
        resolution_m=grid.resolution_m,
        origin_m=grid.origin_m,
        terrains=grid.terrains,
        types=scenario.robot_types,
        robots=robots,
        goal=scenario.goal,
    )


def simulate(
    scenario: Scenario,
    *,
    strategy_name: str,
    planner: str,
    budget: Budget,
    seed: int,
    observer: Observer | None = None,
    cancelled: Callable[[], bool] | None = None,
) -> MissionSummary:
    """Run one mission in the simulator and return its summary.

    Besides the strategies there is the clairvoyant (`marsupial.strategies.clairvoyant`), which is given the truth.

    Raises
    ------
    ScenarioError
        If the team can't be placed.
    EngineUnavailable, UsageError
        If the strategy or planner can't be used as asked.
    """
    began = perf_counter()
    robots = place_team(scenario, seed)
    kinds = {kind.name: kind for kind in scenario.robot_types}
    chosen = None if strategy_name == CLAIRVOYANT else strategy(strategy_name, planner=planner, budget=budget)
    reports = _Reports()
    watcher = Observers([reports] if observer is None else [reports, observer])
    watcher.event(_started(scenario, robots, strategy_name, planner, seed))
    reachable = reachable_area(scenario, robots)
    order = MissionOrder(
        goal=scenario.goal,
        limits=scenario.limits,
        planning_time=scenario.planning_time,
        reachable=reachable,
    )
    world = SimulatedWorld(scenario.grid, kinds, robots)
    if chosen is None:
        order = replace(order, planning_time=PlanningTime.INSTANT)
        insider = Clairvoyant(scenario.grid, scenario.robot_types, world, scenario.goal, reachable, budget, cancelled)
        ended = Mission(world, kinds, insider, order, watcher, insider).run(cancelled)
    else:
        ended = Mission(world, kinds, chosen, order, watcher).run(cancelled)
    roles = [kinds[robot.type].role for robot in robots]
    return MissionSummary(
        scenario=scenario.name,
        strategy=strategy_name,
        planner=planner,
        carriers=roles.count(Role.CARRIER),
        rovers=roles.count(Role.ROVER),
        seed=seed,
        ended=ended,
        planning=PlanningStats.of(reports.reports),
        refused=sum(report.refused for report in reports.reports),
        wall_s=perf_counter() - began,
    )
