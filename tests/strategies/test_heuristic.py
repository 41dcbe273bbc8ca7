"""The baseline, sentence by sentence of section IV-B; quotes are the paper's."""

from dataclasses import replace
from itertools import permutations

import pytest
from hypothesis import given
from hypothesis import strategies as st
from strategy_briefings import assert_possible, brief, briefings, robot_by_robot
from support.planning.situations import wrong_carrier
from support.planning.spots import Spot, carrier, default_types, door, hall, room, rover, situation_of

from marsupial.model import ActionName, Briefing, Decision, Outcome, Plan, PlanningType, Role, Situation
from marsupial.strategies.heuristic import Heuristic


def seconds(**by_target: int) -> dict[str, int]:
    return {target: 1000 * s for target, s in by_target.items()}


def decide(*args, **kwargs) -> list[str]:  # type: ignore[no-untyped-def]
    """Return the actions decided on, robot by robot."""
    return robot_by_robot(Heuristic(), brief(*args, **kwargs))


def test_targets_are_assigned_at_the_least_total_cost_not_one_after_the_other() -> None:
    # "assigns robots to target locations based on cost estimates [19]": c1 is nearest to both, the sum decides
    situation = situation_of(
        [carrier(1), carrier(2)], {"t1": hall(4), "t2": hall(-6)}, {}, {"c1_start": hall(0), "c2_start": hall(9)}
    )
    direct = {"c1": seconds(t1=4, t2=6), "c2": seconds(t1=5, t2=15)}
    assert decide(situation, direct) == ["(explore c1 c1_start t2)", "(explore c2 c2_start t1)"]


def test_carriers_are_assigned_whether_they_can_get_to_the_target_or_not() -> None:
    # "independent of whether they are accessible to them or not ... solely based on the estimated travel cost"
    situation = situation_of(
        [carrier(), rover(on="c1")], {"near": room(12), "far": hall(30)}, {"m1": door(10)}, {"c1_start": hall(0)}
    )
    plan = decide(situation, {"c1": seconds(near=12, far=30)}, {"m1": frozenset({"near"})})
    assert plan == ["(move c1 c1_start m1)", "(undock r1 c1 m1)", "(explore r1 m1 near)", "(move r1 near m1)"]
    assert decide(situation, {"c1": seconds(near=31, far=30)}) == ["(explore c1 c1_start far)"]


def test_a_carrier_explores_what_it_can_itself() -> None:
    # "whenever a carrier is assigned to a target that it cannot explore itself": else it does not deploy
    situation = situation_of([carrier(), rover(on="c1")], {"t1": door(12)}, {"m1": door(10)}, {"c1_start": hall(0)})
    assert decide(situation, {"c1": seconds(t1=12)}) == ["(explore c1 c1_start t1)"]


def test_the_nearest_of_the_connecting_meeting_points_is_taken() -> None:
    # "it will move to the nearest connecting meeting point"
    meetings = {"near": door(5, 1), "middle": door(8), "far": door(16)}
    situation = situation_of([carrier(), rover(on="c1")], {"t1": room(20)}, meetings, {"c1_start": hall(0)})
    connects = {"middle": frozenset({"t1"}), "far": frozenset({"t1"})}
    assert decide(situation, {"c1": seconds(t1=20)}, connects)[0] == "(move c1 c1_start middle)"


def test_one_rover_is_set_down_and_the_other_kept() -> None:
    # "and deploy a rover there"
    team, targets = [carrier(), rover(1, "c1"), rover(2, "c1")], {"t1": room(12), "t2": room(14)}
    situation = situation_of(team, targets, {"m1": door(10)}, {"c1_start": hall(0)}, types=default_types(2))
    plan = decide(situation, {"c1": seconds(t1=12, t2=14)}, {"m1": frozenset({"t1", "t2"})})
    assert [a for a in plan if a.startswith("(undock")] == ["(undock r1 c1 m1)"]


def test_the_rover_explores_all_its_area_nearest_first_and_returns() -> None:
    # "will then explore the targets reachable from the meeting point. As soon as it has finished exploring them, it
    # will return to the meeting point."
    targets = {"t1": room(16), "t2": room(12), "t3": room(25, 1)}
    situation = situation_of([carrier(), rover(on="c1")], targets, {"m1": door(10)}, {"c1_start": hall(0)})
    plan = decide(situation, {"c1": seconds(t1=16, t2=12, t3=40)}, {"m1": frozenset({"t1", "t2"})})
    assert plan == [
        "(move c1 c1_start m1)",
        "(undock r1 c1 m1)",
        "(explore r1 m1 t2)",
        "(explore r1 t2 t1)",
        "(move r1 t1 m1)",
    ]


def test_a_rover_on_the_ground_continues_its_area_and_its_carrier_gets_other_targets() -> None:
    starts = {"c1_start": hall(10), "r1_start": room(11)}
    situation = situation_of([carrier(), rover()], {"t1": room(12), "t2": hall(30)}, {"m1": door(10)}, starts)
    plan = decide(situation, {"c1": seconds(t1=2, t2=20)}, {"m1": frozenset({"t1"})}, {"r1": "m1"})
    assert plan == ["(explore c1 c1_start t2)", "(explore r1 r1_start t1)", "(move r1 t1 m1)"]


def test_a_rover_that_has_finished_waits_at_its_meeting_point() -> None:
    situation = situation_of(
        [carrier(), rover()], {"t1": hall(30)}, {"m1": door(10)}, {"c1_start": hall(20), "r1_start": room(12)}
    )
    assert decide(situation, {"c1": seconds(t1=10)}, {}, {"r1": "m1"})[1] == "(move r1 r1_start m1)"
    there = situation_of(
        [carrier(), rover()], {"t1": hall(30)}, {"m1": door(10)}, {"c1_start": hall(20), "r1_start": room(10)}
    )
    assert decide(there, {"c1": seconds(t1=10)}, {}, {"r1": "m1"}) == ["(explore c1 c1_start t1)"]


def two_rooms_with_the_rover_in_the_wrong_one(**options: int) -> Situation:
    meetings, starts = {"m1": door(-10, 1), "m2": door(20, 2)}, {"c1_start": hall(0), "r1_start": room(-11, 1)}
    return situation_of([carrier(), rover()], {"t1": room(22, 2)}, meetings, starts, types=default_types(**options))


def test_a_carrier_without_a_rover_first_retrieves_one() -> None:
    # "as soon as a carrier needs to deploy a rover but has none available, our heuristic requires the carrier to first
    # retrieve a rover"
    situation = two_rooms_with_the_rover_in_the_wrong_one()
    connects = {"m1": frozenset[str](), "m2": frozenset({"t1"})}
    assert decide(situation, {"c1": seconds(t1=22)}, connects, {"r1": "m1"}) == [
        "(move c1 c1_start m1)",
        "(move c1 m1 m2)",
        "(move r1 r1_start m1)",
        "(dock r1 c1 m1)",
        "(undock r1 c1 m2)",
        "(explore r1 m2 t1)",
        "(move r1 t1 m2)",
    ]


def test_a_carrier_that_can_not_carry_retrieves_nobody_and_the_target_is_named() -> None:
    situation = two_rooms_with_the_rover_in_the_wrong_one(capacity=0)
    decision = Heuristic().decide(brief(situation, {"c1": seconds(t1=22)}))
    assert decision.plan.explored == frozenset()
    assert decision.report.detail == "no way to explore t1"


def test_a_carrier_retrieves_no_rover_that_does_not_fit_on_it() -> None:
    situation = wrong_carrier()
    decision = Heuristic().decide(brief(situation, {"c1": seconds(t1=22)}))
    assert decision.plan.explored == frozenset()
    assert decision.report.detail == "no way to explore t1"
    (rover,) = {a.robot for a in Heuristic().decide(brief(situation, {"h1": seconds(t1=22)})).plan.actions if a.carrier}
    assert rover == "r1"


def test_a_rover_with_nothing_left_to_explore_is_retrieved_before_a_busy_one() -> None:
    situation = situation_of(
        [carrier(), rover(1), rover(2)],
        {"t1": room(22, 2), "busy": room(2, 3)},
        {"m1": door(-10, 1), "m2": door(20, 2), "m3": door(1, 3)},
        {"c1_start": hall(0), "r1_start": room(1, 3), "r2_start": room(-11, 1)},
    )
    connects = {"m2": frozenset({"t1"}), "m3": frozenset({"busy"})}
    plan = decide(situation, {"c1": seconds(t1=22, busy=2)}, connects, {"r1": "m3", "r2": "m1"})
    assert "(dock r2 c1 m1)" in plan
    assert "(explore r1 r1_start busy)" in plan


def test_a_target_that_the_nearest_carrier_can_not_serve_is_left_to_another() -> None:
    team = [carrier(1), carrier(2), rover(on="c2")]
    situation = situation_of(team, {"t1": room(12)}, {"m1": door(10)}, {"c1_start": hall(9), "c2_start": hall(0)})
    plan = decide(situation, {"c1": seconds(t1=3), "c2": seconds(t1=12)}, {"m1": frozenset({"t1"})})
    assert plan[:2] == ["(move c2 c2_start m1)", "(undock r1 c2 m1)"]


def test_the_rover_set_down_is_of_a_type_that_gets_from_there_to_the_target() -> None:
    types = (*default_types(2), PlanningType(name="climber", role=Role.ROVER, dock_ms=8_000, undock_ms=4_000))
    robots = [carrier(), rover(on="c1"), replace(rover(2, "c1"), type="climber")]
    targets, starts = {"t1": Spot(22_000, {"rover": 1, "climber": 2})}, {"c1_start": hall(0)}
    situation = situation_of(robots, targets, {"m1": Spot(20_000, {"carrier": 0, "climber": 2})}, starts, types=types)
    assert "(undock r2 c1 m1)" in decide(situation, {"c1": seconds(t1=22)}, {"m1": frozenset({"t1"})})


def test_with_nothing_to_do_the_plan_is_empty_and_the_outcome_says_so() -> None:
    situation = situation_of([carrier()], {}, {}, {"c1_start": hall(0)})
    decision = Heuristic().decide(brief(situation, {}))
    assert (decision.plan.actions, decision.report.outcome) == ((), Outcome.NO_PLAN)


def decision_on(briefing: Briefing) -> Decision:
    return Heuristic().decide(briefing)


@given(briefings())
def test_no_plan_is_ever_invalid(briefing: Briefing) -> None:
    assert_possible(briefing.situation, decision_on(briefing).plan)


@given(briefings())
def test_no_target_is_explored_twice_and_no_carrier_serves_two(briefing: Briefing) -> None:
    plan: Plan = decision_on(briefing).plan
    explores = [action for action in plan.actions if action.name is ActionName.EXPLORE]
    assert len(explores) == len(plan.explored)
    for robot in briefing.situation.of_role(Role.CARRIER):
        mine = [a for a in explores if a.robot == robot.name]
        mine += [a for a in plan.actions if a.name is ActionName.UNDOCK and a.carrier == robot.name]
        if briefing.situation.targets:
            assert len(mine) <= 1


@given(st.lists(st.lists(st.integers(1, 30), min_size=3, max_size=3), min_size=1, max_size=3))
def test_the_assignment_is_optimal(costs: list[list[int]]) -> None:
    targets = ["t1", "t2", "t3"]
    team, starts = [carrier(i + 1) for i in range(len(costs))], {f"c{i + 1}_start": hall(0) for i in range(len(costs))}
    situation = situation_of(team, {name: hall(5) for name in targets}, {}, starts)
    direct = {f"c{i + 1}": dict(zip(targets, row, strict=True)) for i, row in enumerate(costs)}
    plan = decision_on(brief(situation, direct)).plan
    total = sum(direct[action.robot][action.place] for action in plan.actions)
    best = min(sum(costs[i][j] for i, j in enumerate(order)) for order in permutations(range(3), len(costs)))
    assert len(plan.actions) == len(costs)
    assert total == best


@pytest.mark.parametrize("free_at_ms", [0, 9_000])
def test_a_carrier_that_is_still_docking_counts_as_that_much_farther(free_at_ms: int) -> None:
    team = [carrier(1, free_at_ms=free_at_ms), carrier(2)]
    situation = situation_of(team, {"t1": hall(4)}, {}, {"c1_start": hall(0), "c2_start": hall(10)})
    plan = decide(situation, {"c1": seconds(t1=4), "c2": seconds(t1=6)})
    assert plan == (["(explore c2 c2_start t1)"] if free_at_ms else ["(explore c1 c1_start t1)"])
