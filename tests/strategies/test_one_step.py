"""The one-step assignment; positions are in seconds at the carriers' speed, rovers take twice as long."""

from dataclasses import replace

import pytest
from strategy_briefings import brief, robot_by_robot
from support.planning.situations import full_carrier, out_of_reach, rover_left_behind
from support.planning.spots import Spot, carrier, default_types, door, hall, room, rover, situation_of

from marsupial.model import Plan, Situation
from marsupial.strategies.one_step import OneStep


def decide(situation: Situation, previous: Plan | None = None) -> list[str]:
    return robot_by_robot(OneStep(), brief(situation, previous=previous))


def test_the_sum_of_arrivals_decides_not_the_nearest_pair() -> None:
    situation = situation_of(
        [carrier(1), carrier(2)], {"t1": hall(4), "t2": hall(-6)}, {}, {"c1_start": hall(0), "c2_start": hall(9)}
    )
    assert decide(situation) == ["(explore c1 c1_start t2)", "(explore c2 c2_start t1)"]


@pytest.mark.parametrize(("busy_ms", "rover_name"), [(0, "r1"), (9_000, "r2")])
def test_a_robot_that_is_busy_arrives_later(busy_ms: int, rover_name: str) -> None:
    team = [carrier(1, free_at_ms=busy_ms), carrier(2), rover(1, "c1"), rover(2, "c2")]
    situation = situation_of(team, {"t1": room(12)}, {"m1": door(10)}, {"c1_start": hall(0), "c2_start": hall(-5)})
    assert decide(situation)[-1] == f"(explore {rover_name} m1 t1)"


def test_a_carrier_without_a_rover_fetches_one_from_the_ground() -> None:
    assert decide(rover_left_behind()) == [
        "(move c1 c1_start m1)",
        "(move c1 m1 m2)",
        "(move r1 r1_start m1)",
        "(dock r1 c1 m1)",
        "(undock r1 c1 m2)",
        "(explore r1 m2 t1)",
    ]


def test_a_rover_with_a_target_of_its_own_is_not_fetched() -> None:
    targets, meetings = {"own": room(-90, 1), "other": room(22, 2)}, {"m1": door(-10, 1), "m2": door(20, 2)}
    situation = situation_of([carrier(), rover()], targets, meetings, {"c1_start": hall(0), "r1_start": room(-11, 1)})
    assert decide(situation) == ["(explore r1 r1_start own)"]


def test_two_carriers_do_not_fetch_the_same_rover_and_the_other_does_something_else() -> None:
    situation = situation_of(
        [carrier(1), carrier(2), rover()],
        {"t1": room(22, 2), "t2": room(26, 2), "t3": hall(300)},
        {"m1": door(-10, 1), "m2": door(20, 2)},
        {"c1_start": hall(0), "c2_start": hall(1), "r1_start": room(-11, 1)},
    )
    plan = decide(situation)
    assert "(dock r1 c1 m1)" in plan
    assert "(explore c2 c2_start t3)" in plan
    assert sum("explore r1" in action for action in plan) == 1


def test_a_full_carrier_exchanges_its_rover_for_one_that_can_explore_the_target() -> None:
    plan = decide(full_carrier())
    assert "(undock r1 c1 m1)" in plan
    assert "(explore k1 m2 t1)" in plan


def test_a_rover_of_a_type_that_can_not_explore_the_target_stays_aboard() -> None:
    types = (*default_types(2), replace(default_types()[1], name="climber"))
    situation = situation_of(
        [carrier(), rover(1, "c1"), replace(rover(2, "c1"), type="climber")],
        {"t1": Spot(22_000, {"climber": 2})},
        {"m1": Spot(20_000, {"carrier": 0, "rover": 1, "climber": 2})},
        {"c1_start": hall(0)},
        types=types,
    )
    assert [action for action in decide(situation) if "undock" in action] == ["(undock r2 c1 m1)"]


def test_unexplorable_targets_are_named_once_nothing_else_is_left() -> None:
    lonely = out_of_reach().restricted(targets=frozenset({"t2"}))
    decision = OneStep().decide(brief(lonely))
    assert (decision.plan.actions, decision.report.detail) == ((), "no way to explore t2")
