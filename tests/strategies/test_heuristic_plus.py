"""What the improved baseline does otherwise; positions are in seconds at the carriers' speed, rovers take twice."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import pytest
from hypothesis import given
from situations import carrier, default_types, door, hall, relay, room, rover, rover_left_behind, situation_of
from strategy_briefings import assert_possible, brief, briefings, robot_by_robot, torn_briefings

from marsupial.bench.simulate import simulate
from marsupial.maps.builtin import builtin_scenario
from marsupial.model.mission import Status
from marsupial.model.plan import ActionName, Plan
from marsupial.model.planning import Budget
from marsupial.model.robots import Role
from marsupial.model.situation import Situation
from marsupial.model.strategy import Briefing
from marsupial.planning.greedy import serve
from marsupial.planning.schedule import retime
from marsupial.strategies.heuristic_plus import HeuristicPlus


def decide(
    situation: Situation, previous: Plan | None = None, deployed_at: Mapping[str, str] | None = None
) -> list[str]:
    return robot_by_robot(HeuristicPlus(), brief(situation, previous=previous, deployed_at=deployed_at))


@pytest.mark.parametrize(("far", "explorer"), [(18, "c1"), (20, "r1")])
def test_undocking_and_the_rovers_drive_count(far: int, explorer: str) -> None:
    # the rover would be at its target after 10 + 5 + 4 seconds
    situation = situation_of(
        [carrier(), rover(on="c1")], {"in": room(12), "out": hall(far)}, {"m1": door(10)}, {"c1_start": hall(0)}
    )
    plan = HeuristicPlus().decide(brief(situation)).plan
    assert [a.robot for a in plan.actions if a.name is ActionName.EXPLORE] == [explorer]


def test_a_rover_is_set_down_where_it_gets_to_the_target_soonest_not_at_the_nearest_meeting() -> None:
    situation = situation_of(
        [carrier(), rover(on="c1")], {"t1": room(20)}, {"near": door(5), "far": door(19)}, {"c1_start": hall(0)}
    )
    assert decide(situation)[:2] == ["(move c1 c1_start far)", "(undock r1 c1 far)"]


def test_a_carrier_with_the_rover_aboard_goes_not_one_that_would_have_to_fetch_one() -> None:
    situation = situation_of(
        [carrier(1), carrier(2), rover(1), rover(2, "c2")],
        {"t1": room(22, 2)},
        {"m1": door(-1, 1), "m2": door(20, 2)},
        {"c1_start": hall(0), "c2_start": hall(-5), "r1_start": room(-1, 1)},
    )
    plan = decide(situation)
    assert "(undock r2 c2 m2)" in plan
    assert not any("dock r1" in action for action in plan)


def test_the_target_of_a_rover_on_the_ground_is_left_to_it() -> None:
    situation = situation_of(
        [carrier(), rover(1), rover(2, "c1")],
        {"t1": room(14), "t2": hall(90)},
        {"m1": door(10)},
        {"c1_start": hall(10), "r1_start": room(10)},
        types=default_types(2),
    )
    assert decide(situation) == ["(explore c1 c1_start t2)", "(explore r1 r1_start t1)", "(move r1 t1 m1)"]


@pytest.mark.parametrize(("start", "undocks"), [(8, 0), (6, 1)])
def test_another_rover_is_set_down_in_an_area_where_that_is_20_s_sooner(start: int, undocks: int) -> None:
    # the other one would be at the target after 5 + 20 seconds, the one on the ground after 44 or 48
    situation = situation_of(
        [carrier(), rover(1), rover(2, "c1")],
        {"t1": room(30)},
        {"m1": door(20)},
        {"c1_start": hall(20), "r1_start": room(start)},
        types=default_types(2),
    )
    plan = decide(situation)
    assert sum("undock" in action for action in plan) == undocks
    assert sum("explore" in action for action in plan) == 1


def test_no_rover_is_fetched_for_a_target_of_another_on_the_ground() -> None:
    # r2 would be there after 56 s, r1 after 120
    situation = situation_of(
        [carrier(), rover(1), rover(2)],
        {"t1": room(60, 1)},
        {"m1": door(59, 1), "m2": door(21, 2)},
        {"c1_start": hall(20), "r1_start": room(0, 1), "r2_start": room(21, 2)},
    )
    plan = decide(situation)
    assert "(explore r1 r1_start t1)" in plan
    assert not any("dock" in action for action in plan)


def test_a_rover_finishes_its_area_before_it_is_fetched() -> None:
    situation = situation_of(
        [carrier(), rover()],
        {"own": room(-12, 1), "other": room(22, 2)},
        {"m1": door(-10, 1), "m2": door(20, 2)},
        {"c1_start": hall(0), "r1_start": room(-11, 1)},
    )
    assert decide(situation) == [
        "(move c1 c1_start m1)",
        "(move c1 m1 m2)",
        "(explore r1 r1_start own)",
        "(move r1 own m1)",
        "(dock r1 c1 m1)",
        "(undock r1 c1 m2)",
        "(explore r1 m2 other)",
        "(move r1 other m2)",
    ]


def test_the_rover_that_makes_the_whole_soonest_is_fetched() -> None:
    # r1 is met at once but far from the second room; r2 lies on the way
    situation = situation_of(
        [carrier(), rover(1), rover(2)],
        {"t1": room(52, 3)},
        {"m1": door(-5, 1), "m2": door(40, 2), "m3": door(50, 3)},
        {"c1_start": hall(0), "r1_start": room(-5, 1), "r2_start": room(40, 2)},
    )
    assert "(dock r2 c1 m2)" in decide(situation)


def test_a_rover_without_work_explores_what_no_carrier_was_sent_to() -> None:
    situation = situation_of(
        [carrier(), rover()],
        {"t1": hall(12), "t2": door(3)},
        {"m1": door(1)},
        {"c1_start": hall(11), "r1_start": room(1)},
    )
    assert decide(situation)[:2] == ["(explore c1 c1_start t1)", "(explore r1 r1_start t2)"]


@pytest.mark.parametrize("target", ["t1", "t2"])
def test_between_equals_a_carrier_keeps_its_target(target: str) -> None:
    situation = situation_of([carrier()], {"t1": hall(10), "t2": hall(-10)}, {}, {"c1_start": hall(0)})
    whole, _ = serve(situation)
    previous = retime(situation, [replace(whole.actions[0], origin="c1_start", place=target)])
    assert decide(situation, previous) == [f"(explore c1 c1_start {target})"]


def test_a_carrier_without_a_target_goes_where_another_explores() -> None:
    situation = situation_of(
        [carrier(1), carrier(2)], {"t1": hall(30)}, {}, {"c1_start": hall(0), "c2_start": hall(10)}
    )
    assert decide(situation) == ["(explore c1 c1_start t1)", "(explore c2 c2_start t1)"]


def test_a_rover_that_has_finished_waits_at_the_nearest_meeting_not_where_it_was_set_down() -> None:
    situation = situation_of(
        [carrier(), rover()],
        {"t1": hall(30)},
        {"m1": door(10), "m2": door(2)},
        {"c1_start": hall(20), "r1_start": room(5)},
    )
    assert decide(situation, deployed_at={"r1": "m1"}) == ["(explore c1 c1_start t1)", "(move r1 r1_start m2)"]


def test_a_target_that_takes_two_rides_is_explored_when_there_is_no_other() -> None:
    assert decide(relay())[-1] == "(explore r1 m3 t1)"


def test_a_carrier_without_a_rover_first_fetches_one() -> None:
    assert "(dock r1 c1 m1)" in decide(rover_left_behind())


@given(briefings())
def test_every_plan_can_be_carried_out(briefing: Briefing) -> None:
    assert_possible(briefing.situation, HeuristicPlus().decide(briefing).plan)


@given(torn_briefings())
def test_every_plan_can_be_carried_out_where_ways_lead_in_one_direction_only(briefing: Briefing) -> None:
    assert_possible(briefing.situation, HeuristicPlus().decide(briefing).plan)


@given(briefings())
def test_something_is_explored_whenever_a_planner_could(briefing: Briefing) -> None:
    plan = HeuristicPlus().decide(briefing).plan
    assert bool(plan.explored) == bool(serve(briefing.situation)[0].explored)


@given(briefings())
def test_each_carrier_sets_down_one_rover_at_most(briefing: Briefing) -> None:
    situation = briefing.situation
    plan = HeuristicPlus().decide(briefing).plan
    full = {c.name for c in situation.of_role(Role.CARRIER) if situation.type_of(c.name).capacity < 2}
    undocks = [a.carrier for a in plan.actions if a.name is ActionName.UNDOCK and a.carrier not in full]
    if situation.targets and plan.explored:
        assert len(undocks) == len(set(undocks))


@pytest.mark.parametrize("seed", [1, 2])
def test_a_mission_where_rovers_can_drive_everywhere_completes(seed: int) -> None:
    summary = simulate(
        builtin_scenario("rooms"), strategy_name="heuristic-plus", planner="greedy", budget=Budget(steps=1), seed=seed
    )
    ended = summary.ended
    assert (ended.status, ended.coverage, ended.plans_invalid) == (Status.COMPLETE, 1.0, 0), ended.reason
