import decimal
import os
import signal
import socket
import subprocess
import sys
import threading
import time
import types
from contextlib import closing
from pathlib import Path

import misbehaving_jobs
import psutil
import pytest
from support.processes.process_tree import is_gone
from support.waiting import HANG_S, wait_until

from marsupial.errors import InternalError
from marsupial.processes import channel as frames
from marsupial.processes import launcher as processes
from marsupial.processes.channel import START, Channel
from marsupial.processes.jobs import Ended, Ending, Job, JobLimits, Message, ending_of
from marsupial.processes.loading import Loading

pytestmark = pytest.mark.usefixtures("nothing_left")

MIB = 1 << 20


def job(name: str, argument: object = None, *, talks: bool = False, **limits: float) -> Job:
    settings = {"wall_s": HANG_S, **limits}
    return Job(function=getattr(misbehaving_jobs, name), argument=argument, limits=JobLimits(**settings), talks=talks)


def result(name: str, argument: object = None, **limits: float) -> tuple[list[object], Ended]:
    *messages, ended = processes.run(job(name, argument, **limits))
    assert isinstance(ended, Ended)
    return [message.value for message in messages if isinstance(message, Message)], ended


def launcher() -> psutil.Process:
    processes.warm_up()
    (found,) = [p for p in psutil.Process().children() if "marsupial.processes.fork_server" in " ".join(p.cmdline())]
    return found


def value(run: processes.JobRun) -> object:
    event = next(run)
    return event.value


def test_a_job_streams_what_it_yields_and_finishes() -> None:
    values, ended = result("count", 3)
    assert values == [0, 1, 2]
    assert ended.ending is Ending.FINISHED


def test_a_job_has_its_own_session_and_leaves_no_core_files() -> None:
    values, _ = result("whoami")
    assert values == [{"session": True, "core": 0}]


def test_the_launcher_has_one_thread_and_serves_many_jobs() -> None:
    before = launcher()
    assert before.num_threads() == 1
    result("count", 1)
    result("count", 1)
    assert launcher() == before


@pytest.mark.parametrize(
    ("name", "argument", "detail"),
    [
        ("raise_error", "boiler pressure", "ValueError: boiler pressure"),
        ("exit_with", 3, "exit code 3"),
        ("exit_with", 0, ""),
        ("segfault", None, "SIGSEGV"),
    ],
)
def test_a_premature_end_of_a_job_is_a_crash_with_its_cause(name: str, argument: object, detail: str) -> None:
    values, ended = result(name, argument)
    assert (values, ended.ending) == ([1], Ending.CRASHED)
    assert detail in ended.detail
    assert "Traceback" in ended.output or name != "raise_error"


def test_a_function_the_worker_can_not_import_is_a_crash(monkeypatch: pytest.MonkeyPatch) -> None:
    here = types.ModuleType("only_here")
    exec("def no_such_job(_): yield 1", vars(here))
    monkeypatch.setitem(sys.modules, "only_here", here)
    *_, ended = processes.run(Job(function=here.no_such_job, argument=None, limits=JobLimits(wall_s=HANG_S)))
    assert (ended.ending, ended.detail) == (Ending.CRASHED, "ModuleNotFoundError: No module named 'only_here'")


def test_a_job_killed_from_outside_has_its_own_status() -> None:
    run = processes.run(job("sleep"))
    os.kill(int(str(value(run))), signal.SIGKILL)
    (ended,) = run
    assert ended.ending is Ending.KILLED
    assert "SIGKILL" in ended.detail


def test_a_job_whose_tool_was_killed_is_killed() -> None:
    _, ended = result("tool_killed")
    assert (ended.ending, ended.detail) == (Ending.KILLED, "the tool was ended by signal SIGKILL")


@pytest.mark.parametrize("name", ["sleep", "ignore_term", "spin_in_native_code", "escape_and_sleep"])
def test_a_job_that_never_ends_is_stopped_at_its_limit_with_all_it_started(name: str) -> None:
    values, ended = result(name, wall_s=0.6)
    assert ended.ending is Ending.TIMEOUT
    assert all(is_gone(int(str(pid))) for pid in values)


def test_processes_left_by_a_finished_job_are_ended() -> None:
    values, ended = result("escape")
    assert ended.ending is Ending.FINISHED
    assert is_gone(int(str(values[0])))


@pytest.mark.parametrize("name", ["allocate", "rest_and_allocate"])
def test_measured_memory_is_limited(name: str) -> None:
    _, ended = result(name, 8 * MIB, memory_bytes=400 * MIB)
    assert ended.ending is Ending.MEMORY
    assert "400 MiB" in ended.detail


def test_an_allocation_too_big_at_once_fails_inside_the_job() -> None:
    assert result("allocate_at_once", 8 << 30, memory_bytes=400 * MIB)[1].ending is Ending.MEMORY


def test_processor_time_is_limited() -> None:
    assert result("spin_in_native_code", cpu_s=1.0)[1].ending is Ending.TIMEOUT


def test_of_a_flood_of_output_the_end_is_kept() -> None:
    values, ended = result("flood_output", 20 * MIB)
    assert (values, ended.ending) == ([1], Ending.FINISHED)
    assert ended.output.endswith("the end\n")
    assert len(ended.output) <= 4096


def test_a_message_above_the_bound_is_a_crash() -> None:
    values, ended = result("yield_big", frames.MAX_BYTES + 1)
    assert (values, ended.ending) == ([], Ending.CRASHED)
    assert "allowed" in ended.detail


def test_messages_wait_for_a_slow_reader() -> None:
    run = processes.run(job("yield_much", 30))
    next(run)
    time.sleep(0.1)
    assert len(list(run)) == 30  # 29 more and the end


def test_a_job_that_talks_sends_and_receives() -> None:
    run = processes.run(job("echo", "hello", talks=True))
    run.send(21)  # perhaps before the job listens
    assert value(run) == "hello"
    assert value(run) == 42
    run.send("x" * 3_000_000)
    assert value(run) == "x" * 6_000_000
    run.send(None)
    (ended,) = run
    assert ended.ending is Ending.FINISHED
    run.send("too late")


def test_values_come_all_and_in_order_however_late_they_are_read(tmp_path: Path) -> None:
    run = processes.run(job("listen_late", str(tmp_path), talks=True))
    sending = threading.Thread(target=lambda: [run.send("x" * 1_000_000) for _ in range(50)])
    sending.start()
    sending.join(1.0)
    assert sending.is_alive()  # buffers are bounded
    (tmp_path / "go").touch()
    sending.join()
    run.send(None)
    assert value(run) == 50
    run.close()


@pytest.mark.parametrize("name", ["echo", "listen_never"])
def test_a_job_that_waits_or_does_not_listen_can_be_cancelled(name: str) -> None:
    run = processes.run(job(name, "hello", talks=True))
    value(run)
    threading.Timer(0.3, run.cancel).start()
    for _ in range(50 if name == "listen_never" else 0):
        run.send("x" * 1_000_000)  # blocks, but not forever
    (ended,) = run
    assert ended.ending in (Ending.CANCELLED, Ending.KILLED)


def test_a_message_above_the_bound_is_not_sent() -> None:
    run = processes.run(job("echo", "hello", talks=True))
    with pytest.raises(frames.FrameTooBig):
        run.send(b"x" * (frames.MAX_BYTES + 1))
    run.close()


def test_functions_and_modules_are_loaded_once_for_all_jobs_whenever_that_is_asked_for() -> None:
    processes.shutdown()
    result("count", 1)
    processes.warm_up(preload=(decimal, misbehaving_jobs.fail_to_load, misbehaving_jobs.load))
    processes.warm_up(preload=(misbehaving_jobs.load,))
    assert result("tell_loaded")[0] == result("tell_loaded")[0] == [[launcher().pid]]
    processes.shutdown()
    assert result("tell_loaded")[0] == [[launcher().pid]]  # the next one too


def test_closing_early_leaves_nothing_running() -> None:
    run = processes.run(job("ignore_term"))
    pid = int(str(value(run)))
    run.close()
    assert not psutil.pid_exists(pid)
    assert list(run) == []


def test_a_job_can_be_cancelled_from_another_thread() -> None:
    run = processes.run(job("sleep"))
    next(run)
    threading.Timer(0.05, run.cancel).start()
    (ended,) = run
    assert ended.ending is Ending.CANCELLED


def test_two_jobs_run_at_a_time() -> None:
    first, second = processes.run(job("sleep")), processes.run(job("count", 2))
    next(first)
    assert len(list(second)) == 3
    first.close()


def test_when_the_supervisor_is_killed_the_job_is_ended_too() -> None:
    run = processes.run(job("escape_and_sleep"))
    pid = int(str(value(run)))
    (supervisor,) = launcher().children()
    supervisor.kill()
    (ended,) = run
    assert ended.ending is Ending.KILLED
    assert is_gone(pid)


def test_when_the_launcher_is_killed_its_jobs_end_and_a_new_one_is_started() -> None:
    before = launcher()
    run = processes.run(job("escape_and_sleep"))
    pid = int(str(value(run)))
    before.kill()
    *_, ended = run
    assert ended.ending is Ending.KILLED
    assert is_gone(pid)
    assert result("count", 1)[0] == [0]


def killed_while_starting(times: int) -> tuple[list[object], Ended]:
    """Return the result of a job whose launcher is killed `times` times before it is ready."""
    processes.shutdown()
    killed: set[int] = set()

    def kill() -> None:
        while len(killed) < times:
            for process in psutil.Process().children():
                if process.pid not in killed and "marsupial.processes.fork_server" in " ".join(process.cmdline()):
                    killed.add(process.pid)
                    process.kill()

    killer = threading.Thread(target=kill)
    killer.start()
    try:
        return result("count", 1)
    finally:
        killer.join()


def test_a_launcher_killed_before_it_is_ready_is_replaced() -> None:
    assert killed_while_starting(times=2)[0] == [0]


def test_a_launcher_killed_repeatedly_is_reported_as_not_starting() -> None:
    with pytest.raises(InternalError, match="can't be started: it was ended by signal SIGKILL"):
        killed_while_starting(times=3)


def test_a_launcher_that_ends_by_itself_was_not_killed(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(processes, "_CODE", "")
    found = processes.Launcher()
    with pytest.raises(InternalError, match="it ended with exit code 0"):
        found.answer(found.ask(b"", None))
    assert not found.was_killed()
    found.close()


class SlowChannel(Channel):
    """A channel on which nothing arrives for a number of polls, during which a fork server compiles on or not."""

    def __init__(self, polls: int, file: int | None) -> None:
        super().__init__(socket.socket())
        self._polls, self._file = polls, file

    def receive_frame(self, timeout_s: float | None = None) -> tuple[bytes, bytes] | None:
        self._polls -= 1
        if self._polls < 0:
            return START, b"done"
        if self._file is not None:
            os.pwrite(self._file, loading_bytes(Loading(compiled=self._polls, functions=5000)), 0)
        raise TimeoutError


def loading_bytes(found: Loading) -> bytes:
    return b"".join(number.to_bytes(4, sys.byteorder) for number in found)


def test_a_start_may_take_as_long_as_it_makes_progress() -> None:
    with closing(processes.Launcher()) as found:
        with closing(SlowChannel(2000, found._progress.fileno())) as busy:
            assert found.answer(busy) == b"done"
        with pytest.raises(InternalError, match=r"it got no further within 600 s \(compiling, 0 of 5000 functions\)"):
            found.answer(SlowChannel(2000, None))


def test_a_launcher_says_how_far_it_has_loaded_what_it_was_asked_to_load(tmp_path: Path) -> None:
    processes.shutdown()
    assert processes.loading_now() is None
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv(misbehaving_jobs.GATE, str(tmp_path / "gate"))
        processes.warm_up(wait=False, preload=(misbehaving_jobs.compile_slowly,))
        wait_until(lambda: str(processes.loading_now()) == "compiling, 15 of 41 functions")
        (tmp_path / "gate").touch()
        processes.warm_up()
    assert processes.loading_now() is None
    processes._preload.pop(misbehaving_jobs.compile_slowly)


def test_shutdown_ends_everything_and_the_next_job_starts_a_new_launcher() -> None:
    before = launcher()
    run = processes.run(job("ignore_term"))
    pid = int(str(value(run)))
    processes.shutdown()
    assert is_gone(pid)
    assert not before.is_running()
    assert isinstance(list(run)[-1], Ended)
    assert result("count", 1)[0] == [0]


def test_when_the_asker_is_killed_everything_below_it_ends() -> None:
    code = (
        "from marsupial.processes import launcher as processes\n"
        "from marsupial.processes.jobs import Job, JobLimits\n"
        "from misbehaving_jobs import escape_and_sleep\n"
        "run = processes.run(Job(function=escape_and_sleep, argument=None, limits=JobLimits(wall_s=60)))\n"
        "print(next(run).value, processes._current()._process.pid, flush=True)\n"
        "input()\n"
    )
    path = os.pathsep.join(entry for entry in [str(Path(__file__).parent), *sys.path] if entry)
    with subprocess.Popen(
        [sys.executable, "-c", code],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
        env={**os.environ, "PYTHONPATH": path},
    ) as client:
        escaped, its_launcher = (int(pid) for pid in client.stdout.readline().split())
        client.kill()
    assert is_gone(escaped)
    assert is_gone(its_launcher)


@pytest.mark.parametrize(
    ("returncode", "output", "ending"),
    [
        (-signal.SIGKILL, "", Ending.KILLED),
        (-signal.SIGTERM, "", Ending.KILLED),
        (-signal.SIGABRT, "", Ending.CRASHED),
        (-signal.SIGABRT, "terminate called after throwing an instance of 'std::bad_alloc'", Ending.MEMORY),
        (-signal.SIGXCPU, "", Ending.TIMEOUT),
        (1, "", Ending.CRASHED),
    ],
)
def test_return_codes_become_statuses(returncode: int, output: str, ending: Ending) -> None:
    assert ending_of(returncode, output) is ending
