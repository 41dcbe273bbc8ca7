from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from failing_world import FailingWorld
from listening import Listening
from support.missions.small_missions import Recorder, losses
from support.missions.small_teams import begun_on, drawn_grid

from marsupial.errors import UsageError
from marsupial.generators.builtin import builtin_scenario
from marsupial.mission.carryover import shifted
from marsupial.mission.goals import MissionOrder
from marsupial.mission.loop import MissionLoop
from marsupial.mission.placement import place_team
from marsupial.mission.rebuild import moment_at
from marsupial.model import ActionStarted
from marsupial.model.grid import FLOOR, OBSTACLE, UNKNOWN, Cell
from marsupial.model.mission import DriveEnded, DriveStarted, MissionEvent, PlacedRobot, Planned, Revealed, RobotLost
from marsupial.model.plan import Action, ActionName, Plan
from marsupial.model.robots import EnergyModel, Routes, default_types
from marsupial.model.scenario import Goal, MissionLimits, PlanningTime, Scenario, with_routes
from marsupial.model.situation import Situation, SituationGoal
from marsupial.model.strategy import Briefing, Decision
from marsupial.planning.checker import check
from marsupial.sim.world import SimulatedWorld


def explore(
    scenario: Scenario,
    failures: dict[str, int] | None = None,
    fails: Callable[[int, str], bool] | None = None,
    *,
    seed: int = 1,
    strategy: Listening | None = None,
) -> tuple[list[MissionEvent], list[Situation]]:
    robots = place_team(scenario, seed)
    kinds = {kind.name: kind for kind in scenario.robot_types}
    planning_time = PlanningTime.INSTANT if strategy is None else PlanningTime.CHARGED
    recorder, strategy = Recorder(), strategy or Listening()
    recorder.event(begun_on(scenario.grid, scenario.robot_types, robots, goal=scenario.goal))
    world = SimulatedWorld(scenario.grid, kinds, robots, losses(failures or {}))
    if fails is not None:
        world = FailingWorld(scenario.grid, kinds, robots, fails)
    order = MissionOrder(goal=scenario.goal, limits=scenario.limits, planning_time=planning_time)
    MissionLoop(world, kinds, strategy, order, recorder).run()
    return recorder.events, strategy.asked


def assert_rebuilt(events: list[MissionEvent], asked: list[Situation]) -> None:
    plans = [event for event in events if isinstance(event, Planned)]
    # the last replanning may end the mission without a plan
    assert len(asked) - len(plans) in (0, 1)
    assert plans
    last_at = {plan.t_ms: situation for plan, situation in zip(plans, asked, strict=False)}
    for t_ms, situation in last_at.items():
        assert moment_at(events, t_ms).survey().situation == situation, f"at {t_ms} ms"


def test_every_situation_of_a_mission_is_rebuilt_from_its_events() -> None:
    assert_rebuilt(*explore(builtin_scenario("lobby", 2, 2)))


def test_a_mission_that_comes_home_is_rebuilt() -> None:
    scenario = replace(builtin_scenario("lobby", 1, 2), goal=Goal(recover_rovers=True, return_home=True))
    assert_rebuilt(*explore(scenario))


def test_a_mission_on_routes_of_least_energy_is_rebuilt() -> None:
    scenario = builtin_scenario("lobby", 2, 2)
    energy = EnergyModel(metre_j=1.0, stop_j=0.5, turn_j=(0.4, 0.6, 0.8, 1.0))
    kinds = tuple(replace(kind, energy=energy) for kind in scenario.robot_types)
    assert_rebuilt(*explore(with_routes(replace(scenario, robot_types=kinds), Routes.ENERGY)))


def test_a_mission_with_lost_robots_is_rebuilt() -> None:
    scenario = replace(builtin_scenario("lobby", 2, 2), limits=MissionLimits(time_ms=400_000))
    assert_rebuilt(*explore(scenario, {"rover1_1": 30_000, "carrier2": 60_000}))


def test_a_mission_in_which_commands_fail_is_rebuilt() -> None:
    # the pattern may hit every docking, so the mission may last until its time limit
    scenario = replace(builtin_scenario("lobby", 2, 2), limits=MissionLimits(time_ms=100_000))
    assert_rebuilt(*explore(scenario, fails=lambda number, name: number % 5 in (1, 3)))


class Slow(Listening):
    """A strategy whose plans take as long each."""

    def decide(self, briefing: Briefing) -> Decision:
        decision = super().decide(briefing)
        return replace(decision, report=replace(decision.report, wall_s=2.0))


def test_the_plans_of_a_mission_that_is_charged_for_planning_are_valid_for_the_rebuilt_situations() -> None:
    events, _ = explore(builtin_scenario("lobby", 1, 2), seed=2, strategy=Slow())
    plans = [event for event in events if isinstance(event, Planned)]
    assert len(plans) > 5
    for made in plans:
        survey = moment_at(events, made.t_ms).survey()
        assert [target.on_map() for target in survey.targets] == list(made.targets)
        assert survey.meetings == made.meetings
        plan = shifted(Plan(actions=made.actions), -made.t_ms)
        situation = replace(survey.situation, goal=SituationGoal())
        verdict = check(situation, plan, targets=plan.explored)
        assert verdict.valid, (made.t_ms, verdict.violation)


CARRIER, ROVER = default_types(2)
START = begun_on(
    drawn_grid(*["........"] * 3),
    (CARRIER, ROVER),
    (
        PlacedRobot(name="carrier1", type="carrier", cell=Cell(1, 1)),
        PlacedRobot(name="rover1", type="rover", carrier="carrier1"),
    ),
)
UNDOCK = Action(
    name=ActionName.UNDOCK, start_ms=5000, duration_ms=5000, robot="rover1", carrier="carrier1", place="m_here"
)


def test_a_driving_robot_is_at_the_next_cell_and_free_on_its_arrival_there() -> None:
    events = [START, DriveStarted(t_ms=1000, robot="carrier1", cell=Cell(1, 1), steps="000"), end_at(9000)]
    robot = moment_at(events, 2500).robots[0]
    assert (robot.cell, robot.free_at_ms, robot.heading) == (Cell(3, 1), 3000, 0)


def test_a_robot_that_stands_faces_as_it_came_and_one_that_is_set_down_no_way() -> None:
    events = [
        START,
        DriveStarted(t_ms=1000, robot="carrier1", cell=Cell(1, 1), steps="0002"),
        end_at(4000),
        ActionStarted(t_ms=5000, revision=1, action=UNDOCK, cell=Cell(5, 1)),
        end_at(20_000),
    ]
    carrier, rover = moment_at(events, 5000).robots
    assert (carrier.cell, carrier.heading, rover.heading) == (Cell(4, 1), 0, None)


def test_a_rover_being_set_down_is_on_the_ground_and_busy_with_its_carrier() -> None:
    events = [START, ActionStarted(t_ms=5000, revision=1, action=UNDOCK, cell=Cell(2, 1)), end_at(20_000)]
    carrier, rover = moment_at(events, 6000).robots
    assert (rover.cell, rover.carrier, rover.free_at_ms) == (Cell(2, 1), None, 10_000)
    assert (carrier.cell, carrier.free_at_ms) == (Cell(1, 1), 10_000)


def test_a_rover_on_a_lost_carrier_is_lost() -> None:
    events = [START, RobotLost(t_ms=1000, robot="carrier1", reason="failed"), end_at(2000)]
    assert [robot.lost for robot in moment_at(events, 1500).robots] == [True, True]


def test_cells_revealed_later_are_unknown() -> None:
    events = [
        START,
        Revealed(t_ms=0, robot="carrier1", runs=(8, 3, FLOOR)),
        Revealed(t_ms=4000, robot="carrier1", runs=(11, 1, OBSTACLE)),
        end_at(9000),
    ]
    row = moment_at(events, 3999).grid.cells[1]
    np.testing.assert_array_equal(row, [FLOOR] * 3 + [UNKNOWN] * 5)
    assert moment_at(events, 4000).grid.cells[1, 3] == OBSTACLE


def test_a_moment_after_the_end_is_refused() -> None:
    with pytest.raises(UsageError, match=r"from 0 s to 9 s"):
        moment_at([START, end_at(9000)], 9001)


def end_at(t_ms: int) -> MissionEvent:
    return DriveEnded(t_ms=t_ms, robot="carrier1", cell=Cell(4, 1))
