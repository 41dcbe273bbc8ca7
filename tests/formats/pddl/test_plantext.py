"""Plans as text in IPC format."""

from dataclasses import replace
from time import process_time

import pytest
from hypothesis import given
from hypothesis import strategies as st
from support.planning.drawn_situations import situations
from support.planning.situations import in_flight, one_room, two_rooms
from support.planning.spots import carrier, hall, situation_of

from marsupial.errors import InvalidPlanError, PlanTextError
from marsupial.formats.pddl.facts import seconds
from marsupial.formats.pddl.plansteps import Step, steps_of
from marsupial.formats.pddl.plantext import read_plan, read_plan_text, write_plan_text
from marsupial.model import Action, ActionName, Plan, Situation
from marsupial.planning.checker import check
from marsupial.planning.external.output import Printed
from marsupial.planning.greedy import serve

MOVE = Action(name=ActionName.MOVE, start_ms=0, duration_ms=10_000, robot="c1", origin="c1_start", place="m1")
UNDOCK = Action(name=ActionName.UNDOCK, start_ms=10_001, duration_ms=5_000, robot="r1", carrier="c1", place="m1")
EXPLORE = Action(name=ActionName.EXPLORE, start_ms=15_002, duration_ms=4_000, robot="r1", origin="m1", place="t1")
PLAN = Plan.of([MOVE, UNDOCK, EXPLORE])
TEXT = """\
; 3 actions, makespan 19.002 s
0.000: (move c1 carrier_type c1_start m1) [10.000]
10.001: (undock r1 c1 m1) [5.000]
15.002: (explore r1 rover_type m1 t1) [4.000]
"""


def test_a_plan_is_written_one_action_a_line_and_reads_back() -> None:
    assert write_plan_text(PLAN, one_room()) == TEXT
    assert read_plan_text(TEXT, one_room()) == PLAN


def test_variants_of_plan_text_are_read() -> None:
    text = """
        ; Time 0.02 by some planner
    0:(MOVE C1 carrier_type c1_start M1)[1e1]   ; on our way
    1.0001e+01: ( undock   r1 c1 m1 )

    15.0020000 : (explore r1 rover_type m1 t1)  [ 4.0 ]\r
    """
    assert read_plan_text(text, one_room()) == PLAN
    assert read_plan_text("; nothing to do\n", one_room()) == Plan(actions=())


def test_times_are_rounded_to_the_nearest_millisecond() -> None:
    text = TEXT.replace("10.001:", "10.0014:").replace("15.002:", "15.0025:").replace("[4.000]", "[3.99951]")
    assert [a.start_ms for a in read_plan_text(text, one_room()).actions] == [0, 10_001, 15_003]
    assert read_plan_text(text, one_room()).actions[2].duration_ms == 4_000


def test_gaps_that_rounding_closes_are_opened_again_but_actions_that_touch_as_written_are_left_alone() -> None:
    text = TEXT.replace("10.001:", "10.0001:").replace("15.002:", "15.0002:")
    assert read_plan_text(text, one_room()) == PLAN
    text = TEXT.replace("10.001:", "10.000:")
    assert [a.start_ms for a in read_plan_text(text, one_room()).actions] == [0, 10_000, 15_002]


def test_the_rest_of_a_running_action_is_part_of_the_first_drive() -> None:
    situation = in_flight()
    drive = Action(name=ActionName.MOVE, start_ms=7_500, duration_ms=10_000, robot="c1", origin="c1_start", place="m1")
    back = replace(drive, name=ActionName.EXPLORE, start_ms=17_501, duration_ms=15_000, origin="m1", place="t3")
    plan = Plan.of([drive, back])
    text = write_plan_text(plan, situation)
    assert "0.500: (move c1 carrier_type c1_start m1) [17.000]" in text
    assert "17.501: (explore c1 carrier_type m1 t3) [15.000]" in text
    assert read_plan_text(text, situation) == plan
    assert read_plan_text("0.5: (move c1 carrier_type c1_start m1)", situation) == Plan.of([drive])


def test_a_start_before_the_robot_is_free_and_an_unknown_robot_cannot_be_written() -> None:
    with pytest.raises(InvalidPlanError, match="before c1 is free"):
        write_plan_text(Plan.of([replace(MOVE, start_ms=6_999)]), in_flight())
    with pytest.raises(InvalidPlanError, match="there is no robot 'c9'"):
        write_plan_text(Plan.of([replace(MOVE, robot="c9")]), one_room())


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ("(move c1 carrier_type c1_start m1)", "is expected, got"),
        ("0.0: move c1 carrier_type c1_start m1", "is expected, got"),
        ("0.0: (move c1 carrier_type c1_start m1) [ten]", "is expected, got"),
        ("0.0: (move c1 carrier_type c1_start m1) [1.0] [2.0]", "is expected, got"),
        ("nan: (move c1 carrier_type c1_start m1) [1.0]", "is expected, got"),
        ("1e9999: (move c1 carrier_type c1_start m1) [1.0]", "is expected, got"),
        ("-1.0: (move c1 carrier_type c1_start m1) [10.0]", "starts before the plan, at -1"),
        ("0.0: (move c1 carrier_type c1_start m1) [0.0]", "must take longer"),
        ("0.0: (fly c1 carrier_type c1_start m1) [1.0]", "unknown action fly"),
        ("0.0: (move c1 c1_start m1) [1.0]", "move takes 4 arguments, got 3"),
        ("0.0: (dock r1 c1 c1 m1) [1.0]", "dock takes 3 arguments, got 4"),
        ("0.0: (move c2 carrier_type c1_start m1) [1.0]", "there is no robot c2"),
        ("0.0: (move c1 rover_type c1_start m1) [1.0]", "c1 is of type carrier_type, not rover_type"),
        ("0.0: (move c1 carrier_type nowhere m1) [1.0]", "there is no place nowhere"),
        ("0.0: (move c1 carrier_type c1_start t1) [1.0]", "there is no meeting or home t1"),
        ("0.0: (explore c1 carrier_type c1_start m1) [1.0]", "there is no target m1"),
        ("0.0: (dock c1 c1 m1) [1.0]", "there is no rover c1"),
        ("0.0: (dock r1 r1 m1) [1.0]", "there is no carrier r1"),
        ("0.0: (undock r1 c1 home) [1.0]", "there is no meeting home"),
        ("0.0: (explore r1 rover_type c1_start t1)", "no duration given, and no path from c1_start to t1"),
    ],
)
def test_a_line_that_means_nothing_is_reported(line: str, message: str) -> None:
    with pytest.raises(PlanTextError) as caught:
        read_plan_text(f"; header\n{line}\n", one_room())
    (problem,) = caught.value.problems
    assert problem.path == "line 2"
    assert message in problem.message


def test_the_time_for_a_line_does_not_grow_with_the_square_of_its_digits() -> None:
    digits, began = "9" * 60_000, process_time()
    assert list(Printed().feed(f"{digits}\n".encode())) == []
    with pytest.raises(PlanTextError):
        read_plan_text(digits, one_room())
    assert process_time() - began < 5


def test_every_bad_line_is_reported_in_order() -> None:
    text = "0: (fly c1)\nrubbish\n; fine\n0: (dock c1)\n"
    with pytest.raises(PlanTextError) as caught:
        read_plan_text(text, one_room())
    assert [problem.path for problem in caught.value.problems] == ["line 1", "line 2", "line 4"]


def test_missing_durations_follow_from_the_situation() -> None:
    text = "\n".join(line.partition(" [")[0] for line in TEXT.splitlines())
    assert read_plan_text(text, one_room()) == PLAN
    text = "0: (move r1 rover_type t1 m1)\n10: (dock r1 c1 m1)"
    assert [a.duration_ms for a in read_plan_text(text, two_rooms()).actions] == [4_000, 10_000]


@given(situations())
def test_plans_of_drawn_situations_read_back(situation: Situation) -> None:
    plan, _ = serve(situation)
    assert read_plan_text(write_plan_text(plan, situation), situation) == plan


@given(situations(), st.integers(1, 999))
def test_a_smaller_epsilon_than_ours_makes_no_difference(situation: Situation, micros: int) -> None:
    plan, _ = serve(situation)
    lines = []
    for line in write_plan_text(plan, situation).splitlines():
        start, colon, rest = line.partition(":")
        lines.append(f"{start}{micros:03d}{colon}{rest}" if colon else line)
    shifted = read_plan_text("\n".join(lines), situation)
    late = 0 if micros < 500 else 1
    assert shifted == Plan(actions=tuple(replace(a, start_ms=a.start_ms + late) for a in plan.actions))


def odd_drives() -> Situation:
    """Return: a carrier 1 ms from a target, another 3 s further; its running drive adds 5 ms to the first way."""
    situation = situation_of([carrier()], {"t1": hall(0), "t2": hall(3)}, {}, {"c1_start": hall(0)})
    table = situation.travel_ms["carrier"].copy()
    table[table == 3_000] = 3_005
    return replace(situation, travel_ms={**situation.travel_ms, "carrier": table})


@pytest.mark.parametrize(
    "text",
    [
        " 0.0000: (explore c1 carrier_type c1_start t1) [D:0.00; C:0.10]\n"
        " 0.0010: (explore c1 carrier_type t1 t2) [D:3.01; C:0.10]\n",
        "0.00: (explore c1 carrier_type c1_start t1) [0.00]\n0.00: (explore c1 carrier_type t1 t2) [3.00]\n",
    ],
    ids=["LPG stdout", "two decimals"],
)
def test_times_rounded_to_hundredths_are_corrected_to_those_of_the_situation(text: str) -> None:
    reading = read_plan(text, odd_drives())
    assert [(action.start_ms, action.duration_ms) for action in reading.plan.actions] == [(0, 1), (2, 3_005)]
    assert reading.mended == (
        "line 1: (explore c1 c1_start t1) from 0.000 for 0.001 s",
        "line 2: (explore c1 t1 t2) from 0.002 for 3.005 s",
    )


@pytest.mark.parametrize("duration", ["0.02", "0.010", "1e-3"])
def test_errors_beyond_rounding_are_left_to_the_checker(duration: str) -> None:
    text = f"0.00: (explore c1 carrier_type c1_start t1) [{duration}]\n4.00: (explore c1 carrier_type t1 t2) [3.02]\n"
    reading = read_plan(text, odd_drives())
    assert [action.duration_ms for action in reading.plan.actions] == [round(float(duration) * 1000), 3_020]
    assert reading.mended == ()
    assert not check(odd_drives(), reading.plan).valid


def test_an_overlap_beyond_the_printed_digits_is_left_to_the_checker() -> None:
    text = "0.0: (explore c1 carrier_type c1_start t1) [0.00]\n0.10: (explore c1 carrier_type t1 t2) [3.01]\n"
    early = "3.09: (explore c1 carrier_type t2 t1) [3.01]\n"
    late = "3.10: (explore c1 carrier_type t2 t1) [3.01]\n"
    assert not check(odd_drives(), read_plan(text + early, odd_drives()).plan).valid
    assert check(odd_drives(), read_plan(text + late, odd_drives()).plan).valid


@given(situations())
def test_plans_printed_without_gaps_and_with_durations_in_hundredths_are_valid(situation: Situation) -> None:
    plan, _ = serve(situation)
    lines = [_as_lpg_prints(step) for step in steps_of(plan, situation)]
    reading = read_plan("\n".join(lines), situation)
    verdict = check(situation, plan)
    assert check(situation, reading.plan).valid == verdict.valid
    assert reading.plan.makespan_ms <= verdict.makespan_ms


def _as_lpg_prints(step: Step) -> str:
    """Return a step as LPG prints it, which leaves no gaps between actions."""
    start, duration = seconds(max(0, int(1000 * step.start) - 1)), float(step.duration or 0)
    return f" {start}0: ({' '.join((step.name, *step.args))}) [D:{duration:.2f}; C:0.10]"
