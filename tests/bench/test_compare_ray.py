"""A comparison on a real cluster of several nodes, all of them on this machine."""

import subprocess
import time
from collections.abc import Generator, Iterator, Sequence
from pathlib import Path

import psutil
import pytest
from ray_driver import comparison_in, is_hopeless
from ray_nodes import Nodes, interrupt, needs_ray
from support.waiting import HANG_S

from marsupial.bench.compare.conduct import conduct
from marsupial.bench.compare.folder import read_rows
from marsupial.bench.compare.plan import Comparison, Trial
from marsupial.bench.compare.rows import CRASHED, MissionRow, Result
from marsupial.bench.compare.trial import carry_out
from marsupial.cli.main import main

pytestmark = needs_ray

DRIVER = str(Path(__file__).with_name("ray_driver.py"))
PROGRAM = ("-m", "marsupial.cli.main", "compare", "lobby", "--carriers", "1-2", "--rovers", "1")
QUICK = ("--steps", "1", "--planner", "greedy", "--runs", "2")
LONG = ("--steps", "30", "--planner", "anytime", "--runs", "6", "--strategies", "temporal")
FILES = ("rows.csv", "coverage.csv", "comparison.json")


@pytest.fixture(scope="module")
def nodes() -> Iterator[Nodes]:
    started = Nodes(workers=2)
    yield started
    started.stop()


@pytest.fixture(scope="module")
def mortal() -> Iterator[Nodes]:
    """Nodes of which a test kills one."""
    started = Nodes(workers=2)
    yield started
    started.stop()


def bytes_of(out: Path) -> dict[str, bytes]:
    return {name: (out / name).read_bytes() for name in FILES}


def carried_out_here(out: Path, *arguments: str) -> dict[str, bytes]:
    assert main([*PROGRAM[2:], *arguments, "--workers", "2", "--out", str(out)]) == 0
    return bytes_of(out)


class Here:
    """A runner without workers."""

    def __init__(self, comparison: Comparison) -> None:
        self._comparison = comparison

    def results(self, trials: Sequence[Trial]) -> Generator[Result]:
        for trial in trials:
            if is_hopeless(trial):
                reason = "the worker process died 2 times: WorkerCrashedError"
                yield Result(row=MissionRow(trial=trial, status=CRASHED, reason=reason))
            else:
                yield carry_out(trial, self._comparison.scenarios[trial.case], self._comparison.budget)


def test_rows_are_the_same_bytes_as_those_of_a_local_run_though_workers_and_a_node_die(
    mortal: Nodes, tmp_path: Path
) -> None:
    marks = tmp_path / "marks"
    marks.mkdir()
    done = mortal.run(DRIVER, mortal.address, "dies", str(marks), str(tmp_path / "ray"))
    assert done.returncode == 0, done.stderr
    assert done.stdout == ""
    assert {entry.name for entry in marks.iterdir()} == {"worker", "node"}
    comparison = comparison_in(marks)
    conduct(comparison, Here(comparison), tmp_path / "here", lambda row, done, total: None)
    assert bytes_of(tmp_path / "ray") == bytes_of(tmp_path / "here")
    assert len(read_rows(tmp_path / "ray")) == 8


@pytest.mark.slow
def test_the_command_gives_the_same_on_a_node_through_ray_client_and_on_a_local_cluster(
    nodes: Nodes, tmp_path: Path
) -> None:
    here = carried_out_here(tmp_path / "here", *QUICK)
    for number, address in enumerate((nodes.address, nodes.client, "local")):
        done = nodes.run(*PROGRAM, *QUICK, "--ray", address, "--out", str(tmp_path / str(number)))
        assert done.returncode == 0, done.stderr
        assert bytes_of(tmp_path / str(number)) == here


def start_comparison(nodes: Nodes, out: Path, address: str) -> subprocess.Popen[bytes]:
    """Return a program that has carried out one of its missions."""
    program = nodes.begin(*PROGRAM, *LONG, "--ray", address, "--out", str(out))
    deadline = time.monotonic() + HANG_S
    while not ((out / "rows.csv").exists() and (out / "rows.csv").read_bytes().count(b"\n") > 1):
        if program.poll() is not None or time.monotonic() > deadline:
            program.kill()
            pytest.fail(program.communicate()[1].decode())
        time.sleep(0.01)
    return program


@pytest.mark.slow
def test_a_killed_comparison_resumes_without_losing_or_repeating_missions(nodes: Nodes, tmp_path: Path) -> None:
    out = tmp_path / "ray"
    program = start_comparison(nodes, out, nodes.address)
    at_work = nodes.missions()
    program.kill()
    program.communicate()
    assert psutil.wait_procs(at_work, HANG_S)[1] == []
    before = read_rows(out)
    assert 1 <= len(before) < 12
    done = nodes.run(*PROGRAM, *LONG, "--ray", nodes.address, "--out", str(out))
    assert done.returncode == 0, done.stderr
    assert f"12 missions, {len(before)} of them done before" in done.stderr
    assert bytes_of(out) == carried_out_here(tmp_path / "local", *LONG)


@pytest.mark.slow
@pytest.mark.parametrize("where", ["address", "client", "local"])
def test_ctrl_c_leaves_what_is_done_and_no_mission_on_the_cluster(nodes: Nodes, tmp_path: Path, where: str) -> None:
    program = start_comparison(nodes, tmp_path, where if where == "local" else getattr(nodes, where))
    below = psutil.Process(program.pid).children(recursive=True)
    error = interrupt(program)
    assert program.returncode == 130
    assert f"results so far are in {tmp_path}" in error
    assert "Traceback" not in error
    assert psutil.wait_procs(below, HANG_S)[1] == []
    assert psutil.wait_procs(nodes.missions(), HANG_S)[1] == []
    assert len(read_rows(tmp_path)) >= 1
