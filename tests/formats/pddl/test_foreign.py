"""PDDL of other domains is refused with three lines."""

import pytest
from support.planning.situations import in_flight, one_room

from marsupial.errors import SituationError
from marsupial.formats.pddl.read import read_problem
from marsupial.formats.pddl.text import check_domain, domain_text, problem_text

DEPOTS = (
    "(define (problem p)\n(:domain {domain})\n(:objects {objects} - crate)\n(:init\n{facts})\n(:goal (and {goal})))"
)


def depots(crates: int, domain: str = "depots") -> str:
    names = [f"crate{i}" for i in range(crates)]
    facts = "\n".join(f"(clear {name}) (= (weight {name}) {i})" for i, name in enumerate(names))
    return DEPOTS.format(domain=domain, objects=" ".join(names), facts=facts, goal="(at crate0 crate1)")


@pytest.mark.parametrize("domain", ["depots", "marsupial"])
def test_a_problem_of_another_domain_is_refused_in_three_lines(domain: str) -> None:
    with pytest.raises(SituationError) as caught:
        read_problem(depots(400, domain))
    first, second, third = map(str, caught.value.problems)
    assert first.startswith("line 2: not a problem of marsupial's own domain")
    assert first.endswith(f"(:domain {domain})")
    assert second == (
        "missing: objects of the types robot_type, carrier, rover, start, target, meeting; "
        "facts is_a, can_explore, path, path_cost, capacity, dock_time"
    )
    assert third == "line 3: 1200 objects and facts mean nothing here, the first: crate0"


def test_a_problem_with_a_few_unknown_words_is_reported_line_by_line() -> None:
    text = (
        problem_text(in_flight()).replace("(on r1 c1)", "(glued r1 c1) (under c1 r1)").replace("t1 - target", "t1 - x")
    )
    with pytest.raises(SituationError) as caught:
        read_problem(text)
    assert "unknown predicate glued" in str(caught.value)
    assert "unknown predicate under" in str(caught.value)
    assert "t1: type must be one of" in str(caught.value)


def test_a_problem_with_another_domain_name_lacks_only_the_name() -> None:
    with pytest.raises(SituationError) as caught:
        read_problem(problem_text(one_room()).replace("(:domain marsupial)", "(:domain other)"))
    assert [problem.message for problem in caught.value.problems] == ["the domain must be marsupial, got other"]


def test_another_domain_is_refused_in_three_lines() -> None:
    text = """(define (domain depots)
        (:types crate hoist place1 place2 place3 place4 place5 - object)
        (:predicates (clear ?x - crate))
        (:durative-action lift :parameters (?x - crate) :duration (= ?duration 1)))"""
    with pytest.raises(SituationError) as caught:
        check_domain(text)
    first, second, third = map(str, caught.value.problems)
    assert first.endswith("but depots")
    assert second.startswith(
        "missing: name marsupial; type robot, location, robot_type, carrier, rover, target and 4 more;"
    )
    assert second.endswith("; action move, explore, dock, undock")
    kinds = "type crate, hoist, place1, place2, place3, place4 and 1 more; predicate clear; action lift"
    assert third == f"unknown here: name depots; {kinds}"


def test_a_domain_without_an_action_is_reported_line_by_line() -> None:
    start = domain_text().index("(:durative-action undock")
    with pytest.raises(SituationError) as caught:
        check_domain(domain_text()[:start] + ")")
    assert [problem.message for problem in caught.value.problems] == [
        "not the canonical domain: action undock is missing"
    ]
