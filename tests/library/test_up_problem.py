"""The canonical problem in unified-planning, and its validator beside our checker."""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, assume, given, settings
from hypothesis import strategies as st
from situations import SOLVABLE, in_flight, one_hall, one_room, situations
from up_problem import from_up_plan, up_problem, up_validate

from marsupial.errors import InvalidPlanError, PlanTextError
from marsupial.formats.pddl.plantext import write_plan_text
from marsupial.formats.pddl.text import domain_text, problem_text
from marsupial.library.up_engine import to_up_plan
from marsupial.model.plan import Action, ActionName, Plan
from marsupial.model.robots import Role
from marsupial.model.situation import PlanningType, RobotState, Situation, SituationGoal
from marsupial.planning.checker import check
from marsupial.planning.list_scheduling.greedy import serve

MOVE = Action(name=ActionName.MOVE, start_ms=0, duration_ms=10_000, robot="c1", origin="c1_start", place="m1")
UNDOCK = Action(name=ActionName.UNDOCK, start_ms=10_001, duration_ms=5_000, robot="r1", carrier="c1", place="m1")
EXPLORE = Action(name=ActionName.EXPLORE, start_ms=15_002, duration_ms=4_000, robot="r1", origin="m1", place="t1")
PLAN = Plan.of([MOVE, UNDOCK, EXPLORE])


def _reader() -> Any:
    from unified_planning.io import PDDLReader

    return PDDLReader()


@pytest.mark.parametrize("records", [True, False])
@pytest.mark.parametrize("name", SOLVABLE)
def test_the_problem_equals_what_is_read_from_our_text(name: str, records: bool) -> None:
    situation = SOLVABLE[name]()
    ours = up_problem(situation, name="Demo", records=records)
    theirs = _reader().parse_problem_string(domain_text(), problem_text(situation, name="Demo", records=records))
    assert ours == theirs


@given(situations())
@settings(deadline=None, max_examples=8)
def test_drawn_problems_equal_what_is_read_from_our_text(situation: Situation) -> None:
    assert up_problem(situation) == _reader().parse_problem_string(domain_text(), problem_text(situation))


def test_another_problem_is_not_equal() -> None:
    theirs = _reader().parse_problem_string(domain_text(), problem_text(in_flight()))
    robots = tuple(replace(robot, free_at_ms=robot.free_at_ms + 1) for robot in in_flight().robots)
    assert up_problem(replace(in_flight(), robots=robots)) != theirs


def test_names_that_pddl_cannot_hold_are_escaped_alike() -> None:
    situation = Situation(
        types=(PlanningType(name="Carrier 3", role=Role.CARRIER, capacity=1),),
        robots=(RobotState(name="at", type="Carrier 3", place="start"),),
        targets=(),
        meetings=("Room 1", "m_type"),
        travel_ms={"Carrier 3": np.array([[0, 5, 1], [5, 0, -1], [1, -1, 0]])},
    )
    assert up_problem(situation) == _reader().parse_problem_string(domain_text(), problem_text(situation))


def test_a_plan_goes_there_and_back() -> None:
    situation = one_room()
    up_plan = to_up_plan(PLAN, up_problem(situation), situation)
    start, instance, duration = up_plan.timed_actions[1]
    assert (start, str(instance), duration) == (Fraction(10_001, 1000), "undock(r1, c1, m1)", Fraction(5))
    assert from_up_plan(up_plan, situation) == PLAN


def test_our_plan_text_is_what_unified_planning_reads() -> None:
    situation = one_room()
    problem = up_problem(situation)
    read = _reader().parse_plan_string(problem, write_plan_text(PLAN, situation))
    assert read == to_up_plan(PLAN, problem, situation)


def test_a_plan_in_flight_goes_there_and_back() -> None:
    situation = in_flight()
    drive = replace(MOVE, start_ms=7_000)
    up_plan = to_up_plan(Plan.of([drive]), up_problem(situation), situation)
    assert [(start, duration) for start, _, duration in up_plan.timed_actions] == [(0, 17)]
    assert from_up_plan(up_plan, situation) == Plan.of([drive])


def test_a_plan_that_means_nothing_is_refused() -> None:
    situation = one_room()
    problem = up_problem(situation)
    with pytest.raises(InvalidPlanError, match="there is no nowhere"):
        to_up_plan(Plan.of([replace(MOVE, place="nowhere")]), problem, situation)
    with pytest.raises(InvalidPlanError, match="t1 is no waypoint"):
        to_up_plan(Plan.of([replace(MOVE, place="t1")]), problem, situation)
    up_plan = to_up_plan(PLAN, problem, situation)
    with pytest.raises(PlanTextError, match=r"actions\[1\]: \(undock r1 c1 m1\)"):
        from_up_plan(up_plan, one_hall())


def test_the_library_finds_a_valid_plan_valid() -> None:
    verdict = up_validate(one_room(), PLAN)
    assert verdict.valid
    assert verdict.detail == ""


@pytest.mark.parametrize(
    ("actions", "detail"),
    [
        ([MOVE, UNDOCK], "unsatisfied goals"),
        ([], "unsatisfied goals"),
        ([UNDOCK, EXPLORE], "inapplicable action: undock(r1, c1, m1)"),
        ([MOVE, replace(UNDOCK, start_ms=10_000), EXPLORE], "inapplicable action: undock(r1, c1, m1)"),
        ([MOVE, UNDOCK, replace(EXPLORE, duration_ms=4_001)], "explore(r1, rover_type, m1, t1)"),
        ([MOVE, UNDOCK, replace(EXPLORE, origin="home")], "explore(r1, rover_type, n-home, t1)"),
        ([MOVE, replace(UNDOCK, place="home"), EXPLORE], "n-home is no meeting"),
        ([replace(MOVE, start_ms=-1), UNDOCK, EXPLORE], "starts before c1 is free"),
    ],
)
def test_the_library_says_what_is_wrong(actions: list[Action], detail: str) -> None:
    verdict = up_validate(one_room(), Plan.of(actions))
    assert not verdict.valid
    assert detail in verdict.detail


def test_nothing_to_do_needs_no_action() -> None:
    assert up_validate(one_hall().restricted(targets=frozenset()), Plan(actions=())).valid


def test_any_gap_is_enough_for_the_library() -> None:
    """It knows no epsilon: an action may start a microsecond after what it depends on, but not at the same time."""
    from unified_planning.shortcuts import PlanValidator

    situation = one_room()
    problem = up_problem(situation, records=False)
    for gap, valid in ((Fraction(1, 10**6), True), (Fraction(0), False)):
        plan = to_up_plan(PLAN, problem, situation)
        plan._actions[1] = (10 + gap, *plan._actions[1][1:])
        with PlanValidator(name="up_time_triggered_validator") as validator:
            validator.skip_checks = True
            assert bool(validator.validate(problem, plan)) is valid


@st.composite
def _plans(draw: st.DrawFn) -> tuple[Situation, Plan]:
    """Draw a situation and a plan for it, half of them with one action changed in some way."""
    situation = draw(situations())
    # a rover aboard is bound to its carrier's time; PDDL has no other time for it
    free = {robot.name: robot.free_at_ms for robot in situation.robots}
    robots = (r if r.carrier is None else replace(r, free_at_ms=free[r.carrier]) for r in situation.robots)
    situation = replace(situation, robots=tuple(robots))
    plan, left = serve(situation)
    if draw(st.booleans()):
        situation = situation.restricted(targets=frozenset(situation.target_by_name) - left, goal=SituationGoal())
    actions = list(plan.actions)
    if actions and draw(st.booleans()):
        i = draw(st.integers(0, len(actions) - 1))
        place = st.sampled_from(situation.places)
        changes: dict[str, Any] = draw(
            st.sampled_from(
                [
                    {"start_ms": max(0, actions[i].start_ms + draw(st.integers(-3, 3)))},
                    {"duration_ms": actions[i].duration_ms + 1},
                    {"place": draw(place)},
                    {} if actions[i].origin is None else {"origin": draw(place)},
                ]
            )
        )
        actions[i : i + 1] = [replace(actions[i], **changes)] if draw(st.booleans()) else []
    return situation, Plan.of(actions)


@given(_plans())
@settings(deadline=None, max_examples=60, suppress_health_check=[HealthCheck.too_slow])
def test_the_library_and_our_checker_agree(drawn: tuple[Situation, Plan]) -> None:
    situation, plan = drawn
    # what only one of them allows: a drive to where the robot is, two robots exploring a target at the same moment
    assume(all(action.origin != action.place for action in plan.actions))
    explored = [(action.place, action.end_ms) for action in plan.actions if action.name is ActionName.EXPLORE]
    assume(len(set(explored)) == len(explored))
    ours = check(situation, plan)
    theirs = up_validate(situation, plan)
    assert ours.valid == theirs.valid, (ours.violation, theirs.detail)
