"""One mission from a scenario: world, team, strategy and planner put together.

What `marsupial.explore`, ``marsupial run`` and every comparison call.
"""

from __future__ import annotations

from collections.abc import Callable
from time import perf_counter

from marsupial.errors import UsageError
from marsupial.library.metrics import Summary
from marsupial.maps.explorable import explorable_area
from marsupial.mission.loop import MissionLoop, MissionOrder
from marsupial.mission.observer import Observer, Observers
from marsupial.mission.placement import place_team
from marsupial.model.grid import Mask
from marsupial.model.mission import MissionStarted, PlacedRobot
from marsupial.model.planning import Budget, Engine
from marsupial.model.scenario import PlanningTime, Scenario
from marsupial.model.strategy import Decider, PlanningReport
from marsupial.sim.sensors import Sensor
from marsupial.sim.world import SimulatedWorld
from marsupial.strategies import registry
from marsupial.strategies.clairvoyant import CLAIRVOYANT


def reachable_area(scenario: Scenario, robots: tuple[PlacedRobot, ...]) -> Mask:
    """Return the cells (height, width) that a robot of the team can come to stand on.

    Carriers from their starts, rovers from theirs and from wherever a carrier can set them down on ground that the team
    gets to see.
    """
    return explorable_area(scenario.grid, scenario.robot_types, robots)


def simulate(
    scenario: Scenario,
    *,
    strategy: str | Decider,
    planner: str | Engine,
    budget: Budget,
    seed: int,
    observer: Observer | None = None,
    cancelled: Callable[[], bool] | None = None,
    sensor: Sensor | None = None,
) -> Summary:
    """Run one mission in the simulator and return its summary.

    Besides the strategies there is the clairvoyant (`marsupial.strategies.clairvoyant`), which is given the truth.

    Parameters
    ----------
    strategy, planner
        By name, or an object. One that is asked for by name is fresh for this mission.
    sensor
        What robots see; None for the exact field of view.

    Raises
    ------
    ScenarioError
        If the team can't be placed, or the strategy is not made for it.
    EngineUnavailable, UsageError
        If the strategy or planner can't be used as asked.
    """
    began = perf_counter()
    decider = None if strategy == CLAIRVOYANT else _decider(strategy, planner, budget)
    if decider is not None:
        registry.check_suits(decider, [scenario.type_of(member).role for member in scenario.team])
    robots = place_team(scenario, seed)
    kinds = {kind.name: kind for kind in scenario.robot_types}
    if decider is None and sensor is not None:
        raise UsageError(f"{CLAIRVOYANT} plans with the exact field of view: it takes no other sensor")
    reports = _Reports()
    watcher = Observers([reports] if observer is None else [reports, observer])
    started = _started(scenario, robots, strategy, planner, seed)
    reachable = reachable_area(scenario, robots)
    watcher.reachable(reachable)
    watcher.event(started)
    world = SimulatedWorld(scenario.grid, kinds, robots, sensor=sensor)
    charged = PlanningTime.INSTANT if decider is None else scenario.planning_time
    order = MissionOrder(goal=scenario.goal, limits=scenario.limits, planning_time=charged, reachable=reachable)
    if decider is None:
        from marsupial.strategies.clairvoyant.strategy import Clairvoyant  # brings a planner that others may not need

        insider = Clairvoyant(scenario.grid, scenario.robot_types, world, scenario.goal, reachable, budget, cancelled)
        mission = MissionLoop(world, kinds, insider, order, watcher, insider)
    else:
        mission = MissionLoop(world, kinds, decider, order, watcher)
    ended = mission.run(cancelled)
    return Summary.of(
        scenario,
        strategy=started.strategy,
        planner=started.planner,
        seed=seed,
        ended=ended,
        reports=reports.reports,
        analysis_s=reports.analysis_s,
        wall_s=perf_counter() - began,
    )


def _decider(wanted: str | Decider, planner: str | Engine, budget: Budget) -> Decider:
    return registry.strategy(wanted, planner=planner, budget=budget) if isinstance(wanted, str) else wanted


class _Reports(Observer):
    def __init__(self) -> None:
        self.reports: list[PlanningReport] = []
        self.analysis_s = 0.0
        self._since = 0.0

    def analysing(self) -> None:
        self._since = perf_counter()

    def analysed(self) -> None:
        self.analysis_s += perf_counter() - self._since

    def planned(self, report: PlanningReport) -> None:
        self.reports.append(report)


def _started(
    scenario: Scenario, robots: tuple[PlacedRobot, ...], strategy: str | Decider, planner: str | Engine, seed: int
) -> MissionStarted:
    grid = scenario.grid
    return MissionStarted(
        t_ms=0,
        scenario=scenario.name,
        strategy=strategy if isinstance(strategy, str) else strategy.name,
        planner=planner if isinstance(planner, str) else planner.info.name,
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
