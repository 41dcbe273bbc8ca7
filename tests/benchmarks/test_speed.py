"""The speed benchmarks: both sides find the same, and the commands print and write their results."""

import json
from pathlib import Path

import pytest

from benchmarks.speed import analysis, first_use, paths, sim
from benchmarks.speed.drawn import MASKS
from benchmarks.speed.paths import C_BUCKETS, C_HEAP, SCIPY
from benchmarks.speed.reference import NotCompiled, compiled
from marsupial.generators.builtin import builtin_scenario
from marsupial.library.missions import simulate
from marsupial.model.planning import Budget

PLAIN = () if isinstance(compiled("dijkstra"), NotCompiled) else (C_HEAP, C_BUCKETS)


def test_all_sides_find_the_same_paths(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    file = tmp_path / "rows.json"
    assert paths.main(["--size", "64", "--size", "96", "--repeats", "1", "--json", str(file)]) == 0
    rows = json.loads(file.read_text())
    assert {(row["size"], row["map"]) for row in rows} == {(size, name) for size in (64, 96) for name in MASKS}
    assert {row["reference"] for row in rows} == {*PLAIN, SCIPY}
    assert max(row["difference"] for row in rows) < 1e-9
    shown = capsys.readouterr()
    assert "per state" in shown.out
    assert "cave, 96 x 96 cells" in shown.err


def test_map_work_that_is_kept_comes_to_the_same_as_from_scratch(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    file = tmp_path / "rows.json"
    assert analysis.main(["--size", "256", "--repeats", "1", "--json", str(file)]) == 0
    assert capsys.readouterr().out.count("both come to the same") == len(analysis.MAPS)
    for row in json.loads(file.read_text()):
        assert row["same"]
        assert sum(row["kept_parts"].values()) == pytest.approx(row["kept_s"])


def test_missions_are_those_that_are_simulated_without_the_bench(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    file = tmp_path / "rows.json"
    asked = ["lobby", "--strategy", "heuristic", "--strategy", "temporal", "--planner", "greedy", "--steps", "2"]
    assert sim.main([*asked, "--size", "256", "--repeats", "1", "--json", str(file)]) == 0
    assert "lobby by heuristic" in capsys.readouterr().err
    sight, heuristic, temporal = json.loads(file.read_text())
    assert sight["same"]
    assert (heuristic["planner"], temporal["planner"]) == ("none", "greedy")
    plain = simulate(builtin_scenario("lobby"), strategy="temporal", planner="greedy", budget=Budget(steps=2), seed=1)
    assert (temporal["simulated_s"], temporal["replans"]) == (plain.mission_time_s, plain.replans)
    assert sum(temporal["parts"].values()) == pytest.approx(temporal["cpu_s"])


def test_a_command_is_used_once_and_then_again(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(first_use.COMMANDS, "scenarios", ("scenarios",))
    assert first_use.main(["scenarios", "--repeats", "1"]) == 0
    shown = capsys.readouterr()
    assert shown.out.splitlines()[-1].endswith("marsupial scenarios")
    assert shown.err == "scenarios, nothing kept\nscenarios, again\n"
