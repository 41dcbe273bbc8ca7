from collections.abc import Callable
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from mission_fakes import Scripted, drive
from support.missions.small_missions import greedy_strategy, run
from support.missions.small_teams import (
    ANNEX,
    CORRIDOR,
    LONG_HALL,
    TWO_ANNEXES,
    carrier_at,
    drawn_grid,
    kinds_of,
    rover_at,
    rover_on,
)

from marsupial.formats.loglines import trigger_text
from marsupial.maps.lookout import LOOK_MS
from marsupial.mission.measures import ExploredArea
from marsupial.mission.patience import MAX_FRUITLESS
from marsupial.model import ActionStarted, DriveStarted, MissionEnded
from marsupial.model.grid import Cell
from marsupial.model.mission import KNOWN_PERCENT, ActionEnd, ActionEnded, PlacedRobot, Planned, RobotLost, Status
from marsupial.model.plan import Action, ActionName, Plan
from marsupial.model.robots import EnergyModel
from marsupial.model.scenario import Goal, PlanningTime
from marsupial.model.strategy import Briefing
from marsupial.model.world import energy_j
from marsupial.sim.world import SimulatedWorld
from marsupial.strategies.heuristic import Heuristic
from marsupial.strategies.temporal import Temporal

LEAVE = Goal(recover_rovers=False)
HOME = Goal(return_home=True)


def nearest_target(briefing: Briefing) -> Plan:
    """Send only the first carrier, to its nearest target."""
    situation = briefing.situation
    if not situation.targets:
        return Plan(actions=())
    robot = situation.robots[0]
    travel = {t.name: situation.travel(robot.type, str(robot.place), t.name) for t in situation.targets}
    took, name = min((ms, name) for name, ms in travel.items() if ms is not None)
    action = drive(ActionName.EXPLORE, robot.name, name, str(robot.place))
    return Plan(actions=(_timed(action, robot.free_at_ms, took),))


def _timed(action: Action, start_ms: int, took_ms: int) -> Action:
    return replace(action, start_ms=start_ms, duration_ms=max(1, took_ms))


def test_energy_is_that_of_time_distance_stops_and_turns() -> None:
    kinds = kinds_of()
    energy = EnergyModel(idle_w=1.0, drive_w=10.0, metre_j=100.0, stop_j=1e3, turn_j=(1e4, 1e5, 1e6, 1e7))
    kinds["carrier"] = replace(kinds["carrier"], energy=energy)
    world = SimulatedWorld(drawn_grid(*ANNEX), kinds, [carrier_at(4, 3), rover_at(8, 3)])
    world.advance(0)
    for route in ([(4, 3), (5, 3), (6, 3)], [(6, 3), (5, 3)]):
        world.drive("c1", [Cell(*cell) for cell in route])
        while not world.advance(60_000).finished:
            pass
    world.advance(10_000)
    assert energy_j(world, kinds, {}) == (("c1", 10.0 + 30.0 + 300.0 + 1e3 + 1e7), ("r1", 0.0))


def test_a_carrier_alone_explores_a_hall() -> None:
    ended, watcher = run(drawn_grid(*CORRIDOR), [carrier_at(1, 1)], greedy_strategy())
    assert (ended.status, ended.coverage, ended.remaining) == (Status.COMPLETE, 1.0, ())
    assert (ended.exploration_ms, ended.t_ms) == (4000, 4000)  # at x = 5 it sees the wall at x = 8
    assert ended.distance_m == (("c1", 4.0),)
    # four of seven cells are seen at once, then one a second
    assert ended.known_ms == ((50, 0), (75, 2000), (90, 3000), (95, 3000), (99, 3000), (100, 3000))
    assert ended.mean_known_ms == round((1000 + 2000 + 3000) / 7)
    assert watcher.faults == []
    assert watcher.events[-1] == ended


def test_an_area_of_which_a_part_or_nothing_is_seen() -> None:
    world = SimulatedWorld(drawn_grid(*CORRIDOR), kinds_of(), [carrier_at(1, 1)])
    for reachable in (np.ones((3, 9), dtype=np.bool_), np.zeros((3, 9), dtype=np.bool_)):
        area = ExploredArea(world, world, reachable)
        area.update(world.advance(0))
        told = area.measures(9000)
        if not reachable.any():
            assert (told["known_ms"], told["mean_known_ms"]) == (tuple((p, 0) for p in KNOWN_PERCENT), 0)
            continue
        assert (told["explored_area_m2"], told["reachable_area_m2"]) == (11.0, 27.0)
        assert told["known_ms"] == tuple((percent, None) for percent in KNOWN_PERCENT)
        assert told["mean_known_ms"] == round(16 * 9000 / 27)  # what is never known counts with the end


def test_a_map_that_is_seen_at_once_is_complete_at_once() -> None:
    ended, watcher = run(drawn_grid("####", "#..#", "####"), [carrier_at(1, 1)], greedy_strategy())
    assert (ended.status, ended.t_ms, ended.replans) == (Status.COMPLETE, 0, 0)
    assert not watcher.of(Planned)


def test_a_rover_is_set_down_explores_and_is_picked_up_again() -> None:
    ended, watcher = run(drawn_grid(*ANNEX), [carrier_at(1, 3), rover_on("c1")], greedy_strategy())
    assert (ended.status, ended.coverage) == (Status.COMPLETE, 1.0)
    assert ended.aboard == ("r1",)
    assert ended.deployments == ended.retrievals == 1
    assert ended.reason.endswith("all rovers are aboard")
    assert ended.exploration_ms is not None
    assert ended.exploration_ms < ended.t_ms
    assert watcher.faults == []


def test_without_recovery_a_mission_is_over_when_all_is_seen() -> None:
    ended, _ = run(drawn_grid(*ANNEX), [carrier_at(1, 3), rover_on("c1")], greedy_strategy(), goal=LEAVE)
    assert (ended.status, ended.coverage) == (Status.COMPLETE, 1.0)
    assert (ended.aboard, ended.retrievals) == ((), 0)
    # driving robots first stop at the next cell
    assert ended.exploration_ms is not None
    assert ended.t_ms - ended.exploration_ms < 3000


@pytest.mark.parametrize("strategy", [greedy_strategy, Heuristic])
@pytest.mark.parametrize(
    ("lines", "home", "rover"), [(TWO_ANNEXES, Cell(5, 1), rover_on("c1")), (ANNEX, Cell(1, 3), rover_at(9, 3))]
)
def test_a_team_that_has_to_return_home_does_but_rovers_on_the_ground_have_none(
    strategy: Callable[[], Temporal | Heuristic], lines: tuple[str, ...], home: Cell, rover: PlacedRobot
) -> None:
    ended, watcher = run(drawn_grid(*lines), [carrier_at(*home), rover], strategy(), goal=HOME)
    assert (ended.status, ended.coverage, ended.aboard) == (Status.COMPLETE, 1.0, ("r1",))
    assert watcher.cell["c1"] == home
    assert watcher.faults == []


def test_a_mission_is_complete_although_a_stopped_robot_had_another_action() -> None:
    # the carrier gets the stop command at x = 36; at x = 38, where it stops, it sees the end of the hall
    ended, watcher = run(drawn_grid(*LONG_HALL), [carrier_at(19, 1)], Scripted(nearest_target))
    assert (ended.status, ended.coverage) == (Status.COMPLETE, 1.0)
    assert watcher.faults == []


def test_a_strategy_that_does_nothing_stalls_and_every_frontier_is_named() -> None:
    ended, _ = run(drawn_grid(*LONG_HALL), [carrier_at(20, 1)], Scripted(lambda _: Plan(actions=())))
    assert (ended.status, ended.t_ms) == (Status.STALLED, 0)
    assert ended.reason == "the strategy found no action"
    assert {left.cell for left in ended.remaining} == {Cell(17, 1), Cell(23, 1)}
    assert all(ended.reason in left.reason for left in ended.remaining)


def test_unreachable_ground_is_named_even_when_complete() -> None:
    ended, _ = run(drawn_grid(*ANNEX), [carrier_at(4, 3)], greedy_strategy())
    assert ended.status is Status.COMPLETE
    assert ended.coverage < 1.0
    assert {left.cell.y for left in ended.remaining} == {1}
    assert all("no robot that fits there can get there" in left.reason for left in ended.remaining)


@pytest.mark.parametrize("goal", [HOME, Goal(recover_rovers=True)])
@pytest.mark.parametrize("strategy", [greedy_strategy, Heuristic])
@pytest.mark.parametrize(
    ("lines", "team", "capacity", "failures", "reason"),
    [
        (ANNEX, (rover_at(4, 3, 1), rover_at(5, 3, 2)), 1, {}, "only c1 can get there, with 1 place in all"),
        (ANNEX, (rover_at(4, 3, 1),), 0, {}, "no carrier with places is left"),
        (ANNEX, (rover_on("c1"),), 1, {"c1": 14_000}, "no carrier with places is left; lost: c1 at ("),
        (("#######", "#..#,,#", "#######"), (rover_at(4, 1),), 1, {}, "no carrier with places can get there"),
    ],
)  # fmt: skip
def test_a_mission_that_leaves_a_rover_behind_names_it_with_the_reason(
    goal: Goal,
    strategy: Callable[[], Temporal | Heuristic],
    lines: tuple[str, ...],
    team: tuple[PlacedRobot, ...],
    capacity: int,
    failures: dict[str, int],
    reason: str,
) -> None:
    grid = drawn_grid(*lines)
    carrier = carrier_at(2, len(lines) - 2)
    ended, _ = run(grid, [carrier, *team], strategy(), goal=goal, kinds=kinds_of(capacity=capacity), failures=failures)
    assert ended.status is Status.STALLED
    assert reason in ended.reason
    assert "no place aboard for" in ended.reason


@pytest.mark.parametrize("strategy", [greedy_strategy, Heuristic])
def test_the_rovers_that_can_be_fetched_are_fetched_before_a_mission_stalls(
    strategy: Callable[[], Temporal | Heuristic],
) -> None:
    grid = drawn_grid("##########", "#......#,#", "##########")
    team = [carrier_at(1, 1), rover_at(6, 1, 1), rover_at(8, 1, 2)]
    for planning_time in PlanningTime:
        ended, _ = run(grid, team, strategy(), planning_time=planning_time, kinds=kinds_of(capacity=2))
        assert (ended.status, ended.aboard) == (Status.STALLED, ("r1",))
        assert ended.t_ms < 60_000


def test_a_mission_ends_exactly_at_its_time_limit() -> None:
    ended, _ = run(drawn_grid(*LONG_HALL), [carrier_at(1, 1)], greedy_strategy(), time_ms=2500)
    assert (ended.status, ended.t_ms) == (Status.TIME_LIMIT, 2500)
    assert ended.reason == "time limit of 2.5 s reached"
    assert len(ended.remaining) == 1
    assert 0 < ended.coverage < 1


def test_a_rover_that_is_still_docking_at_the_time_limit_is_not_aboard() -> None:
    team = [carrier_at(1, 1), rover_at(2, 1)]
    ended, events = run(drawn_grid(*CORRIDOR), team, greedy_strategy(), time_ms=9_000)
    assert events.of(ActionStarted)[-1].action.name is ActionName.DOCK
    assert (ended.status, ended.aboard, ended.retrievals) == (Status.TIME_LIMIT, (), 0)


def test_a_cancelled_mission_ends_with_a_report() -> None:
    asked: list[bool] = []

    def cancelled() -> bool:
        asked.append(True)
        return len(asked) > 3

    ended, watcher = run(drawn_grid(*LONG_HALL), [carrier_at(1, 1)], greedy_strategy(), cancelled=cancelled)
    assert ended.status is Status.CANCELLED
    assert len(ended.remaining) == 1
    assert isinstance(watcher.events[-1], MissionEnded)


def test_an_invalid_plan_is_never_followed() -> None:
    def broken(briefing: Briefing) -> Plan:
        return Plan(actions=(drive(ActionName.EXPLORE, "c1", "nowhere", "s_c1"),))

    ended, watcher = run(drawn_grid(*LONG_HALL), [carrier_at(1, 1)], Scripted(broken))
    assert (ended.status, ended.plans_invalid, ended.plans_valid) == (Status.FAILED, 1, 0)
    assert "scripted made an invalid plan" in ended.reason
    assert not watcher.of(ActionStarted)
    assert not watcher.of(Planned)


@pytest.mark.parametrize("planning_time", PlanningTime)
def test_a_strategy_that_runs_on_the_spot_stalls(planning_time: PlanningTime) -> None:
    def on_the_spot(briefing: Briefing) -> Plan:
        """Move between meeting points at the same place, which takes no time."""
        situation = briefing.situation
        here = [m for m in situation.meetings if situation.travel("carrier", "s_c1", m) == 0]
        return Plan(actions=(_timed(drive(ActionName.MOVE, "c1", here[0], "s_c1"), 0, 0),))

    strategy = Scripted(on_the_spot, wall_s=0.001)
    team = [carrier_at(20, 1), rover_on("c1")]
    ended, _ = run(drawn_grid(*LONG_HALL), team, strategy, planning_time=planning_time)
    assert ended.status is Status.STALLED
    assert ended.t_ms <= MAX_FRUITLESS + 1
    assert ended.reason == f"no progress after {MAX_FRUITLESS + 1} replannings"
    assert len(strategy.briefings) == MAX_FRUITLESS + 1


def test_nothing_is_replanned_merely_because_time_passes() -> None:
    # from the west end the carrier has to come back over 20 known cells to see more of the east
    strategy = Scripted(nearest_target)
    ended, watcher = run(drawn_grid(*LONG_HALL), [carrier_at(19, 1)], strategy)
    assert (ended.status, ended.coverage) == (Status.COMPLETE, 1.0)
    turned = next(e for e in watcher.of(DriveStarted) if len(e.steps) > 15)
    quiet = [p for p in watcher.of(Planned) if turned.t_ms < p.t_ms < turned.t_ms + 15_000]
    assert quiet == []
    assert len(strategy.briefings) == len(watcher.of(Planned))


def test_replanning_waits_for_a_second_of_news_unless_something_ends() -> None:
    _, watcher = run(drawn_grid(*LONG_HALL), [carrier_at(1, 1)], greedy_strategy())
    times = [plan.t_ms for plan in watcher.of(Planned)]
    ends = {event.t_ms for event in watcher.of(ActionEnded)}
    assert all(b - a >= LOOK_MS or b in ends for a, b in pairwise(times))


def test_targets_of_a_lost_robot_are_given_to_another() -> None:
    team = [carrier_at(19, 1, 1), carrier_at(20, 1, 2)]
    ended, watcher = run(drawn_grid(*LONG_HALL), team, greedy_strategy(), failures={"c1": 4500})
    assert (ended.status, ended.coverage) == (Status.COMPLETE, 1.0)
    assert [(e.t_ms, e.robot) for e in watcher.of(RobotLost)] == [(4500, "c1")]
    after = [plan for plan in watcher.of(Planned) if plan.t_ms >= 4500]
    assert after[0].t_ms == 4500
    assert trigger_text(after[0].trigger) == "lost: c1"
    assert all(action.robot != "c1" for plan in after for action in plan.actions)
    assert [e.end for e in watcher.of(ActionEnded) if e.action.robot == "c1"][-1] is ActionEnd.LOST
    assert watcher.faults == []


def test_a_mission_whose_robots_are_all_lost_has_failed() -> None:
    team = [carrier_at(1, 3), rover_on("c1")]
    for planning_time in PlanningTime:
        ended, _ = run(drawn_grid(*ANNEX), team, greedy_strategy(), failures={"c1": 1500}, planning_time=planning_time)
        assert (ended.status, ended.reason, ended.t_ms) == (Status.FAILED, "every robot is lost", 1500)
        assert ended.remaining


def test_a_lost_rover_is_not_waited_for() -> None:
    team = [carrier_at(1, 3), rover_on("c1", 1), rover_on("c1", 2)]
    ended, watcher = run(drawn_grid(*ANNEX), team, greedy_strategy(), failures={"r1": 0}, kinds=kinds_of(capacity=2))
    assert (ended.status, ended.coverage) == (Status.COMPLETE, 1.0)
    assert ended.deployments == ended.retrievals == 1
    assert watcher.faults == []


@pytest.mark.parametrize("t_ms", range(500, 60_000, 3_500))
def test_whenever_the_only_carrier_is_lost_the_mission_comes_to_an_end(t_ms: int) -> None:
    team = [carrier_at(1, 3), rover_on("c1")]
    ended, watcher = run(drawn_grid(*ANNEX), team, greedy_strategy(), failures={"c1": t_ms})
    assert ended.status in {Status.COMPLETE, Status.STALLED, Status.FAILED}
    assert watcher.faults == []


def test_targets_that_vanish_while_a_dock_runs_leave_it_running() -> None:
    # c2 sees the rest of the hall while c1 is busy with its rover
    team = [carrier_at(3, 3, 1), carrier_at(7, 3, 2), rover_on("c1")]
    ended, watcher = run(drawn_grid(*ANNEX), team, greedy_strategy())
    ends = [e for e in watcher.of(ActionEnded) if e.action.carrier is not None]
    assert ends
    assert all(e.end is ActionEnd.DONE for e in ends)
    assert (ended.status, ended.coverage) == (Status.COMPLETE, 1.0)
    assert watcher.faults == []


def test_carriers_without_a_place_and_rovers_explore_side_by_side() -> None:
    team = [carrier_at(1, 3), rover_at(1, 1)]
    ended, watcher = run(drawn_grid(*ANNEX), team, greedy_strategy(), goal=LEAVE, kinds=kinds_of(capacity=0))
    assert (ended.status, ended.coverage, ended.deployments) == (Status.COMPLETE, 1.0, 0)
    assert watcher.faults == []
