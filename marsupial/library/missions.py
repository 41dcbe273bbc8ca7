"""Run one mission of a scenario: set up world, team, strategy and planner, and the loop that connects them.

`marsupial.explore`, ``marsupial run`` and all comparisons call `simulate`; `marsupial.Mission` runs the loop itself.
"""

from collections.abc import Callable, Mapping
from time import perf_counter
from typing import NamedTuple

from marsupial.errors import Problem, ScenarioError, UsageError
from marsupial.library.choices import AnyStrategy, decider_of
from marsupial.library.metrics import Summary
from marsupial.maps.explorable import explorable_area
from marsupial.mission.goals import MissionOrder
from marsupial.mission.loop import MissionLoop
from marsupial.mission.observer import Observer, Observers
from marsupial.mission.placement import place_team
from marsupial.model import Budget, Engine, Mask, MissionStarted, PlacedRobot, PlanningTime, RobotType, Scenario
from marsupial.model.faults import dated
from marsupial.model.mission import MissionEnded, MissionEvent, Planned, ZoneChanged
from marsupial.model.strategy import Decider, PlanningReport
from marsupial.model.zones import ZoneChange, always_closed, at_start, counting, zoned
from marsupial.sim.sensors import Sensor
from marsupial.sim.world import SimulatedWorld
from marsupial.strategies import registry
from marsupial.strategies.clairvoyant import CLAIRVOYANT


def reachable_area(scenario: Scenario, robots: tuple[PlacedRobot, ...]) -> Mask:
    """Return the mask (height, width) of cells that some robot of the team can reach, given the lasting no-go zones."""
    # Carriers drive from their starts; rovers from their own, and from wherever a carrier can set them down on ground
    # that the team can see.
    return explorable_area(zoned(scenario.grid, always_closed(scenario.zones)), scenario.robot_types, robots)


def simulate(
    scenario: Scenario,
    *,
    strategy: AnyStrategy,
    planner: str | Engine,
    budget: Budget,
    seed: int,
    observer: Observer | None = None,
    cancelled: Callable[[], bool] | None = None,
    sensor: Sensor | None = None,
) -> Summary:
    """Run one mission in the simulator and return its summary.

    `strategy` and `planner` are names, which get new objects for this mission, or objects. The strategy may also be in
    a file, or the clairvoyant, which knows the true map. `sensor`: the robots'; None for the exact field of view.
    Raise `ScenarioError` if the team can't be placed, or does not suit the strategy.
    Raise `EngineUnavailable` or `UsageError` if the strategy or planner can't be used.
    """
    simulation = set_up(
        scenario,
        strategy=strategy,
        planner=planner,
        budget=budget,
        seed=seed,
        observer=observer,
        cancelled=cancelled,
        sensor=sensor,
    )
    return simulation.summary(simulation.loop.run(cancelled))


class Simulation(NamedTuple):
    """A mission that is set up: its loop, and what makes its summary of its last event."""

    loop: MissionLoop
    summary: Callable[[MissionEnded], Summary]


def set_up(
    scenario: Scenario,
    *,
    strategy: AnyStrategy,
    planner: str | Engine,
    budget: Budget,
    seed: int,
    observer: Observer | None = None,
    cancelled: Callable[[], bool] | None = None,
    sensor: Sensor | None = None,
) -> Simulation:
    """Set up one mission in the simulator; see `simulate`."""
    began = perf_counter()
    decider = _decider(scenario, strategy, planner, budget, sensor)
    robots = place_team(scenario, seed)
    kinds = {kind.name: kind for kind in scenario.robot_types}
    world = _world(scenario, kinds, robots, seed, sensor)
    reports = _Reports()
    told = [_PlanTeller(world)] if scenario.interference else []
    watcher = Observers([reports, *told, *([] if observer is None else [observer])])
    started = MissionStarted.of(
        scenario.grid,
        scenario=scenario.name,
        strategy=strategy if isinstance(strategy, str) else strategy.name,
        planner=planner if isinstance(planner, str) else planner.info.name,
        seed=seed,
        types=scenario.robot_types,
        robots=robots,
        goal=scenario.goal,
        interference=scenario.interference,
    )
    reachable = reachable_area(scenario, robots)
    watcher.reachable(counting(reachable, zoned(scenario.grid, at_start(scenario.zones))))
    watcher.event(started)
    # The clairvoyant is a yardstick for strategies, not a planner for robots: its planning costs no mission time.
    charged = PlanningTime.INSTANT if decider is None else scenario.planning_time
    order = MissionOrder(
        goal=scenario.goal,
        limits=scenario.limits,
        planning_time=charged,
        reachable=reachable,
        zones=scenario.zones,
        interference=world.interference if scenario.interference else None,
    )
    clairvoyant = None
    if decider is None:
        from marsupial.strategies.clairvoyant.strategy import Clairvoyant  # imports a planner that others may not need

        grid, types = scenario.grid, scenario.robot_types
        decider = clairvoyant = Clairvoyant(grid, types, world, scenario.goal, reachable, budget, cancelled)
    return Simulation(
        MissionLoop(world, kinds, decider, order, watcher, clairvoyant),
        lambda ended: Summary.of(
            scenario,
            strategy=started.strategy,
            planner=started.planner,
            seed=seed,
            ended=ended,
            reports=reports.reports,
            analysis_s=reports.analysis_s,
            wall_s=perf_counter() - began,
        ),
    )


def _decider(
    scenario: Scenario, strategy: AnyStrategy, planner: str | Engine, budget: Budget, sensor: Sensor | None
) -> Decider | None:
    """Return the strategy of a mission, which suits its team; None for the clairvoyant, which suits every team."""
    if isinstance(strategy, str) and strategy == CLAIRVOYANT:
        check_foreseen(scenario)
        if sensor is not None:
            raise UsageError(f"{CLAIRVOYANT} plans with the exact field of view: it takes no other sensor")
        return None
    decider = decider_of(strategy, planner, budget)
    registry.check_suits(decider, [scenario.type_of(member).role for member in scenario.team])
    return decider


def check_foreseen(scenario: Scenario, source: str = "") -> None:
    """Raise a `ScenarioError` that names the fields of a scenario that the clairvoyant does not support."""
    found: list[tuple[str, str, object]] = [("faults", "faults", scenario.faults), ("zones", "zones", scenario.zones)]
    for i, kind in enumerate(scenario.robot_types):
        found += [(f"robot_types[{i}].battery", "batteries", kind.battery)]
        found += [(f"robot_types[{i}].sensor_angle_deg", "sensor angles", kind.sensor_angle_deg)]
        found += [(f"robot_types[{i}].radio_range_m", "limited contact", kind.radio_range_m)]
    reason = f"{CLAIRVOYANT} plans the whole mission at its start, and does not reckon with"
    if problems := [Problem(path, f"{reason} {what}") for path, what, value in found if value]:
        raise ScenarioError(problems, source=source)


def _world(
    scenario: Scenario,
    kinds: Mapping[str, RobotType],
    robots: tuple[PlacedRobot, ...],
    seed: int,
    sensor: Sensor | None,
) -> SimulatedWorld:
    """Return the simulated world of a mission."""
    roles = {robot.name: kinds[robot.type].role for robot in robots}
    faults = tuple(dated(scenario.faults, roles, scenario.limits.time_ms, seed))
    return SimulatedWorld(scenario.grid, kinds, robots, faults, sensor, interference=scenario.interference)


class _Reports(Observer):
    """Collects the reports of planning calls, and the time of analyses."""

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


class _PlanTeller(Observer):
    """Tells a world which robots the current plan docks with each other, and where robots must not go."""

    def __init__(self, world: SimulatedWorld) -> None:
        self._world = world

    def event(self, event: MissionEvent) -> None:
        if isinstance(event, Planned):
            self._world.plan(event.meetings, event.actions)
        elif isinstance(event, ZoneChanged):
            self._world.change_zone(ZoneChange(name=event.name, zone=event.zone))
