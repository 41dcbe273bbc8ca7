"""The canonical problem in unified-planning, and its validator beside our checker."""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction

import pytest
from situations import in_flight, one_hall, one_room
from up_problem import from_up_plan, up_problem, up_validate

from marsupial.errors import InvalidPlanError, PlanTextError
from marsupial.formats.pddl.plantext import write_plan_text
from marsupial.library.up_engine import to_up_plan
from marsupial.model.plan import Action, ActionName, Plan

MOVE = Action(name=ActionName.MOVE, start_ms=0, duration_ms=10_000, robot="c1", origin="c1_start", place="m1")
UNDOCK = Action(name=ActionName.UNDOCK, start_ms=10_001, duration_ms=5_000, robot="r1", carrier="c1", place="m1")
EXPLORE = Action(name=ActionName.EXPLORE, start_ms=15_002, duration_ms=4_000, robot="r1", origin="m1", place="t1")
PLAN = Plan.of([MOVE, UNDOCK, EXPLORE])


def test_a_plan_goes_there_and_back() -> None:
    situation = one_room()
    up_plan = to_up_plan(PLAN, up_problem(situation), situation)
    start, instance, duration = up_plan.timed_actions[1]
    assert (start, str(instance), duration) == (Fraction(10_001, 1000), "undock(r1, c1, m1)", Fraction(5))
    assert from_up_plan(up_plan, situation) == PLAN


def test_our_plan_text_is_what_unified_planning_reads() -> None:
    from unified_planning.io import PDDLReader

    situation = one_room()
    problem = up_problem(situation)
    read = PDDLReader().parse_plan_string(problem, write_plan_text(PLAN, situation))
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
