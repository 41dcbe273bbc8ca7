"""The canonical problem in unified-planning, and its validator compared with our checker."""

from dataclasses import replace
from fractions import Fraction

import pytest
from support.planning.situations import in_flight, one_hall, one_room
from support.planning.up_problem import from_up_plan, up_problem

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
