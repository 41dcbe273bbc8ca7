from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from support.planning.drawn_situations import situations, with_closed_roads
from support.planning.situations import full_carrier, many_rooms, one_room
from support.planning.spots import Spot, carrier, default_types, door, hall, room, rover, situation_of

from marsupial.model.plan import ActionName, Plan
from marsupial.model.planning import Budget, Finished, Improved, Outcome
from marsupial.model.robots import Role
from marsupial.model.situation import UNREACHABLE, PlanningType, RobotState, Situation, SituationGoal, TargetInfo
from marsupial.planning.checker import check
from marsupial.planning.greedy import ROUNDS, Greedy, serve
from marsupial.planning.schedule.costs import Costs
from marsupial.planning.schedule.recovery import recover
from marsupial.planning.schedule.timeline import Timeline

ENOUGH = Budget(steps=ROUNDS)


def solve(situation: Situation, budget: Budget = ENOUGH, start: Plan | None = None) -> tuple[list[Plan], Finished]:
    *improved, finished = Greedy().solve(situation, budget, start=start)
    assert isinstance(finished, Finished)
    return [event.plan for event in improved if isinstance(event, Improved)], finished


def steps(plan: Plan) -> list[str]:
    return [str(action) for action in plan.actions]


def exploring_only(situation: Situation) -> Situation:
    return replace(situation, goal=SituationGoal())


@pytest.mark.parametrize(
    ("target", "far_door", "start", "last"),
    [
        (12, 12, 4, ["(explore r1 r1_start t1)"]),
        (102, 100, 1, ["(dock r1 c1 m1)", "(move c1 m1 m2)", "(undock r1 c1 m2)", "(explore r1 m2 t1)"]),
    ],
)
def test_a_rover_drives_or_is_carried_whichever_is_sooner(target: int, far_door: int, start: int, last: list[str]):
    meetings, starts = {"m1": door(1), "m2": door(far_door)}, {"c1_start": hall(0), "r1_start": room(start)}
    (plan,), _ = solve(situation_of([carrier(), rover()], {"t1": room(target)}, meetings, starts))
    assert steps(plan)[-4:] == last


def test_a_full_carrier_makes_room_for_the_rover_that_is_needed() -> None:
    plans, _ = solve(full_carrier())
    exchange = [str(a) for a in plans[-1].actions if a.carrier == "c1"]
    assert exchange == ["(undock r1 c1 m1)", "(dock k1 c1 m1)", "(undock k1 c1 m2)"]


def test_two_robots_share_the_work() -> None:
    situation = situation_of(
        [carrier(1), carrier(2)], {"t1": hall(-9), "t2": hall(9)}, {}, {"c1_start": hall(-1), "c2_start": hall(1)}
    )
    (plan,), _ = solve(situation)
    assert plan.makespan_ms == 8_000


def test_a_far_target_is_not_left_for_the_end() -> None:
    targets, starts = {"near": hall(4), "mid": hall(8), "far": hall(-10)}, {"c1_start": hall(0), "c2_start": hall(1)}
    situation = situation_of([carrier(1), carrier(2)], targets, {}, starts)
    assert solve(situation)[0][-1].makespan_ms == 10_000


def test_no_rover_takes_the_only_place_another_one_could_have() -> None:
    """c1 is nearest to both rovers, but r2 can reach no other carrier."""
    situation = situation_of(
        [carrier(1), carrier(2), rover(1), rover(2)],
        {},
        {"m1": door(0, 1), "m2": door(2, 2), "m3": door(90, 1, carrier_zone=1)},
        {"c1_start": hall(1), "c2_start": hall(90, 1), "r1_start": room(0, 1), "r2_start": room(3, 2)},
        goal=SituationGoal(recover_rovers=True),
    )
    (plan,), _ = solve(situation)
    assert {a.robot: a.carrier for a in plan.actions if a.name is ActionName.DOCK} == {"r1": "c2", "r2": "c1"}


def test_a_rover_aboard_changes_carriers_if_its_place_is_needed() -> None:
    """r2 can only board c1, whose place is taken by r1; r1 can drive from m1 to c2."""
    situation = situation_of(
        [carrier(1), carrier(2), rover(1, "c1"), rover(2)],
        {},
        {"m1": door(0, 1), "m2": door(2, 2), "m3": door(9, 1, carrier_zone=1)},
        {"c1_start": hall(1), "c2_start": hall(9, 1), "r2_start": room(3, 2)},
        goal=SituationGoal(recover_rovers=True),
    )
    plans, finished = solve(situation)
    assert finished.outcome is Outcome.SATISFICING
    assert check(situation, plans[-1]).valid
    assert {a.robot: a.carrier for a in plans[-1].actions if a.name is ActionName.DOCK} == {"r1": "c2", "r2": "c1"}


@pytest.mark.parametrize(("lift", "capacity"), [(1, 2), (2, 3)])
def test_a_carrier_that_takes_rovers_to_another_is_not_filled_first(lift: int, capacity: int) -> None:
    """Only the lift reaches the rovers, and it meets the carrier at m2 only; there is exactly one place for each."""
    number = lift + capacity
    situation = situation_of(
        [RobotState(name="lift", type="lift", place="lift_start"), carrier(), *(rover(i) for i in range(number))],
        {},
        {"m1": Spot(10_000, {"lift": 0, "rover": 1}), "m2": Spot(20_000, {"lift": 0, "carrier": 0, "rover": 2})},
        {
            "lift_start": Spot(0, {"lift": 0}),
            "c1_start": hall(30),
            **{f"r{i}_start": room(12, 1) for i in range(number)},
        },
        types=(*default_types(capacity), PlanningType(name="lift", role=Role.CARRIER, capacity=lift)),
        goal=SituationGoal(recover_rovers=True),
    )
    plans, finished = solve(situation)
    assert finished.outcome is Outcome.SATISFICING
    assert check(situation, plans[-1]).valid


def one_way_street() -> Situation:
    """Return: each of two targets can be reached from the start, but not one from the other."""
    table = np.array([[0, 5, 9], [UNREACHABLE, 0, UNREACHABLE], [UNREACHABLE, UNREACHABLE, 0]])
    return Situation(
        types=(PlanningType(name="carrier", role=Role.CARRIER),),
        robots=(RobotState(name="c1", type="carrier", place="c1_start"),),
        targets=tuple(TargetInfo(name=name, explorers=frozenset({"carrier"})) for name in ("t1", "t2")),
        meetings=(),
        travel_ms={"carrier": table},
    )


def test_without_plan_and_proof_the_first_target_left_is_named() -> None:
    plans, finished = solve(one_way_street())
    assert (plans, finished.outcome) == ([], Outcome.NO_PLAN)
    assert finished.detail == "list scheduling found no way to t2"


def test_serving_leaves_out_what_can_not_be_served() -> None:
    plan, unserved = serve(one_way_street())
    assert steps(plan) == ["(explore c1 c1_start t1)"]
    assert unserved == {"t2"}


def test_serving_reaches_what_it_can_of_the_rest() -> None:
    situation = situation_of(
        [carrier(home="h1"), rover(1), rover(2)],
        {"t1": room(7, 9)},
        {"m1": door(1)},
        {"c1_start": hall(0), "r1_start": room(2), "r2_start": room(3)},
        homes={"h1": hall(0)},
        goal=SituationGoal(recover_rovers=True, return_home=True),
    )
    plan, unserved = serve(situation)
    assert unserved == {"t1"}
    assert [str(a) for a in plan.actions if a.robot == "c1" or a.carrier] == [
        "(move c1 c1_start m1)",
        "(dock r1 c1 m1)",
        "(move c1 m1 h1)",
    ]


def test_a_plan_to_start_from_comes_first_and_is_only_beaten_by_shorter_ones() -> None:
    best = solve(one_room())[0][-1]
    plans, finished = solve(one_room(), start=best)
    assert plans == [best]
    assert finished.outcome is Outcome.SATISFICING


def test_the_smallest_budget_gives_an_answer() -> None:
    for budget in (Budget(steps=1), Budget(seconds=1e-9)):
        assert len(solve(many_rooms(2, 2, 8, 4), budget)[0]) == 1


def test_more_rounds_help_on_a_big_situation() -> None:
    situation = many_rooms(6, 3, 40, 16, seed=1)
    plans, _ = solve(situation)
    assert len(plans) > 1
    assert all(check(situation, plan).valid for plan in plans)


def test_a_carrier_that_is_nearer_but_busy_is_passed_over() -> None:
    team, starts = [carrier(1, free_at_ms=60_000), carrier(2)], {"c1_start": hall(5), "c2_start": hall(0)}
    (plan,), _ = solve(situation_of(team, {"t1": hall(5)}, {}, starts))
    assert steps(plan) == ["(explore c2 c2_start t1)"]


def test_a_meeting_off_the_line_is_weighed_by_the_whole_way() -> None:
    meetings = {"m1": Spot(8_000, {"carrier": 0, "rover": 0}), "m2": Spot(19_000, {"carrier": 0, "rover": 0})}
    situation = situation_of([carrier(), rover(on="c1")], {"t1": room(20)}, meetings, {"c1_start": hall(0)})
    (plan,), _ = solve(situation)
    assert "(undock r1 c1 m2)" in steps(plan)


@given(situations())
def test_every_plan_passes_the_checker_and_its_absence_is_proven(situation: Situation) -> None:
    """If all roads are two-way, greedy finds a plan if there is one."""
    plans, finished = solve(situation, Budget(steps=3))
    for plan in plans:
        assert check(situation, plan).valid, check(situation, plan).violation
    assert finished.outcome is (Outcome.SATISFICING if plans else Outcome.UNSOLVABLE), finished.detail


@given(situations())
def test_plans_that_serve_a_part_are_feasible(situation: Situation) -> None:
    plan, unserved = serve(situation)
    found = check(exploring_only(situation), plan, targets=plan.explored)
    assert found.valid, found.violation
    assert unserved == {target.name for target in situation.targets} - plan.explored


@given(with_closed_roads())
def test_one_way_roads_make_no_invalid_plans(situation: Situation) -> None:
    plans, finished = solve(situation, Budget(steps=3))
    assert all(check(situation, plan).valid for plan in plans)
    assert (finished.outcome is Outcome.SATISFICING) == bool(plans)
    plan, _ = serve(situation)
    assert check(exploring_only(situation), plan, targets=plan.explored).valid


def test_a_rover_that_finds_no_place_on_a_carrier_is_named() -> None:
    starts = {"c1_start": hall(0), "r1_start": door(5), "r2_start": door(9)}
    situation = situation_of([carrier(), rover(), rover(2)], {}, {"m1": door(5)}, starts)
    timeline, trouble = recover(Timeline.of(situation), Costs(situation))
    assert [action.robot for action in timeline.actions if action.name is ActionName.DOCK] == ["r1"]
    assert trouble == "list scheduling found no place on a carrier for r2"
