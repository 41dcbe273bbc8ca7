"""Differences of the improved baseline; positions are in seconds at the carriers' speed, rovers take twice as long."""

from collections.abc import Mapping

import pytest
from hypothesis import given
from strategy_briefings import brief, briefings, robot_by_robot
from support.planning.situations import rover_left_behind
from support.planning.spots import carrier, default_types, door, hall, room, rover, situation_of

from marsupial.model import ActionName, Briefing, Plan, Role, Situation
from marsupial.planning.greedy import serve
from marsupial.strategies.heuristic_plus import HeuristicPlus


def decide(
    situation: Situation, previous: Plan | None = None, deployed_at: Mapping[str, str] | None = None
) -> list[str]:
    return robot_by_robot(HeuristicPlus(), brief(situation, previous=previous, deployed_at=deployed_at))


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
    team, starts = [carrier(), rover(1), rover(2, "c1")], {"c1_start": hall(10), "r1_start": room(10)}
    situation = situation_of(team, {"t1": room(14), "t2": hall(90)}, {"m1": door(10)}, starts, types=default_types(2))
    assert decide(situation) == ["(explore c1 c1_start t2)", "(explore r1 r1_start t1)", "(move r1 t1 m1)"]


@pytest.mark.parametrize(("start", "undocks"), [(8, 0), (6, 1)])
def test_another_rover_is_set_down_in_an_area_where_that_is_20_s_sooner(start: int, undocks: int) -> None:
    # the other one would be at the target after 5 + 20 seconds, the one on the ground after 44 or 48
    team, starts = [carrier(), rover(1), rover(2, "c1")], {"c1_start": hall(20), "r1_start": room(start)}
    situation = situation_of(team, {"t1": room(30)}, {"m1": door(20)}, starts, types=default_types(2))
    plan = decide(situation)
    assert sum("undock" in action for action in plan) == undocks
    assert sum("explore" in action for action in plan) == 1


def test_no_rover_is_fetched_for_a_target_of_another_on_the_ground() -> None:
    # r2 would be there after 56 s, r1 after 120
    targets, starts = {"t1": room(60, 1)}, {"c1_start": hall(20), "r1_start": room(0, 1), "r2_start": room(21, 2)}
    situation = situation_of([carrier(), rover(1), rover(2)], targets, {"m1": door(59, 1), "m2": door(21, 2)}, starts)
    plan = decide(situation)
    assert "(explore r1 r1_start t1)" in plan
    assert not any("dock" in action for action in plan)


def test_a_rover_finishes_its_area_before_it_is_fetched() -> None:
    targets, meetings = {"own": room(-12, 1), "other": room(22, 2)}, {"m1": door(-10, 1), "m2": door(20, 2)}
    situation = situation_of([carrier(), rover()], targets, meetings, {"c1_start": hall(0), "r1_start": room(-11, 1)})
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
    starts = {"c1_start": hall(11), "r1_start": room(1)}
    situation = situation_of([carrier(), rover()], {"t1": hall(12), "t2": door(3)}, {"m1": door(1)}, starts)
    assert decide(situation)[:2] == ["(explore c1 c1_start t1)", "(explore r1 r1_start t2)"]


def test_a_carrier_without_a_rover_first_fetches_one() -> None:
    assert "(dock r1 c1 m1)" in decide(rover_left_behind())


@given(briefings())
def test_each_carrier_sets_down_one_rover_at_most(briefing: Briefing) -> None:
    situation = briefing.situation
    plan = HeuristicPlus().decide(briefing).plan
    full = {c.name for c in situation.of_role(Role.CARRIER) if situation.type_of(c.name).capacity < 2}
    undocks = [a.carrier for a in plan.actions if a.name is ActionName.UNDOCK and a.carrier not in full]
    # where no single job reaches a target, list scheduling plans in the strategy's place
    if situation.targets and plan.explored and plan != serve(situation):
        assert len(undocks) == len(set(undocks))
