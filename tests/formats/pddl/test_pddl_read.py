"""Problems of the canonical domain read back."""

import re
from time import process_time

import pytest
from hypothesis import HealthCheck, given, settings
from support.planning.drawn_situations import situations
from support.planning.odd_situations import odd_situations
from support.planning.situations import SOLVABLE, in_flight, one_room

from marsupial.errors import SituationError
from marsupial.formats.pddl.facts import exact
from marsupial.formats.pddl.read import read_problem
from marsupial.formats.pddl.text import problem_text
from marsupial.model.situation import Situation, SituationGoal


@pytest.mark.parametrize("name", SOLVABLE)
def test_a_problem_reads_back_as_the_same_situation(name: str) -> None:
    situation = SOLVABLE[name]()
    assert read_problem(problem_text(situation)) == situation


@given(situations())
def test_every_drawn_situation_reads_back(situation: Situation) -> None:
    assert read_problem(problem_text(situation)) == situation


@given(odd_situations())
@settings(suppress_health_check=[HealthCheck.too_slow, HealthCheck.data_too_large])
def test_odd_situations_read_back_too(situation: Situation) -> None:
    text = problem_text(situation)
    again = read_problem(text)
    assert again == situation
    assert problem_text(again) == text


@given(situations())
@settings(max_examples=40)
def test_without_records_the_same_problem_is_read(situation: Situation) -> None:
    text = problem_text(situation, records=False)
    assert problem_text(read_problem(text), records=False) == text


def test_case_and_layout_are_ignored() -> None:
    situation = one_room()
    text = problem_text(situation)
    assert read_problem(text.upper().replace("\n", "\r\n")) == situation


def test_flags_follow_from_the_goal_if_records_are_missing() -> None:
    situation = one_room(goal=SituationGoal(recover_rovers=True))
    assert read_problem(problem_text(situation, records=False)).goal == SituationGoal(recover_rovers=True)
    situation = one_room(goal=SituationGoal(return_home=True))
    again = read_problem(problem_text(situation, records=False))
    assert again.goal == SituationGoal(return_home=True)
    assert again.robot_by_name["c1"].home == "home"


def _broken(old: str, new: str) -> tuple[str, int]:
    """Return `in_flight` as text with one change, and the line of the change."""
    text = problem_text(in_flight())
    assert text.count(old) == 1, old
    return text.replace(old, new), text[: text.index(old)].count("\n") + 1


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("c1 - carrier", "c1 - lorry", "c1: type must be one of"),
        ("m1 - meeting", "m1 - meeting c1 - meeting", "object c1 is declared twice"),
        ("(on r1 c1)", "(on r1 c7)", "there is no object c7"),
        ("(on r1 c1)", "(on c1 r1)", "c1 is a carrier, not a rover"),
        ("(on r1 c1)", "(on r1)", "on takes 2 arguments, got 1"),
        ("(on r1 c1)", "(glued r1 c1)", "unknown predicate glued"),
        ("(on r1 c1)", "(on r1 c1) (not (on r1 c1))", "(not (on r1 c1)) contradicts line"),
        ("(on r1 c1)", "(on r1 c1) (not (glued r1 c1))", "unknown predicate glued"),
        ("(on r1 c1)", "(on r1 c1) (not explored t1)", "'(not (<predicate> ...))' is expected, got (not explored t1)"),
        ("(on r1 c1)", "on", "a fact in brackets is expected, got on"),
        ("(= (num_docked c1) 1)", "(= (num_docked c1) 2)", "1 rover on c1, not 2"),
        ("(= (num_docked c1) 1)", "(= (num_docked c1) many)", "a number is expected, got many"),
        ("(= (num_docked c1) 1)", "(= (num_docked c1) 1/0)", "a number is expected, got 1/0"),
        ("(= (num_docked c1) 1)", "(= (num_docked c1) 0.5)", "must be a whole number"),
        ("(= (num_docked c1) 1)", "(= num_docked 1)", "is expected, got"),
        ("(= (num_docked c1) 1)", "(= (num_docked c1) 1)(= (num_docked c1) 1)", "has a value already"),
        ("(= (capacity c1) 1)", "(= (weight c1) 1)", "unknown function weight"),
        ("(= (undock_time r2) 5.000)", "(= (undock_time r2) 6.000)", "differs from that of r1"),
        ("(= (undock_time r2) 5.000)", "(= (undock_time r2) 5.0004)", "at most three decimals"),
        ("(at r2 r2_start)", "(at r2 c1_start)", "c1_start is the start of c1 already"),
        ("(at r2 r2_start)", "(at r2 r2_start) (at r2 m1)", "must begin at a start of its own, not at m1"),
        (
            "(= (path_cost rover_type m1 t1) 4.000)",
            "(= (path_cost rover_type m1 t2) 4.000)",
            "(path_cost rover_type m1 t2) without",
        ),
        (
            "(= (path_cost carrier_type c1_start m1) 17.000)",
            "(= (path_cost carrier_type c1_start m1) 7.000)",
            "must be more than 7.000",
        ),
        ("(= (reveal t1) 1.0)", "(explored t1)", "t1 is explored already"),
        ("(= (reveal t1) 1.0)", "(= (travel rover_type m1 t1) 9.000)", "contradicts"),
        ("(= (reveal t1) 1.0)", "(= (type_capacity carrier_type) 9)", "has capacity 9, its carriers 1"),
        ("(= (reveal t1) 1.0)", "(= (type_dock_time rover_type) 9)", "has dock_time 9.000, its rovers 10.000"),
        ("(:metric minimize", "(:preferences minimize", ":preferences is not a section"),
        ("(:domain marsupial)", "(:domain logistics)", "the domain must be marsupial, got logistics"),
    ],
)
def test_errors_are_reported_with_their_lines(old: str, new: str, message: str) -> None:
    text, line = _broken(old, new)
    with pytest.raises(SituationError) as caught:
        read_problem(text)
    found = [problem for problem in caught.value.problems if problem.path == f"line {line}"]
    assert any(message in problem.message for problem in found), str(caught.value)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("(on r1 c1)", "", "r1 must be at one place or on one carrier"),
        ("(aboard r1)\n    (at", "(at", "(aboard r1) must be true if r1 is on a carrier"),
        ("(is_a r1 rover_type)", "", "(is_a r1 <robot_type>) is missing"),
        ("(is_a r1 rover_type)", "(is_a r1 rover_type) (is_a r1 carrier_type)", "r1 has rover_type already"),
        ("(is_a r1 rover_type)", "(is_a r1 carrier_type)", "carrier_type is for both carriers and rovers"),
        ("(role_rover rover_type)", "(role_carrier rover_type)", "rover_type is for both carriers and rovers"),
        ("(at r2 r2_start)", "", "no robot is at start r2_start"),
        ("(= (num_docked c1) 1)", "", "(num_docked c1) is missing"),
        ("(= (capacity c1) 1)", "", "(capacity c1) is missing"),
        ("(can_explore r2 t1)", "", "r2 can't explore t1, but another robot of type rover_type can"),
        ("(= (path_cost rover_type m1 t1) 4.000)", "", "(path_cost rover_type m1 t1) is missing"),
        ("    (explored t3)\n", "", "(explored t3) is missing in the goal"),
        ("    (explored t3)\n", "(explored t3) (at r2 m1)", "(at r2 m1) is no goal that a situation can have here"),
        ("    (explored t3)\n", "(explored t3) (aboard r1)", "(aboard r2) is missing in the goal"),
        ("    (explored t3)\n", "(explored t3) (on r1 c1)", "a goal is explored, aboard or at"),
        ("(:domain marsupial)", "", "section :domain is missing"),
        ("(problem exploration)", "(domain exploration)", "'(define (problem <name>) ...' is expected"),
    ],
)
def test_missing_and_contradictory_parts_are_reported(old: str, new: str, message: str) -> None:
    text, _ = _broken(old, new)
    with pytest.raises(SituationError) as caught:
        read_problem(text)
    assert message in str(caught.value)


def test_all_problems_are_reported_together_by_line() -> None:
    text = problem_text(in_flight()).replace("(on r1 c1)", "(on r1 c7)").replace("(is_a r2 rover_type)", "(is_a r2)")
    with pytest.raises(SituationError) as caught:
        read_problem(text)
    first, second = [int(problem.path.removeprefix("line ")) for problem in caught.value.problems]
    assert first <= second


@pytest.mark.parametrize(
    "goal",
    ["(explored t1)", "(and (explored t1))", "(and (and) (and (and (explored t1)) ()))", "(and (explored t1) ())"],
)
def test_a_goal_is_one_fact_or_facts_joined_at_any_depth(goal: str) -> None:
    start, _, _ = problem_text(one_room()).partition("(:goal")
    assert read_problem(f"{start}(:goal {goal}))") == one_room()


@pytest.mark.parametrize("name", SOLVABLE)
def test_facts_that_are_said_to_be_false_change_nothing(name: str) -> None:
    situation = SOLVABLE[name]()
    false = " ".join(f"(not (explored {word}))" for word in _targets(problem_text(situation)))
    for before, after in (("(:init", f"(:init {false}"), ("(:goal", "(:requirements :typing) (:goal")):
        assert read_problem(problem_text(situation).replace(before, after)) == situation
    text = problem_text(situation)
    end = text[: text.index("(:goal")].rindex(")")
    assert read_problem(f"{text[:end]} {false}{text[end:]}") == situation


def _targets(text: str) -> list[str]:
    return re.findall(r"\(explored (\S+)\)", text.partition("(:goal")[2])


@pytest.mark.parametrize("number", ["1e1000000", "9" * 5000, "1/0", "1e20", "-1e999"])
def test_a_number_that_nothing_can_be_made_of_is_named(number: str) -> None:
    with pytest.raises(ValueError, match=r"no number|more than 1e|divides by zero"):
        exact(number)


@pytest.mark.parametrize(
    ("count", "kinds", "message"),
    [
        (5000, "meeting r - robot_type", "travel tables"),
        (20_000, "robot_type", "for neither"),
        (1001, "rover", "1000 robots"),
    ],
)
def test_objects_without_end_are_refused_in_time(count: int, kinds: str, message: str) -> None:
    objects, began = " ".join(f"m{i}" for i in range(count)), process_time()
    with pytest.raises(SituationError, match=message):
        read_problem(f"(define (problem p) (:domain marsupial) (:objects {objects} - {kinds}) (:init) (:goal (and)))")
    assert process_time() - began < 5
