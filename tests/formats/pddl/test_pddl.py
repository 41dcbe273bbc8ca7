"""The canonical domain and problems as text."""

from dataclasses import replace

import pytest
from support.planning.situations import (
    SOLVABLE,
    bring_them_home,
    in_flight,
    one_hall,
    one_room,
    seat_taken,
    wrong_carrier,
)

from marsupial.errors import PlanTextError, SituationError
from marsupial.formats.pddl.domain import FUNCTIONS, PREDICATES, SUPERTYPES, WITH_SEATS, signatures
from marsupial.formats.pddl.facts import seconds
from marsupial.formats.pddl.plantext import read_plan_text, write_plan_text
from marsupial.formats.pddl.sexpr import Form, parse_form
from marsupial.formats.pddl.text import check_domain, domain_text, pddl_folder, problem_text, read_problem
from marsupial.model import Budget, Improved, Role
from marsupial.model.situation import TargetInfo
from marsupial.planning.greedy import Greedy


def test_the_domain_has_no_negative_condition_and_no_strict_comparison() -> None:
    domain = parse_form(domain_text())
    for action in domain.items:
        if isinstance(action, Form) and action.head == ":durative-action":
            condition = str(
                action.items[action.items.index(next(i for i in action.items if str(i) == ":condition")) + 1]
            )
            assert "(not" not in condition
            assert "(<" not in condition.replace("(<=", "")


def test_the_documentation_names_everything_in_the_domain() -> None:
    text = (pddl_folder() / "README.md").read_text(encoding="utf-8")
    for word in (*PREDICATES, *FUNCTIONS):
        assert f"`({word}" in text, word
    for word in SUPERTYPES:
        assert f"`{word}`" in text, word


def test_the_folder_is_data_and_no_package() -> None:
    # a package called pddl would hide the one that unified-planning imports in its newer versions
    assert not (pddl_folder() / "__init__.py").is_file()


def test_the_domain_is_canonical_whatever_its_layout() -> None:
    check_domain(domain_text())
    lines = [line.partition(";")[0].strip().upper() for line in domain_text().splitlines()]
    check_domain(" ".join(lines).replace(":STRIPS", ":STRIPS :EQUALITY"))


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("(at end (explored ?t))", "(at start (explored ?t))", "action explore differs"),
        ("(explored ?t - target)", "(seen ?t - target)", "which has no predicate seen"),
        ("(explored ?t - target)", "", "predicate explored is missing"),
        ("(dock_time ?e - rover)", "(dock_time ?e - robot)", "function dock_time differs"),
        ("carrier rover - robot", "carrier rover drone - robot", "which has no type drone"),
        ("(domain marsupial)", "(domain logistics)", "which has no name logistics"),
    ],
)
def test_another_domain_is_recognised(old: str, new: str, message: str) -> None:
    assert old in domain_text()
    with pytest.raises(SituationError, match=message):
        check_domain(domain_text().replace(old, new, 1))


def test_a_difference_is_reported_with_its_line() -> None:
    text = domain_text().replace("(at end (explored ?t))", "(at start (explored ?t))")
    line = next(i for i, row in enumerate(text.splitlines(), start=1) if ":durative-action explore" in row)
    with pytest.raises(SituationError) as caught:
        check_domain(text)
    assert [problem.path for problem in caught.value.problems] == [f"line {line}"]


def test_a_problem_has_the_positions_of_robots_and_the_durations_of_drives() -> None:
    lines = [line.strip() for line in problem_text(one_room(), name="Demo").splitlines()]
    for line in (
        "(define (problem n--44-emo)",
        "c1 - carrier",
        "(at c1 c1_start)",
        "(on r1 c1)",
        "(aboard r1)",
        "(= (num_docked c1) 1)",
        "(= (dock_time r1) 10.000)",
        "(path carrier_type c1_start m1)",
        "(= (path_cost carrier_type c1_start m1) 10.000)",
        "(= (path_cost rover_type m1 t1) 4.000)",
        "(can_explore r1 t1)",
        "(explored t1)",
        "(:metric minimize (total-time)))",
    ):
        assert line in lines, line
    assert "(can_explore c1 t1)" not in lines


def test_the_rest_of_a_running_action_is_part_of_the_drives_out_of_its_start() -> None:
    lines = problem_text(in_flight()).splitlines()
    assert "    (= (path_cost carrier_type c1_start m1) 17.000)" in lines
    assert "    (= (path_cost rover_type r2_start t2) 7.000)" in lines
    assert "    (= (path_cost carrier_type m1 t3) 15.000)" in lines


def test_a_drive_of_no_length_takes_a_millisecond() -> None:
    text = problem_text(one_room())
    assert "(= (path_cost carrier_type c1_start home) 0.001)" in text.replace("n-home", "home")


@pytest.mark.parametrize("name", SOLVABLE)
def test_no_action_is_offered_a_path_into_a_start(name: str) -> None:
    situation = SOLVABLE[name]()
    starts = {robot.place for robot in situation.robots}
    paths = [line.strip(" ()").split() for line in problem_text(situation).splitlines() if "(path " in line]
    assert not [path for path in paths if path[3] in starts or path[2] == path[3]]


def test_goals_follow_the_situation() -> None:
    text = problem_text(bring_them_home())
    goal = text[text.index("(:goal") :]
    for fact in ("(aboard r1)", "(aboard r2)", "(at c1 h1)", "(at c2 h2)"):
        assert fact in goal
    nothing = problem_text(one_hall().restricted(targets=frozenset()))
    assert "".join(nothing[nothing.index("(:goal") : nothing.index("(:metric")].split()) == "(:goal(and))"


def test_records_can_be_left_out() -> None:
    text = problem_text(in_flight(), records=False)
    assert "free_at" not in text
    assert "travel " not in text
    assert "17.000" in text


def test_an_infinite_reveal_is_refused() -> None:
    situation = one_hall()
    target = TargetInfo(name="t1", explorers=frozenset({"carrier"}), reveal_m2=float("inf"))
    with pytest.raises(SituationError, match=r"targets\[0\].reveal_m2"):
        problem_text(replace(situation, targets=(target, *situation.targets[1:])))


def test_seconds_have_three_decimals() -> None:
    assert [seconds(ms) for ms in (0, 1, 1000, 12_345, -5)] == ["0.000", "0.001", "1.000", "12.345", "-0.005"]


def test_the_domain_with_seats_is_the_canonical_one_and_more() -> None:
    plain, seats = domain_text(), domain_text(WITH_SEATS)
    check_domain(seats)
    rows = {line.strip().rstrip(")") for line in seats.splitlines()}
    missing = [line for line in plain.splitlines() if line.partition(";")[0].strip().rstrip(")") not in rows | {""}]
    assert missing == [
        "(define (domain marsupial)",
        "    :parameters (?e - rover ?c - carrier ?m - meeting)",
        "    :parameters (?e - rover ?c - carrier ?m - meeting)",
    ]
    more = signatures(WITH_SEATS, ":predicates").keys() - PREDICATES.keys()
    more |= signatures(WITH_SEATS, ":functions").keys() - FUNCTIONS.keys()
    readme = (pddl_folder() / "README.md").read_text(encoding="utf-8")
    assert more == {"fits", "seats_as", "seats", "num_seated", "type_seats"}
    assert all(f"`({word}" in readme for word in more)


def test_a_problem_with_seats_says_who_fits_where() -> None:
    lines = [line.strip() for line in problem_text(seat_taken()).splitlines()]
    for line in (
        "(:domain marsupial_seats)",
        "(fits s1 rover_type c1)",
        "(fits r1 rover_type c1)",
        "(= (seats c1 rover_type) 1)",
        "(= (num_seated c1 rover_type) 1)",
        "(= (type_seats carrier_type climber_type) 1)",
        "(seats_as rover_at_50_type rover_type)",
    ):
        assert line in lines, line
    assert "(fits r1 rover_type c1)" not in problem_text(wrong_carrier())


def test_a_plan_with_seats_names_the_type_of_each_seat() -> None:
    situation = seat_taken()
    (plan,) = (event.plan for event in Greedy().solve(situation, Budget(steps=1)) if isinstance(event, Improved))
    text = write_plan_text(plan, situation)
    assert "(dock r1 rover_type c1 m1)" in text
    assert read_plan_text(text, situation) == plan
    with pytest.raises(PlanTextError, match="r1 takes seats of type rover_type, not climber_type"):
        read_plan_text(text.replace("dock r1 rover_type", "dock r1 climber_type"), situation)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("(fits r1 rover_type c1)", "", "(fits r1 rover_type c1) is missing"),
        ("(fits r1 rover_type c1)", "(fits r1 rover_type c1) (fits r1 climber_type c1)", "contradicts the seats of c1"),
        ("(= (seats c1 rover_type) 1)", "", "(seats c1 rover_type) is missing"),
        ("(= (seats c1 rover_type) 1)", "(= (seats c1 rover_type) 2)", "(seats c1 rover_type) must be 1"),
        (
            "(= (num_seated c1 rover_type) 1)",
            "(= (num_seated c1 rover_type) 0)",
            "(num_seated c1 rover_type) must be 1",
        ),
        ("(:domain marsupial_seats)", "(:domain marsupial)", "unknown predicate fits"),
    ],
)
def test_facts_about_seats_that_contradict_each_other_are_named(old: str, new: str, message: str) -> None:
    text = problem_text(seat_taken())
    assert old in text
    with pytest.raises(SituationError) as caught:
        read_problem(text.replace(old, new, 1))
    assert message in str(caught.value)


def test_seats_are_read_without_records_too() -> None:
    situation = seat_taken()
    read = read_problem(problem_text(situation, records=False))
    assert [kind.seats_as for kind in read.types if kind.role is Role.ROVER] == ["", "rover", ""]
    assert read.most_aboard("c1", "r1") == situation.most_aboard("c1", "r1") == 1
