"""How planners with a command line end, or are ended, and what is said of it."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import psutil
import pytest
from stand_ins import events_of, next_makespan, solve, stand_in
from support.planning.spots import carrier, door, hall, room, rover, situation_of
from support.processes.process_tree import below_launcher
from support.waiting import doubling_budgets

from marsupial.model import UNREACHABLE, Budget, Outcome, Situation

pytestmark = pytest.mark.usefixtures("nothing_left")


def one_way() -> Situation:
    """Return: one rover, two targets without a way back from either; no plan exists, and this is expensive to prove."""
    situation = situation_of(
        [carrier(), rover(on="c1")], {"t1": room(12), "t2": room(14)}, {"m1": door(10)}, {"c1_start": hall(0)}
    )
    table = np.array(situation.travel_ms["rover"])
    for target in ("t1", "t2"):
        table[situation.place_index[target]] = UNREACHABLE
    return replace(situation, travel_ms={**situation.travel_ms, "rover": table})


@pytest.mark.parametrize(
    ("body", "outcome", "told"),
    [
        ("print('no steam', file=sys.stderr); sys.exit(3)", Outcome.CRASHED, "exit code 3, saying: no steam"),
        ("say('no steam'); sys.exit(3)", Outcome.CRASHED, "exit code 3, saying: no steam"),
        ("os.kill(os.getpid(), 9)", Outcome.KILLED, "signal"),
        ("os.kill(os.getpid(), 11)", Outcome.CRASHED, "signal"),
    ],
)
def test_each_end_of_a_planner_without_a_plan_has_its_own_outcome(
    tmp_path: Path, body: str, outcome: Outcome, told: str
):
    _, end = solve(stand_in(tmp_path, body))
    assert end.outcome is outcome
    assert told in end.detail


def test_a_planner_that_ends_without_a_plan_is_reported_with_its_output(tmp_path: Path) -> None:
    usage = "".join(f"\t-{letter}\tOption {letter};\n" for letter in "abcd")
    body = f"print('Reading', file=sys.stderr); say({usage!r}.join(['Unrecognised switch n' + chr(10), '']))"
    _, end = solve(stand_in(tmp_path, body))
    assert end.outcome is Outcome.NO_PLAN
    assert "saying: Reading || Unrecognised switch n | -b Option b; | -c Option c; | -d Option d;; 0" in end.detail


def test_a_planner_without_a_plan_in_time_is_reported_with_its_output(tmp_path: Path) -> None:
    planner = stand_in(tmp_path, "say('one' + chr(10)); (Path(__file__).parent / 'said').touch(); time.sleep(3600)")
    for seconds in doubling_budgets(1):
        _, end = solve(planner, budget=Budget(seconds=seconds))
        if (tmp_path / "said").exists():
            break
    assert end.detail == "stopped at the end of its time, saying: one; 0 plans accepted"


@pytest.mark.parametrize(
    "claim",
    [
        "b (2.0 | 1.0)d;; Problem unsolvable!\n;;;; Solution Found\n; Time 0.01\n",
        "The problem is unsolvable since at the fixpoint level the goals are mutex or not reachable\n",
        "Completely explored state space -- no solution!\n",
        "The problem has been proven unsolvable.",
    ],
    ids=["POPF", "LPG", "TFD", "other"],
)
@pytest.mark.parametrize("code", [0, 1])
def test_a_planner_that_says_unsolvable_is_believed(tmp_path: Path, claim: str, code: int) -> None:
    _, end = solve(stand_in(tmp_path, f"say({claim!r}); sys.exit({code})"), one_way())
    assert end.outcome is Outcome.UNSOLVABLE
    assert "nsolvable" in end.detail or "no solution" in end.detail


def test_giving_up_is_not_a_proof(tmp_path: Path) -> None:
    text = "Problem unsolvable by EHC, and best-first search has been disabled\n"
    assert solve(stand_in(tmp_path, f"say({text!r})"), one_way())[1].outcome is Outcome.NO_PLAN


def test_a_planner_that_never_ends_is_stopped_with_all_it_started(tmp_path: Path) -> None:
    body = """
signal.signal(signal.SIGTERM, signal.SIG_IGN)
sleep = "import signal, time; signal.signal(signal.SIGTERM, signal.SIG_IGN); time.sleep(3600)"
child = subprocess.Popen([sys.executable, "-SEc", sleep], start_new_session=True)
(Path(__file__).parent / "pids").write_text(f"{os.getpid()} {child.pid}")
time.sleep(3600)
"""
    for seconds in doubling_budgets(2):
        makespans, end = solve(stand_in(tmp_path, body), budget=Budget(seconds=seconds))
        assert (makespans, end.outcome) == ([], Outcome.TIMEOUT)
        if (tmp_path / "pids").exists():
            break
    pids = [int(pid) for pid in (tmp_path / "pids").read_text().split()]
    assert not any(psutil.pid_exists(pid) and psutil.Process(pid).status() != psutil.STATUS_ZOMBIE for pid in pids)


def test_a_planner_that_prints_steps_without_end_is_stopped_for_its_time(tmp_path: Path) -> None:
    body = "signal.signal(signal.SIGTERM, signal.SIG_IGN)\nwhile True:\n    os.write(1, HALF.encode() * 1000)"
    makespans, end = solve(stand_in(tmp_path, body), budget=Budget(seconds=1))
    assert (makespans, end.outcome) == ([], Outcome.TIMEOUT)


def test_processes_left_by_a_finished_planner_are_ended(tmp_path: Path) -> None:
    body = "subprocess.Popen(['sleep', '3600'], start_new_session=True); say(GOOD)"
    makespans, end = solve(stand_in(tmp_path, body))
    assert (makespans, end.outcome) == ([30_001], Outcome.SATISFICING)


def test_a_planner_may_print_its_plan_when_asked_to_end(tmp_path: Path) -> None:
    body = """
def leave(*_):
    say(GOOD)
    os._exit(1)
signal.signal(signal.SIGTERM, leave)
say(LONG + chr(10))
while True:
    time.sleep(1)
"""
    for seconds in doubling_budgets(3):
        makespans, end = solve(stand_in(tmp_path, body), budget=Budget(seconds=seconds))
        if len(makespans) == 2:
            break
    assert (makespans, end.outcome) == ([50_001, 30_001], Outcome.SATISFICING)
    assert "end of its time" in end.detail


def test_a_planner_that_exceeds_its_memory_has_its_own_outcome(tmp_path: Path) -> None:
    body = "blocks = []\nwhile True:\n    blocks.append(bytearray(b'x') * (8 << 20)); time.sleep(0.01)"
    _, end = solve(stand_in(tmp_path, body), memory_bytes=200 << 20)
    assert end.outcome is Outcome.MEMORY


def test_closing_early_ends_the_planner(tmp_path: Path) -> None:
    events = events_of(stand_in(tmp_path, "say(LONG + chr(10)); time.sleep(3600)"))
    next_makespan(events)
    _supervisor, *rest = sorted(below_launcher(), key=lambda process: process.pid)
    assert len(rest) == 2  # job, planner
    events.close()
    assert not any(process.is_running() for process in rest)  # the supervisor may end a moment later


def test_an_executable_that_cant_be_started_is_a_crash(tmp_path: Path) -> None:
    script = tmp_path / "planner"
    script.write_text("#!/no/such/interpreter\n")
    script.chmod(0o700)
    _, end = solve(f"cmd:{script} {{domain}} {{problem}}")
    assert end.outcome is Outcome.CRASHED
    assert "planner can't be run: No such file" in end.detail
