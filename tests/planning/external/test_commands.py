"""The plans of a planner with a command line: printed, written to files, and read as they come."""

import json
import os
import shlex
import sys
import threading
from pathlib import Path

import pytest
from stand_ins import AMPLE, GOOD, LONG, PRELUDE, events_of, next_makespan, solve, stand_in
from support.planning.situations import in_flight, one_hall

from marsupial.cli.main import main
from marsupial.errors import EngineUnavailable, UsageError
from marsupial.formats.pddl.plantext import read_plan_text, write_plan_text
from marsupial.formats.pddl.text import domain_text, problem_text, read_problem
from marsupial.model import Budget, Finished, Improved, Outcome
from marsupial.planning.engines import engine, mission_engine
from marsupial.planning.external.commands import External
from marsupial.planning.external.output import Printed
from marsupial.planning.greedy import serve
from marsupial.planning.schedule.timeline import retime

OPTIC_HEADER = "b (1.000 | 10.000)(G)\n; Plan found with metric 30.001\n; States evaluated so far: 3\n; Time 0.01\n"
OPTIC_END = (
    "\nResorting to best-first search\nb (2.000 | 9.000)\nProblem Unsolvable\n;;;; Solution Found\n; Cost: 50.001\n"
)

pytestmark = pytest.mark.usefixtures("nothing_left")


def test_every_improving_plan_comes_as_soon_as_it_is_complete(tmp_path: Path) -> None:
    body = f"say({OPTIC_HEADER!r} + LONG + chr(10)); wait_for('go'); say({OPTIC_HEADER!r} + GOOD)"
    events = events_of(stand_in(tmp_path, body))
    assert next_makespan(events) == 50_001
    (tmp_path / "go").touch()
    assert next_makespan(events) == 30_001
    end = next(events)
    assert end.outcome is Outcome.SATISFICING
    assert "2 plans accepted" in end.detail


def test_a_plan_nothing_follows_counts_while_the_planner_thinks_on(tmp_path: Path) -> None:
    events = events_of(stand_in(tmp_path, "say(LONG); wait_for('go'); say(GOOD.rstrip())"))
    assert next_makespan(events) == 50_001
    (tmp_path / "go").touch()
    # Both together are not a plan: they would explore everything twice.
    (end,) = events
    assert isinstance(end, Finished)


def test_a_plan_that_stops_growing_halfway_is_not_refused_before_it_is_complete(tmp_path: Path) -> None:
    body = "first, second = GOOD.splitlines(True); say(first); wait_for('go'); say(second)"
    events = events_of(stand_in(tmp_path, body))
    threading.Timer(0.3, (tmp_path / "go").touch).start()
    assert next_makespan(events) == 30_001
    end = next(events)
    assert "refused" not in end.detail


def test_the_last_plan_of_an_optimiser_that_finds_no_better_one_stands(tmp_path: Path) -> None:
    makespans, end = solve(stand_in(tmp_path, f"say(LONG + {OPTIC_END!r} + LONG)"))
    assert makespans == [50_001]
    assert end.outcome is Outcome.SATISFICING


@pytest.mark.parametrize(
    "text",
    [
        "\n0.0003:   (EXPLORE C1 CARRIER_TYPE C1_START T1) [10.0000]\n"
        "10.0008:   (EXPLORE C1 CARRIER_TYPE T1 T2) [20.0000]",
        " 0.0000: (EXPLORE C1 CARRIER_TYPE C1_START T1) [D:10.00; C:0.10]\n"
        " 10.0000: (EXPLORE C1 CARRIER_TYPE T1 T2) [D:20.00; C:0.10]\n\n\nMETRIC_VALUE = 30.00\n",
        "10.01: (explore c1 carrier_type t1 t2)[2e1]\r\n0: ( explore c1 carrier_type c1_start t1 ) [1.0E+01]\r\n",
        "0.00000000: (explore c1 carrier_type c1_start t1) [10.00000000]\n"
        "10.00000000: (explore c1 carrier_type t1 t2) [20.00000000]\n",
        "; Version LPG-td-1.4\n; MakeSpan 30.00\n\n"
        "0.0002:   (EXPLORE C1 CARRIER_TYPE C1_START T1) [10.0000])\n"
        "10.0005:   (EXPLORE C1 CARRIER_TYPE T1 T2) [20.0000])\n\n\n",
        "b (2.000 | 10.000)b (1.000 | 30.001);;;; Solution Found\n; Time 0.00\n"
        "0.000: (explore c1 carrier_type c1_start t1)  [10.000]\n10.001: (explore c1 carrier_type t1 t2)  [20.000]\n",
        "; better plan 2\n; cost = 30.00100000000001\n; makespan = 30.001\n"
        "0.000: (explore c1 carrier_type c1_start t1) [10.000]\n10.001: (explore c1 carrier_type t1 t2) [20.000]\n",
    ],
    ids=["LPG file", "LPG stdout", "unordered, scientific", "TFD, touching", "LPG-td 1.4 file", "POPF", "Kairos"],
)
def test_the_output_of_planners_is_read_and_retimed(tmp_path: Path, text: str) -> None:
    assert solve(stand_in(tmp_path, f"say({text!r})"))[0] == [30_001]


@pytest.mark.parametrize("names", [("plan.1", "plan.2"), ("plan_1.SOL", "plan_2.SOL"), ("plan", "plan")])
def test_plan_files_are_read_while_the_planner_runs(tmp_path: Path, names: tuple[str, str]) -> None:
    endings = [name.removeprefix("plan") for name in names]
    body = f"""
prefix = sys.argv[1].removeprefix("--out=")
with open(prefix + {endings[0]!r}, "w") as file:
    first, second = LONG.splitlines(True)
    file.write(first)
    file.flush()
    time.sleep(0.2)
    file.write(second)
wait_for("go")
Path(prefix + {endings[1]!r}).write_text(";; Version LPG" + chr(10) + chr(10) + GOOD)
"""
    events = events_of(stand_in(tmp_path, body, "--out={plan} {domain} {problem}"))
    assert next_makespan(events) == 50_001
    (tmp_path / "go").touch()
    assert next_makespan(events) == 30_001
    end = next(events)
    assert (end.outcome, "refused" in end.detail) == (Outcome.SATISFICING, False)


def test_robots_that_are_busy_at_first_are_waited_for(tmp_path: Path) -> None:
    situation = read_problem(problem_text(in_flight(), records=False))
    text = write_plan_text(serve(situation)[0], situation)
    makespans, end = solve(stand_in(tmp_path, f"say({text!r})"), in_flight())
    assert makespans, end.detail


def test_rubbish_is_no_plan(tmp_path: Path) -> None:
    body = "sys.stdout.buffer.write(bytes(range(256)) * 100); say('0.1: no plan' + chr(10)); say('x' * 300000)"
    makespans, end = solve(stand_in(tmp_path, body))
    assert (makespans, end.outcome) == ([], Outcome.NO_PLAN)
    assert end.detail.startswith("it ended with exit code 0, saying: xxx")
    assert end.detail.endswith("xxx...; 0 plans accepted")
    assert end.detail.isprintable()


@pytest.mark.parametrize(
    ("body", "makespans", "told"),
    [
        ("say('0: (fly c1)' + 2 * chr(10) + HALF)", [],
         "2 refused (first: unreadable, line 1: (fly c1): unknown action fly)"),
        ("say(HALF + chr(10) + GOOD)", [30_001], "1 plan accepted, 1 refused (first: wrong, 10.000 s, at the end: "),
        ("say(GOOD); sys.exit(137)", [30_001], "exit code 137"),
        ("say(';; Problem unsolvable!')", [], "which is not so"),
    ],
    ids=["wrong and unreadable", "a right one after a wrong one", "an exit code after a plan", "a wrong proof"],
)  # fmt: skip
def test_valid_parts_of_a_planner_s_output_are_used_and_others_reported(
    tmp_path: Path, body: str, makespans: list[int], told: str
) -> None:
    found, end = solve(stand_in(tmp_path, body))
    assert (found, end.outcome) == (makespans, Outcome.SATISFICING if makespans else Outcome.NO_PLAN)
    assert told in end.detail


def test_an_empty_plan_file_is_no_plan(tmp_path: Path) -> None:
    body = "Path(sys.argv[3] + '_1.SOL').write_text('; Version LPG' + chr(10))"
    _, end = solve(stand_in(tmp_path, body, "{domain} {problem} {plan}"))
    assert end.outcome is Outcome.NO_PLAN
    assert "refused" not in end.detail


def test_of_a_plan_without_end_no_more_is_kept_than_is_read_of_a_file() -> None:
    printed = Printed()
    for _ in range(100):
        assert list(printed.feed(GOOD.encode() * 1000)) == []
    (kept,) = printed.rest()
    assert len(kept) < 5 << 20
    assert list(printed.feed(GOOD.encode() + b"\n")) == [GOOD.rstrip()]


def test_a_known_plan_comes_first_and_only_better_ones_follow(tmp_path: Path) -> None:
    known = retime(one_hall(), read_plan_text(LONG, one_hall()).actions)
    name = stand_in(tmp_path, "say(LONG + chr(10) + GOOD)")
    events = list(External(name).solve(one_hall(), AMPLE, start=known))
    assert [event.plan.makespan_ms for event in events if isinstance(event, Improved)] == [50_001, 30_001]


def test_the_files_are_the_domain_and_the_problem_in_a_private_folder_without_a_shell(tmp_path: Path) -> None:
    body = """
import json
folder = Path(sys.argv[1].removeprefix("-d=")).parent
told = {"words": sys.argv[1:], "mode": folder.stat().st_mode & 0o777, "here": os.getcwd(), "folder": str(folder)}
told["domain"], told["problem"] = ((folder / name).read_text() for name in ("domain.pddl", "problem.pddl"))
(Path(__file__).parent / "told").write_text(json.dumps(told))
"""
    solve(stand_in(tmp_path, body, "-d={domain} {problem}:{plan} '$HOME; a b' {} *"))
    told = json.loads((tmp_path / "told").read_text())
    folder = told["folder"]
    files = [f"-d={folder}/domain.pddl", f"{folder}/problem.pddl:{folder}/plan"]
    assert told["words"] == [*files, "$HOME; a b", "{}", "*"]
    assert (told["mode"], os.path.realpath(folder)) == (0o700, told["here"])
    assert told["domain"] == domain_text()
    assert told["problem"] == problem_text(one_hall(), records=False)
    assert not Path(folder).exists()


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("cmd:", r"\{domain\} and \{problem\} is missing"),
        ("cmd:popf {domain}", r"\{problem\} is missing, as in 'cmd:optic-clp \{domain\} \{problem\}'"),
        ("cmd:popf {Domain} {problem}", r"\{domain\} is missing"),
        ("cmd:popf '{domain} {problem}", "no closing quotation"),
    ],
)
def test_a_command_line_that_cant_be_used_is_refused(name: str, message: str) -> None:
    with pytest.raises(UsageError, match=message):
        engine(name)


def test_a_missing_executable_is_named() -> None:
    name = "cmd:no-such-planner {domain} {problem}"
    with pytest.raises(EngineUnavailable, match="there is no executable 'no-such-planner'"):
        engine(name).solve(one_hall(), AMPLE)
    with pytest.raises(EngineUnavailable, match="no-such-planner"):
        mission_engine(name, AMPLE)


def test_steps_cant_be_counted(tmp_path: Path) -> None:
    name = stand_in(tmp_path, "")
    with pytest.raises(UsageError, match="seconds"):
        engine(name).solve(one_hall(), Budget(steps=3))
    with pytest.raises(UsageError, match="seconds"):
        mission_engine(name, Budget(steps=3))


GREEDY = """
from marsupial.formats.pddl.text import check_domain, read_problem
from marsupial.formats.pddl.plantext import write_plan_text
from marsupial.planning.greedy import serve

check_domain(Path(sys.argv[1]).read_text())
situation = read_problem(Path(sys.argv[2]).read_text())
print("; Plan found with metric 0")
print(write_plan_text(serve(situation)[0], situation).upper())
with open(Path(__file__).parent / "calls", "a") as file:
    file.write("called" + chr(10))
"""


def greedy_stand_in(folder: Path) -> str:
    """Write a planner that reads its PDDL with marsupial's reader."""
    script = folder / "greedy planner.py"
    script.write_text(PRELUDE + GREEDY)
    return f"cmd:{shlex.quote(sys.executable)} {shlex.quote(str(script))} {{domain}} {{problem}}"


def test_marsupial_run_takes_a_command_line(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    name, room = greedy_stand_in(tmp_path), tmp_path / "room.map"
    room.write_text(
        "type octile\nheight 6\nwidth 20\nmap\n" + "@" * 20 + ("\n@" + "." * 18 + "@") * 4 + "\n" + "@" * 20
    )
    team = ["--carriers", "1", "--rovers", "1"]
    assert main(["run", str(room), *team, "--planner", name, "--budget", "60", "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert (told["status"], told["planner"]) == ("complete", name)
    assert (told["plans_invalid"], told["plans_refused"]) == (0, 0)
    assert 1 <= len((tmp_path / "calls").read_text().splitlines()) <= told["replans"]
