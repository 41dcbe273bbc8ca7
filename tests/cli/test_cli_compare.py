import json
import os
import signal
import subprocess
import sys
from pathlib import Path

import psutil
import pytest
from support.waiting import HANG_S, wait_until

from marsupial.bench.compare.folder import read_rows
from marsupial.cli.display.messages import Volume, set_volume
from marsupial.cli.main import main
from marsupial.cli.work.compare_arguments import contenders, warn_of_ignored
from marsupial.cli.work.comparing import Lines
from marsupial.model.planning import Budget

QUICK = ("--steps", "1", "--planner", "greedy")
WHOLE = ("lobby", *QUICK, "--carriers", "1-2", "--rovers", "1", "--runs", "2")
FILES = ("rows.csv", "comparison.json")


def compare(*arguments: str) -> int:
    return main(["compare", *arguments])


def bytes_of(out: Path) -> dict[str, bytes]:
    return {name: (out / name).read_bytes() for name in FILES}


@pytest.fixture(scope="module")
def done(tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("comparison") / "out"
    assert compare(*WHOLE, "--workers", "1", "--out", str(out)) == 0
    return out


def test_a_comparison_leaves_rows_tables_figures_and_a_page(done: Path) -> None:
    rows = read_rows(done)
    assert len(rows) == 8
    assert all(row.complete and row.coverage == 1.0 for row in rows)
    assert (done / "report.html").read_text().startswith("<!DOCTYPE html>")
    assert "## Exploration time: lobby" in (done / "tables.md").read_text()
    assert (done / "figures" / "time-and-quality-lobby.png").exists()
    names = {entry.name for entry in done.iterdir()}
    assert names == {
        ".lock", "comparison.json", "rows.csv", "timings.csv", "coverage.csv", "tables.md", "figures", "report.html",
        "replays",
    }  # fmt: skip


def test_rows_do_not_depend_on_the_number_of_workers(done: Path, tmp_path: Path) -> None:
    assert compare("lobby", *QUICK, "--carriers", "1,2", "--rovers", "1", "--runs", "2", "--workers", "2",
                   "--out", str(tmp_path)) == 0  # fmt: skip
    assert bytes_of(tmp_path) == bytes_of(done)
    assert (tmp_path / "coverage.csv").read_bytes() == (done / "coverage.csv").read_bytes()


def test_a_row_equals_the_summary_of_run_for_the_same_mission(done: Path, capsys: pytest.CaptureFixture[str]) -> None:
    row = next(row for row in read_rows(done) if row.trial.case.carriers == 2 and row.trial.seed == 2)
    assert main(["run", "lobby", *QUICK, "--carriers", "2", "--rovers", "1", "--seed", "2", "--json"]) == 0
    summary = json.loads(capsys.readouterr().out)
    assert row.exploration_time_s == summary["exploration_time_s"]
    assert row.distance_m == summary["distance_m"]
    assert row.quality == pytest.approx(summary["quality"], abs=1e-6)


def test_finished_missions_are_reported_again_and_not_rerun(done: Path, capsys: pytest.CaptureFixture[str]) -> None:
    before = bytes_of(done)
    page = (done / "report.html").read_bytes()
    (done / "report.html").unlink()
    assert compare("--report", str(done)) == 0
    captured = capsys.readouterr()
    assert (done / "report.html").read_bytes() == page
    assert "temporal (greedy)" in captured.out
    assert compare(*WHOLE, "--out", str(done)) == 0
    assert "8 missions, 8 of them done before" in capsys.readouterr().err
    assert bytes_of(done) == before


def test_documents_of_what_the_folder_held_before_it_grew_are_removed(done: Path) -> None:
    figures = {figure.name for figure in (done / "figures").iterdir()}
    for name in ("checklist.md", "figures/figure-6.svg", "figures/figure-6.png"):
        (done / name).write_text("of the paper's experiment alone")
    assert compare("--report", str(done)) == 0
    assert not (done / "checklist.md").exists()
    assert {figure.name for figure in (done / "figures").iterdir()} == figures


@pytest.mark.parametrize(
    ("arguments", "code", "message"),
    [
        ((), 2, "needs a SCENARIO"),
        (("lobby", "--suite", "paper", "--out", "x"), 2, "not both"),
        (("--suite", "papers", "--out", "x"), 2, "unknown suite 'papers', did you mean 'paper'?"),
        (("--suite", "laser", "--out", "x"), 2, "buildings are missing: fr101.yaml, depot_nav2_fixed.yaml"),
        (("--suite", "buildings-last", "--out", "x"), 2, "buildings are missing: movecare_lab.yaml, kth_a1.yaml"),
        (("lobby",), 2, "--out is missing"),
        (("nowhere", "--out", "x"), 3, "neither a built-in scenario nor a file"),
        (("lobby", "--out", "x", "--carriers", "0"), 2, "--carriers: must be 1 or more, got 0"),
        (("lobby", "--out", "x", "--carriers", "2,3-1"), 2, "--carriers: '3-1' descends; write 1-3"),
        (("lobby", "--out", "x", "--carriers", "1-1000000000"), 2, "--carriers: must be at most 1000, got 1000000000"),
        (("lobby", "--out", "x", "--rovers", "0:20-0:80"), 2, "--rovers: '0:20' in '0:20-0:80' is not a whole number"),
        (("lobby", "--out", "x", "--rovers", "1,1001"), 2, "--rovers: must be at most 1000, got 1001"),
        (("lobby", "--out", "x", "--carriers", "600", "--rovers", "1"), 3, "carriers: a team has at most 1000 robots"),
        (("lobby", "--out", "x", "--rovers", "some"), 2, "is not a whole number; write numbers like 2, 1-6 or 1,2,4"),
        (("lobby", "--out", "x", "--strategies", "luck"), 2, "unknown strategy 'luck'"),
        (("lobby", "--out", "x", "--strategies", "heuristic:greedy"), 2, "heuristic asks no planner"),
        (("lobby", "--out", "x", "--strategies", "heuristic,heuristic"), 2, "heuristic is named twice"),
        (("lobby", "--out", "x", "--strategies", "temporal:luck"), 2, "unknown planner 'luck'"),
        (("lobby", "--out", "x", "--steps", "1", "--budget", "1"), 2, "a budget is either"),
        (("lobby", "--out", "x", "--time-limit", "0"), 2, "--time-limit: must be positive"),
        (("--report", "nowhere"), 3, "nowhere: holds no comparison"),
        (("lobby", "--report", "x"), 2, "--report takes no SCENARIO"),
        (("--report", "x", "--runs", "3", "--steps", "2"), 2, "--report takes no --runs and no --steps"),
    ],
)
def test_contradictory_options_are_refused_before_anything_is_written(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    arguments: tuple[str, ...],
    code: int,
    message: str,
) -> None:
    monkeypatch.chdir(tmp_path)
    assert compare(*arguments) == code
    assert message in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []


def test_a_failed_mission_has_a_row_and_a_message(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert compare("lobby", *QUICK, "--carriers", "1", "--rovers", "1", "--runs", "1", "--time-limit", "5",
                   "--strategies", "temporal", "--workers", "1", "--out", str(tmp_path)) == 0  # fmt: skip
    error = capsys.readouterr().err
    (row,) = read_rows(tmp_path)
    assert row.status == "time_limit"
    assert "lobby 1x1, temporal (greedy), seed 1: time_limit: " in error
    assert "1 of 1 missions are not complete" in error


def test_maps_with_the_same_name_are_distinguished(tmp_path: Path) -> None:
    room = "type octile\nheight 4\nwidth 6\nmap\n@@@@@@\n@....@\n@....@\n@@@@@@\n"
    for name in ("a", "b"):
        (tmp_path / name).mkdir()
        (tmp_path / name / "room.map").write_text(room)
    sources = [str(tmp_path / name / "room.map") for name in ("a", "b")]
    out = tmp_path / "out"
    assert compare(*sources, *QUICK, "--carriers", "1", "--rovers", "0", "--runs", "1", "--workers", "1",
                   "--strategies", "heuristic", "--out", str(out)) == 0  # fmt: skip
    assert [row.trial.case.scenario for row in read_rows(out)] == ["room", sources[1]]


def start(out: Path, *more: str) -> subprocess.Popen[bytes]:
    program = [sys.executable, "-m", "marsupial.cli.main", "compare"]
    command = [*program, *WHOLE, "--workers", "2", "--out", str(out), *more]
    process = subprocess.Popen(command, stderr=subprocess.PIPE, stdout=subprocess.DEVNULL, start_new_session=True)

    def has_row() -> bool:
        assert process.poll() is None, process.communicate()[1].decode()
        return (out / "rows.csv").exists() and (out / "rows.csv").read_bytes().count(b"\n") > 1

    wait_until(has_row)
    return process


def test_a_killed_comparison_resumes_with_the_same_result(done: Path, tmp_path: Path) -> None:
    process = start(tmp_path)
    workers = psutil.Process(process.pid).children(recursive=True)
    process.kill()
    process.communicate()
    assert workers
    assert psutil.wait_procs(workers, HANG_S)[1] == []
    assert compare(*WHOLE, "--workers", "1", "--out", str(tmp_path)) == 0
    assert bytes_of(tmp_path) == bytes_of(done)


def test_ctrl_c_leaves_what_is_done_and_no_worker(tmp_path: Path) -> None:
    process = start(tmp_path)
    children = psutil.Process(process.pid).children(recursive=True)
    os.killpg(process.pid, signal.SIGINT)  # as a terminal does
    error = process.communicate(timeout=HANG_S)[1].decode()
    assert process.returncode == 130
    assert f"results so far are in {tmp_path}" in error
    assert "Traceback" not in error
    assert psutil.wait_procs(children, HANG_S)[1] == []
    assert len(read_rows(tmp_path)) >= 1


def test_the_time_left_is_estimated_from_the_pace_of_this_run(capsys: pytest.CaptureFixture[str]) -> None:
    moments = iter([0.0, 0.0, 60.0])
    lines = Lines(lambda: next(moments))
    lines.watch(None, 10, 40)
    assert lines.words(20, 40) == "20 of 40 missions (50%), about 2:00 left"
    assert capsys.readouterr().err == "40 missions, 10 of them done before\n"


def test_best_and_worst_pair_can_be_watched_from_the_page(done: Path) -> None:
    pages = sorted((done / "replays").iterdir())
    assert [page.name.split("-")[0] for page in pages] == ["best", "worst"]
    report = (done / "report.html").read_text()
    assert all(f'href="replays/{page.name}"' in report for page in pages)
    text = pages[0].read_text()
    assert all(strategy in text for strategy in ("temporal", "heuristic"))


def test_a_verbose_comparison_prints_each_mission_and_a_quiet_one_nothing(
    done: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    row = read_rows(done)[0]
    for volume, told in ((Volume.VERBOSE, f"{row.trial}: {row.status}\n"), (Volume.QUIET, "")):
        set_volume(volume)
        try:
            Lines(lambda: 0.0).watch(row, 1, 40)
        finally:
            set_volume(Volume.NORMAL)
        assert capsys.readouterr().err == told


def test_options_without_effect_on_any_contender_are_warned_of(capsys: pytest.CaptureFixture[str]) -> None:
    steps = Budget(steps=1)
    for text, planner, limit, ignored in (
        ("temporal:greedy,heuristic", "exact", None, "--planner exact is ignored"),
        ("heuristic,assignment", None, "--steps", "--steps is ignored"),
        ("temporal,heuristic", "greedy", "--steps", None),
    ):
        warn_of_ignored(text, contenders(text, planner, steps), planner, limit)
        told = capsys.readouterr().err
        assert told.startswith(f"warning: {ignored}") if ignored else told == ""
