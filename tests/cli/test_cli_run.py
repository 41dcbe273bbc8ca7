import json
import math
import os
import re
import signal
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import psutil
import pytest
from support.waiting import HANG_S

from benchmarks.scenario_files import write_scenario
from marsupial.bench.compare.arguments import cases_of
from marsupial.cli.display.messages import warn
from marsupial.cli.main import main
from marsupial.formats.missionlog import read_log
from marsupial.generators.builtin import builtin_scenario
from marsupial.model.mission import Status, started

QUICK = ("--planner", "greedy", "--steps", "1")

KEYS = (
    dict.fromkeys(("status", "reason", "strategy", "planner"), str)
    | dict.fromkeys(("carriers", "rovers", "seed", "replans", "plans_valid", "plans_invalid"), int)
    | dict.fromkeys(("exploration_time_s", "coverage", "explored_area_m2", "reachable_area_m2"), float)
    | dict.fromkeys(("distance_m", "quality", "analysis_s"), float)
    | {"planning_s": dict, "deployments": int, "retrievals": int, "remaining": list}
)

ROOM = "type octile\nheight 6\nwidth 8\nmap\n" + "@" * 8 + "\n" + "@......@\n" * 4 + "@" * 8 + "\n"


def run_json(capsys: pytest.CaptureFixture[str], *arguments: str) -> tuple[int, dict[str, Any], str]:
    code = main(["run", *arguments, "--json"])
    captured = capsys.readouterr()
    return code, json.loads(captured.out), captured.err


def refused(capsys: pytest.CaptureFixture[str], *arguments: str) -> tuple[int, str]:
    code = main(["run", *arguments])
    captured = capsys.readouterr()
    assert captured.out == ""
    return code, captured.err


@pytest.fixture
def room(tmp_path: Path) -> Path:
    path = tmp_path / "room.map"
    path.write_text(ROOM)
    return path


def test_json_tells_how_the_lobby_was_explored_and_that_the_rovers_came_back(
    capsys: pytest.CaptureFixture[str],
) -> None:
    code, summary, _ = run_json(capsys, "lobby", *QUICK)
    assert code == 0
    assert {key: type(summary[key]) for key in KEYS} == KEYS
    assert summary["planning_s"].keys() >= {"median", "p95", "max", "total"}
    numbers = [v for part in (summary, summary["planning_s"]) for v in part.values() if isinstance(v, float)]
    assert all(math.isfinite(number) for number in numbers)
    assert (summary["status"], summary["coverage"], summary["plans_invalid"]) == ("complete", 1.0, 0)
    assert (summary["carriers"], summary["rovers"], summary["planner"], summary["log"]) == (2, 2, "greedy", None)
    assert summary["robots"] == 6
    assert summary["aboard"] == ["rover1_1", "rover1_2", "rover2_1", "rover2_2"]
    assert summary["distance_m"] == pytest.approx(sum(summary["distance_m_per_robot"].values()), abs=1e-3)
    assert summary["quality"] == pytest.approx(summary["explored_area_m2"] / summary["distance_m"], rel=1e-6)


def test_interference_is_counted_in_the_summary_and_stands_in_the_log(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    team = ("lobby", *QUICK, "--carriers", "6", "--seed", "2")
    for given in (True, False):
        log = tmp_path / f"{given}.jsonl"
        code, summary, _ = run_json(capsys, *team, "--log", str(log), *(("--interference",) if given else ()))
        lines = log.read_text().splitlines()
        assert (code, summary["log"]) == (0, str(log))
        assert ("interference" in summary) is given
        assert json.loads(lines[0]).get("interference", False) is given
        assert json.loads(lines[-1]).get("interference") == summary.get("interference")
        assert ("interference" in log.read_text()) is given
    assert main(["run", *team, "--interference"]) == 0
    assert re.search(r"interference +\d+ waits?, \d+ s in all, \d+ deadlocks? resolved", capsys.readouterr().out)


def test_a_service_takes_no_interference(capsys: pytest.CaptureFixture[str]) -> None:
    code, errors = refused(capsys, "lobby", "--interference", "--server", "http://127.0.0.1:9")
    assert code == 2
    assert "robots of a service share cells" in errors


def test_a_bare_map_is_a_scenario(capsys: pytest.CaptureFixture[str], room: Path) -> None:
    code, summary, _ = run_json(capsys, str(room), *QUICK, "--carriers", "1", "--rovers", "0")
    assert (code, summary["scenario"], summary["coverage"]) == (0, "room", 1.0)


@pytest.mark.parametrize("ignored", ["--planner greedy", "--steps 3", "--budget 3.0"])
def test_a_strategy_without_a_planner_warns_of_ignored_options(
    capsys: pytest.CaptureFixture[str], ignored: str
) -> None:
    _, summary, errors = run_json(capsys, "lobby", "--strategy", "heuristic", *ignored.split(), "--time-limit", "1")
    assert (summary["strategy"], summary["planner"]) == ("heuristic", "none")
    assert f"strategy heuristic asks no planner: {ignored} is ignored" in errors


def test_a_seed_without_effect_is_warned_of(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    scenario = replace(builtin_scenario("lobby"), start_seed=3)
    write_scenario(scenario, "fixed.json")
    mission = ("fixed.json", "--strategy", "heuristic", "--time-limit", "1")
    assert "--seed 2 is ignored: fixed.json says where robots start" in run_json(capsys, *mission, "--seed", "2")[2]
    assert "ignored" not in run_json(capsys, *mission)[2]


def test_a_quiet_mission_prints_data_only_and_a_verbose_one_each_plan(capsys: pytest.CaptureFixture[str]) -> None:
    mission = ("lobby", "--planner", "greedy", "--steps", "1")
    _, summary, errors = run_json(capsys, *mission, "--quiet")
    assert errors == ""
    _, _, errors = run_json(capsys, *mission, "-v")
    told = [line for line in errors.splitlines() if re.search(r"%  plan \d+: .*; planned in \d", line)]
    assert len(told) == summary["replans"]
    assert refused(capsys, *mission, "-q", "-v") == (2, "error: --quiet and --verbose: only one of them\n")


def test_a_mission_that_runs_out_of_time_is_no_success(capsys: pytest.CaptureFixture[str]) -> None:
    code, summary, _ = run_json(capsys, "lobby", *QUICK, "--time-limit", "5")
    assert (code, summary["status"]) == (5, "time_limit")
    assert summary["mission_time_s"] <= 5.0
    assert summary["remaining"]
    assert all(frontier["reason"] for frontier in summary["remaining"])


def test_a_summary_for_people_names_what_is_left(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["run", "lobby", *QUICK, "--time-limit", "5", "--carriers", "1"]) == 5
    out = capsys.readouterr().out
    assert "time_limit: time limit of 5 s reached" in out
    assert "1 carrier, 2 rovers" in out
    assert "\nleft: " in out


def test_progress_is_a_few_lines_on_stderr(capsys: pytest.CaptureFixture[str]) -> None:
    main(["run", "lobby", *QUICK, "--json"])
    lines = capsys.readouterr().err.splitlines()
    assert lines[0] == "lobby: temporal (greedy), 6 robots, seed 1"
    assert lines[-1].endswith("100%  complete: no reachable target is left, all rovers are aboard")
    assert len(lines) < 10


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("lobby", "--planner", "nobody"), "unknown planner 'nobody'"),
        (("lobby", "--strategy", "nothing"), "unknown strategy 'nothing'"),
        (("lobby", "--budget", "1", "--steps", "1"), "either a number of seconds or a number of steps"),
        (("lobby", "--budget", "0"), "must be positive"),
        (("lobby", "--budget", "inf"), "must be finite"),
        (("lobby", "--steps", "-3"), "must be 1 or more"),
        (("lobby", "--planning-time", "later"), "--planning-time: must be instant or charged, got 'later'"),
        (("lobby", "--time-limit", "-1"), "--time-limit: must be positive, got -1"),
        (("lobby", "--carriers", "two"), "--carriers"),
        ((), "SCENARIO"),
    ],
)
def test_contradictory_options_are_a_usage_error(
    capsys: pytest.CaptureFixture[str], arguments: tuple[str, ...], message: str
) -> None:
    code, errors = refused(capsys, *arguments)
    assert code == 2
    assert message in errors
    assert "Traceback" not in errors


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("loby",), "did you mean 'lobby'?"),
        (("nowhere.yaml",), "neither a built-in scenario nor a file"),
        (("lobby", "--carriers", "0"), "carriers: must be 1 or more, got 0"),
        (("lobby", "--carriers", "1000000000"), "carriers: must be at most 1000, got 1000000000"),
        (("lobby", "--rovers", "1000000000"), "rovers: must be at most 1000, got 1000000000"),
        (("lobby", "--rovers", "-1"), "rovers: must be 0 or more, got -1"),
    ],
)
def test_a_scenario_that_is_wrong_is_invalid_input(
    capsys: pytest.CaptureFixture[str], arguments: tuple[str, ...], message: str
) -> None:
    code, errors = refused(capsys, *arguments, *QUICK)
    assert code == 3
    assert message in errors
    assert errors.startswith("error: ")


def test_every_problem_of_a_scenario_file_has_its_line(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    path = tmp_path / "broken.yaml"
    path.write_text("format: marsupial-scenario\nversion: 1\nspeed: 3\n")
    log = tmp_path / "log.jsonl"
    code, errors = refused(capsys, str(path), *QUICK, "--log", str(log))
    assert code == 3
    lines = errors.splitlines()
    assert len(lines) > 2
    assert all(line.startswith(f"error: {path}: ") for line in lines)
    assert not log.exists()


def test_a_terminated_run_keeps_its_log_and_leaves_nothing_running(tmp_path: Path) -> None:
    log = tmp_path / "log.jsonl"
    command = [sys.executable, "-m", "marsupial.cli.main", "run", "lobby", "--planner", "aries", "--log", str(log)]
    with subprocess.Popen([*command, "--json"], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        while "1 plan so far" not in process.stderr.readline():
            assert process.poll() is None
        engines = [child.pid for child in psutil.Process(process.pid).children(recursive=True)]
        process.send_signal(signal.SIGINT)
        out, _ = process.communicate(timeout=HANG_S)
    assert process.returncode == 130
    assert json.loads(out)["status"] == "cancelled"
    ended = read_log(log).events[-1]
    assert ended.status is Status.CANCELLED
    assert engines
    assert not [pid for pid in engines if os.path.exists(f"/proc/{pid}")]


def test_routes_of_least_energy_are_asked_for_by_an_option(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    log = tmp_path / "lobby.jsonl"
    assert main(["run", "lobby", *QUICK, "--routes", "energy", "--log", str(log)]) == 0
    assert {str(kind.routes) for kind in started(read_log(log).events).types} == {"energy"}
    capsys.readouterr()
    assert main(["run", "lobby", *QUICK, "--routes", "scenic"]) == 2
    assert "--routes: must be shortest or energy, got 'scenic'" in capsys.readouterr().err


OPEN_YARD = "type octile\nheight 4\nwidth 7\nmap\n.......\n.......\n.......\n.......\n"


@pytest.mark.parametrize("command", [("run", "--steps", "1"), ("export", "-o", "OUT"), ("compare",)])
def test_all_commands_that_load_a_map_print_the_warnings_of_map_once(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, command: tuple[str, ...]
) -> None:
    path = tmp_path / "yard.map"
    path.write_text(OPEN_YARD)
    assert main(["map", str(path)]) == 0
    warned = [line for line in capsys.readouterr().err.splitlines() if line.startswith("warning: ")]
    assert len(warned) == 3
    name, *options = (str(tmp_path / "out") if word == "OUT" else word for word in command)
    if name == "compare":
        cases_of([str(path)], (1, 2), None, warn)
    else:
        main([name, str(path), *options])
    told = capsys.readouterr().err.splitlines()
    for line in warned:
        assert told.count(line.replace("warning: ", f"warning: {path}: ")) == 1
