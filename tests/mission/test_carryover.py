from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from mission_fakes import drive, meet
from support.planning.drawn_situations import situations
from support.planning.situations import bring_them_home, in_flight, one_hall, one_room, two_rooms
from support.planning.spots import carrier, door, hall, room, rover, situation_of

from marsupial.maps.targets import Target
from marsupial.mission.carryover import carried_over, same_target
from marsupial.model import Action, ActionName, Cell, Plan, Situation, SituationGoal
from marsupial.planning.checker import check
from marsupial.planning.greedy import serve

MOVE, EXPLORE, DOCK, UNDOCK = ActionName.MOVE, ActionName.EXPLORE, ActionName.DOCK, ActionName.UNDOCK
RANGES = {"carrier": 8.0, "rover": 4.0}


def itself(situation: Situation) -> dict[str, str]:
    return {target.name: target.name for target in situation.targets}


def words(plan: Plan | None) -> list[str]:
    return [] if plan is None else [str(action) for action in plan.actions]


def target(name: str, x: int, y: int = 0, *kinds: str) -> Target:
    viewpoints = {kind: Cell(x, y) for kind in kinds or ("carrier",)}
    return Target(name=name, cell=Cell(x, y), viewpoints=viewpoints, cells=np.array([0]), reveal_m2=1.0)


def test_a_target_may_shift_by_half_the_shortest_range_of_its_explorers() -> None:
    assert same_target(target("old", 0), [target("new", 4)], RANGES) is not None
    assert same_target(target("old", 0), [target("new", 5)], RANGES) is None
    assert same_target(target("old", 0, 0, "carrier", "rover"), [target("new", 2)], RANGES) is not None
    assert same_target(target("old", 0, 0, "carrier", "rover"), [target("new", 3)], RANGES) is None


def test_the_nearest_of_several_targets_is_the_same_one() -> None:
    found = same_target(target("old", 0), [target("a", 3), target("b", 2), target("c", 4)], RANGES)
    assert found.name == "b"


def test_a_target_for_other_robots_is_another_target() -> None:
    assert same_target(target("old", 0, 0, "carrier"), [target("new", 0, 0, "rover")], RANGES) is None


def test_a_plan_that_still_fits_stays_as_it_is() -> None:
    situation = two_rooms()
    plan, _ = serve(situation)
    assert carried_over(plan.actions, situation, itself(situation)) == plan


def test_targets_take_their_new_names_and_times_are_those_of_the_new_moment() -> None:
    plan = carried_over([drive(EXPLORE, "c1", "old", "s")], one_hall(), {"old": "t2"})
    assert words(plan) == ["(explore c1 c1_start t2)"]
    assert [(action.start_ms, action.duration_ms) for action in plan.actions] == [(0, 30_000)]


def test_a_vanished_target_is_left_out_and_the_next_drive_starts_at_the_robot() -> None:
    actions = [drive(EXPLORE, "c1", "gone", "s"), drive(EXPLORE, "c1", "t2", "gone")]
    assert words(carried_over(actions, one_hall(), {"t2": "t2"})) == ["(explore c1 c1_start t2)"]


def test_two_targets_that_became_one_are_explored_once() -> None:
    actions = [drive(EXPLORE, "c1", "a", "s"), drive(EXPLORE, "c1", "t2", "a"), drive(EXPLORE, "c1", "b", "t2")]
    plan = carried_over(actions, one_hall(), {"a": "t1", "b": "t1", "t2": "t2"})
    assert words(plan) == ["(explore c1 c1_start t1)", "(explore c1 t1 t2)"]


def test_actions_of_a_lost_robot_are_left_out() -> None:
    actions = [drive(EXPLORE, "c9", "t1", "s"), meet(DOCK, "r1", "c9", "m1"), drive(EXPLORE, "c1", "t2", "s")]
    assert words(carried_over(actions, one_hall(), {"t1": "t1", "t2": "t2"})) == ["(explore c1 c1_start t2)"]


def test_a_vanished_meeting_point_removes_the_deployment_there() -> None:
    situation = one_room()
    actions = [drive(MOVE, "c1", "m9", "s"), meet(UNDOCK, "r1", "c1", "m9"), drive(EXPLORE, "r1", "t1", "m9")]
    assert carried_over(actions, situation, itself(situation)) is None


def test_a_docking_that_is_under_way_is_not_planned_again() -> None:
    situation = in_flight()
    actions = [meet(DOCK, "r1", "c1", "m1"), drive(EXPLORE, "r2", "t2", "s")]
    assert words(carried_over(actions, situation, itself(situation))) == ["(explore r2 r2_start t2)"]


def test_an_undocking_that_is_under_way_is_not_planned_again() -> None:
    team = [carrier(), rover(free_at_ms=4000)]
    situation = situation_of(team, {"t1": room(12)}, {"m1": door(10)}, {"c1_start": hall(10), "r1_start": room(10)})
    actions = [meet(UNDOCK, "r1", "c1", "m1"), drive(EXPLORE, "r1", "t1", "m1")]
    plan = carried_over(actions, situation, itself(situation))
    assert words(plan) == ["(explore r1 r1_start t1)"]
    assert plan.actions[0].start_ms == 4000


def test_one_impossible_action_does_not_affect_the_others() -> None:
    situation = situation_of([carrier(1), carrier(2)], {"t1": hall(5), "t2": hall(5, 1)}, {},
                             {"c1_start": hall(0), "c2_start": hall(1)})  # fmt: skip
    actions = [drive(EXPLORE, "c1", "t2", "s"), drive(EXPLORE, "c2", "t1", "s")]
    assert words(carried_over(actions, situation, itself(situation))) == ["(explore c2 c2_start t1)"]


def test_no_robot_docks_without_its_partner() -> None:
    situation = replace(bring_them_home(), goal=SituationGoal())
    assert carried_over([meet(DOCK, "r1", "c1", "m1")], situation, {}) is None
    actions = [drive(MOVE, "r2", "m1", "s"), meet(DOCK, "r2", "c1", "m1")]
    assert words(carried_over(actions, situation, {})) == ["(move r2 r2_start m1)"]


@st.composite
def moments(draw: st.DrawFn) -> tuple[Sequence[Action], Situation, dict[str, str]]:
    """Draw a plan of one situation, some of its actions lost, another situation, and new names."""
    before, now = draw(situations()), draw(situations())
    plan, _ = serve(before)
    kept = [action for action in plan.actions if draw(st.integers(0, 4))]
    names = [target.name for target in now.targets]
    renamed = {t.name: draw(st.sampled_from(names)) for t in before.targets if names and draw(st.booleans())}
    return kept, now, renamed


@given(moments())
def test_carried_over_plans_are_accepted_by_the_checker(
    moment: tuple[Sequence[Action], Situation, dict[str, str]],
) -> None:
    actions, situation, renamed = moment
    plan = carried_over(actions, situation, renamed)
    if plan is not None:
        verdict = check(situation, plan, targets=plan.explored)
        assert verdict.valid, verdict.violation
        assert plan.actions


@given(situations(goals=False))
def test_the_greedy_plan_of_a_moment_is_carried_over_to_that_moment_whole(situation: Situation) -> None:
    plan, _ = serve(situation)
    same = carried_over(plan.actions, situation, itself(situation))
    assert (plan if plan.actions else None) == same


@pytest.mark.parametrize("wish", [SituationGoal(recover_rovers=True), SituationGoal(return_home=True)])
def test_a_plan_that_misses_the_goal_is_not_carried_over(wish: SituationGoal) -> None:
    situation = situation_of([carrier(home="h"), rover()], {}, {"m1": door(5)},
                             {"c1_start": hall(0), "r1_start": door(6)}, homes={"h": hall(0)}, goal=wish)  # fmt: skip
    assert carried_over([drive(MOVE, "c1", "m1", "s")], situation, {}) is None
