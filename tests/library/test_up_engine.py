"""marsupial as an engine of unified-planning."""

import subprocess
import sys
from typing import Any

import pytest
from support.planning.situations import SOLVABLE, one_room, out_of_reach
from support.planning.up_problem import from_up_plan, up_problem, up_validate
from unified_planning.engines.results import PlanGenerationResultStatus
from unified_planning.exceptions import UPUsageError

import marsupial
from marsupial.library.up_engine import situation_of_problem
from marsupial.planning.checker import check


@pytest.fixture(scope="module")
def up() -> Any:
    import unified_planning.shortcuts as shortcuts

    shortcuts.get_environment().credits_stream = None
    marsupial.register_with_unified_planning()
    marsupial.register_with_unified_planning()  # a second call has no effect
    return shortcuts


def test_everything_can_be_imported_from_marsupial_without_unified_planning() -> None:
    code = "import sys; from marsupial import *; print('unified_planning' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=True, capture_output=True, text=True).stdout == "False\n"


@pytest.mark.parametrize("name", SOLVABLE)
def test_problems_of_the_domain_are_read_back_into_their_situations_and_solved(up: Any, name: str) -> None:
    situation = SOLVABLE[name]()
    problem = up_problem(situation)
    assert situation_of_problem(problem) == situation
    with up.OneshotPlanner(name="marsupial", params={"planner": "greedy", "steps": 1}) as planner:
        result = planner.solve(problem)
    assert result.status is PlanGenerationResultStatus.SOLVED_SATISFICING
    plan = from_up_plan(result.plan, situation)
    assert check(situation, plan).valid
    assert up_validate(situation, plan).valid


def test_better_plans_come_one_after_the_other_and_the_last_may_be_proven_best(up: Any) -> None:
    with up.AnytimePlanner(name="marsupial", params={"steps": 20}) as planner:
        results = list(planner.get_solutions(up_problem(one_room())))
    assert {result.status for result in results[:-1]} == {PlanGenerationResultStatus.INTERMEDIATE}
    assert results[-1].status is PlanGenerationResultStatus.SOLVED_OPTIMALLY
    spans = [float(result.metrics["makespan_s"]) for result in results]
    assert spans == sorted(spans, reverse=True)


def test_a_problem_without_a_plan_has_none(up: Any) -> None:
    with up.OneshotPlanner(name="marsupial", params={"steps": 5}) as planner:
        result = planner.solve(up_problem(out_of_reach()))
    assert result.plan is None
    assert result.status in (
        PlanGenerationResultStatus.UNSOLVABLE_PROVEN,
        PlanGenerationResultStatus.UNSOLVABLE_INCOMPLETELY,
    )


@pytest.mark.parametrize("mode", ["OneshotPlanner", "AnytimePlanner"])
def test_the_engine_is_chosen_by_the_kind_of_problem(up: Any, mode: str) -> None:
    with getattr(up, mode)(problem_kind=up_problem(one_room()).kind) as planner:
        assert planner.name == "marsupial"


def test_problems_of_another_domain_and_what_contradicts_itself_are_refused(up: Any) -> None:
    other, odd = up_problem(one_room()), up_problem(one_room())
    other.clear_actions()
    odd.set_initial_value(odd.fluent("num_docked")(odd.object("c1")), 7)
    for problem, told in ((other, "its own domain only"), (odd, "on c1, not 7")):
        with up.OneshotPlanner(name="marsupial") as planner, pytest.raises(UPUsageError, match=told):
            planner.solve(problem)
