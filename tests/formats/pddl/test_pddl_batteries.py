"""Problems and plans with batteries: the domain with charges, read back, and judged by unified-planning too."""

import re
from dataclasses import replace
from fractions import Fraction
from typing import Any

import pytest
from hypothesis import given
from support.planning.charged_teams import ROVER, charged, charged_situations
from support.planning.situations import in_flight, many_rooms, one_hall, seat_taken, two_rooms
from support.planning.spots import carrier, door, hall, room, rover, situation_of
from support.planning.up_problem import up_problem

from marsupial.errors import PlanTextError, SituationError
from marsupial.formats.pddl.domain import WITH_BATTERIES, WITH_SEATS, signatures
from marsupial.formats.pddl.facts import battery_values
from marsupial.formats.pddl.plansteps import CHARGING
from marsupial.formats.pddl.plantext import read_plan_text, write_plan_text
from marsupial.formats.pddl.read import read_problem
from marsupial.formats.pddl.text import check_domain, domain_text, pddl_folder, problem_text
from marsupial.model import PlanningBattery, Situation, SituationGoal
from marsupial.planning.checker import ViolationKind, check

BACK = SituationGoal(recover_rovers=True)
TRUCK = PlanningBattery(capacity_j=2000.0, stand_w=20.0, drive_w=80.0, charge_w=100.0)


def tight() -> Situation:
    """Return two rooms for a rover whose battery lasts for one of them."""
    return charged(replace(two_rooms(), goal=BACK), {"rover": replace(ROVER, capacity_j=170.0, charge_w=2.0)})


def far_apart() -> Situation:
    """Return a carrier and a rover, both with batteries and not full, two targets and two charging places."""
    places = {"t1": room(12), "t2": hall(-10)}
    situation = situation_of([carrier(), rover(on="c1")], places, {"m1": door(10)}, {"c1_start": hall(0)}, goal=BACK)
    return charged(situation, {"rover": ROVER, "carrier": TRUCK}, "c1_start", "m1", c1=1500.5, r1=300.0)


# the second sortie has to wait for 85 s of charging by the domain, 78 s in truth
CHARGES = """\
0.000: (move c1 carrier_type c1_start m1) [10.000]
10.001: (undock r1 rover_type c1 m1) [5.000]
15.002: (explore r1 rover_type m1 t1) [4.000]
19.003: (move r1 rover_type t1 m1) [4.000]
23.004: (dock r1 rover_type c1 m1) [10.000]
33.005: (recharge_aboard r1 c1) [85.000]
33.006: (move c1 carrier_type m1 m2) [30.000]
118.006: (undock r1 rover_type c1 m2) [5.000]
123.007: (explore r1 rover_type m2 t2) [4.000]
127.008: (move r1 rover_type t2 m2) [4.000]
131.009: (dock r1 rover_type c1 m2) [10.000]
"""
HASTY = """\
0.000: (move c1 carrier_type c1_start m1) [10.000]
10.001: (undock r1 rover_type c1 m1) [5.000]
15.002: (explore r1 rover_type m1 t1) [4.000]
19.003: (move r1 rover_type t1 m1) [4.000]
23.004: (dock r1 rover_type c1 m1) [10.000]
33.006: (move c1 carrier_type m1 m2) [30.000]
63.007: (undock r1 rover_type c1 m2) [5.000]
68.008: (explore r1 rover_type m2 t2) [4.000]
72.009: (move r1 rover_type t2 m2) [4.000]
76.010: (dock r1 rover_type c1 m2) [10.000]
"""


def test_the_domain_with_batteries_is_that_with_seats_and_more() -> None:
    text = domain_text(WITH_BATTERIES)
    check_domain(text)
    rows = {line.strip().rstrip(")") for line in text.splitlines()}
    lines = (line.partition(";")[0].strip().rstrip(")") for line in domain_text(WITH_SEATS).splitlines())
    assert [line for line in lines if line not in rows | {""}] == [
        "(define (domain marsupial_seats",
        "meeting home - waypoint",
    ]
    readme = (pddl_folder() / "README.md").read_text(encoding="utf-8")
    for head in (":predicates", ":functions"):
        for word in signatures(WITH_BATTERIES, head).keys() - signatures(WITH_SEATS, head).keys():
            assert f"`({word}" in readme, word
    assert all(f"`({action}" in readme for action in CHARGING)


def test_a_problem_says_what_batteries_hold_and_use() -> None:
    lines = [line.strip() for line in problem_text(far_apart()).splitlines()]
    for line in (
        "(:domain marsupial_batteries)",
        "charge_m1 - charging_place",
        "(= (charge c1) 1500.5)",
        "(= (charge r1) 300.0)",
        "(= (battery r1) 1000.0)",
        "(= (drive_power c1) 80.0)",
        "(= (gives c1) 1)",
        "(can_charge r1)",
        "(fits r1 rover_type c1)",
        "(= (back carrier_type t2) 800.0)",  # 10 s at 80 W
        "(= (back rover_type t1) 48.0)",  # 4 s at 12 W to the charging place at the door, where it needs no carrier
    ):
        assert line in lines, line


def test_without_batteries_problems_are_as_they_were() -> None:
    text = problem_text(two_rooms())
    assert problem_text(charged(two_rooms(), {})) == text
    assert problem_text(charged(two_rooms(), {}, "m1")) == text
    for situation in (two_rooms(), seat_taken()):
        assert "charg" not in problem_text(situation)


@given(charged_situations())
def test_every_drawn_situation_reads_back(situation: Situation) -> None:
    if not situation.batteries:
        situation = replace(situation, types=tuple(replace(kind, battery=None) for kind in situation.types))
        situation = situation.without_batteries()
    assert read_problem(problem_text(situation)) == situation
    text = problem_text(situation, records=False)
    assert problem_text(read_problem(text), records=False) == text


@pytest.mark.parametrize(
    "situation",
    [tight(), far_apart(), charged(seat_taken(), {"rover": ROVER}), charged(in_flight(), {"carrier": TRUCK}, "m1")],
    ids=["tight", "far apart", "seats", "in flight"],
)
def test_what_a_problem_says_reads_back(situation: Situation) -> None:
    assert read_problem(problem_text(situation)) == situation
    text = problem_text(situation, records=False)
    assert problem_text(read_problem(text), records=False) == text


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("(= (charge c1) 1500.5)", "(= (charge c1) 2000.5)", "robots[0].charge_j: must be at most 2000.0"),
        ("(= (charge c1) 1500.5)", "", "(charge c1) is missing"),
        ("(= (charge c1) 1500.5)", "(= (charge c1) -1)", "robots[0].charge_j: must be 0 or more"),
        ("(= (battery r1) 1000.0)", "(= (battery r1) -1)", "types[1].battery.capacity_j: must be positive"),
        ("(= (battery r1) 1000.0)", "(= (battery r1) 0)", "(charge r1) must be 0.0"),
        ("(= (drive_power r1) 12.0)", "", "(drive_power r1) is missing"),
        ("(= (back rover_type t1) 48.0)", "(= (back rover_type t1) 47.0)", "(back rover_type t1) must be 48"),
        ("(= (rest m1) 0.000)", "(= (rest m1) 1.000)", "(rest m1) must be 0.000"),
        ("(= (gives c1) 1)", "(= (gives c1) 0)", "(gives c1) must be 1"),
        ("(can_charge r1)", "", "(can_charge r1) must be true if its charge_power is not 0"),
        ("(:domain marsupial_batteries)", "(:domain marsupial_seats)", "type must be one of"),
    ],
)
def test_facts_about_batteries_that_contradict_each_other_are_named(old: str, new: str, message: str) -> None:
    text = problem_text(far_apart())
    assert old in text
    with pytest.raises(SituationError) as caught:
        read_problem(text.replace(old, new, 1))
    assert message in str(caught.value)


def test_a_problem_with_batteries_needs_one() -> None:
    text = problem_text(charged(one_hall(), {"carrier": TRUCK}))
    for number in ("2000.0", "20.0", "80.0", "100.0"):
        text = text.replace(f" {number})", " 0.0)")
    with pytest.raises(SituationError, match="no robot has a battery"):
        read_problem(text.replace("(can_charge c1)", "").replace("(= (gives c1) 1)", "(= (gives c1) 0)"))


def test_recharges_are_waits_that_the_checker_judges() -> None:
    situation = tight()
    plan = read_plan_text(CHARGES, situation)
    assert [action.start_ms for action in plan.actions if action.start_ms > 33_005][:2] == [33_006, 118_006]
    assert check(situation, plan).valid
    violation = check(situation, read_plan_text(HASTY, situation)).violation
    assert violation is not None
    assert violation.kind is ViolationKind.BATTERY_EMPTY
    written = write_plan_text(plan, situation)
    assert "recharge" not in written
    assert read_plan_text(written, situation) == plan
    with pytest.raises(PlanTextError, match="unknown action recharge"):
        read_plan_text("0: (recharge c1 m1) [1]", two_rooms())


def up_valid(situation: Situation, text: str) -> bool:
    """Return whether unified-planning reads a plan and finds it valid for the problem."""
    import unified_planning.shortcuts as shortcuts
    from unified_planning.engines.results import ValidationResultStatus
    from unified_planning.io import PDDLReader

    problem = up_problem(situation)
    for fluent in problem.fluents:
        if fluent.type.is_real_type():
            problem._fluents_defaults[fluent] = shortcuts.Int(0)
    with shortcuts.PlanValidator(name="up_time_triggered_validator") as validator:
        validator.skip_checks = True
        status = validator.validate(problem, PDDLReader().parse_plan_string(problem, text)).status
    return status is ValidationResultStatus.VALID


def test_unified_planning_agrees_on_a_plan_that_charges_and_one_that_does_not() -> None:
    assert up_valid(tight(), CHARGES)
    assert not up_valid(tight(), HASTY)


@pytest.mark.parametrize("situation", [tight(), far_apart(), charged(many_rooms(2, 2, 4, 2), {"rover": ROVER})])
def test_unified_planning_reads_what_we_write(situation: Situation) -> None:
    problem = up_problem(situation)
    assert {action.name for action in problem.actions} == {"move", "explore", "dock", "undock", *CHARGING}
    given = {_words(fact): value for fact, value in problem.explicit_initial_values.items()}
    for key, value in battery_values(situation):
        assert Fraction(given[key].constant_value()) == Fraction(value), key


def _words(fact: Any) -> tuple[str, ...]:
    return (fact.fluent().name, *map(str, fact.args))


@pytest.mark.parametrize("situation", [seat_taken(), far_apart()], ids=["seats", "batteries"])
@pytest.mark.parametrize("word", ["home", "n-zz", "charge"])
def test_objects_may_have_names_that_are_written_otherwise(situation: Situation, word: str) -> None:
    text = re.sub(r"(?<=[ (])c1(?=[ )])", word, problem_text(situation))
    assert read_problem(problem_text(read_problem(text))) == read_problem(text)
