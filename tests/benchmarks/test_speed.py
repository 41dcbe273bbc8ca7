"""The benches of speed: what both sides find is the same, and their commands print and write it."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import marsupial
from benchmarks.speed import analysis, first_use, paths, sim
from benchmarks.speed.attribution import CALLERS, REST, Callers, Function, Profile
from benchmarks.speed.drawn import MASKS
from benchmarks.speed.paths import C_BUCKETS, C_HEAP, SCIPY, grid_graph
from benchmarks.speed.reference import NotCompiled, compiled
from marsupial.errors import UsageError
from marsupial.generators.builtin import builtin_scenario
from marsupial.library.missions import simulate
from marsupial.model.planning import Budget

ROOT = Path(marsupial.__file__).parent
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


def test_without_a_compiler_c_is_left_out_with_the_reason(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(paths, "compiled", lambda name: NotCompiled("there is no compiler (cc)"))
    alone = paths.bench_paths(sizes=(64,), repeats=1, cells=3)
    assert {row.reference for row in alone.rows} == {SCIPY}
    assert paths.table(alone).splitlines()[-1] == "C is left out: there is no compiler (cc)"


def test_the_graph_of_scipy_has_no_step_that_cuts_a_corner() -> None:
    graph = grid_graph(np.array([[True, True], [True, False]])).toarray()
    assert graph.tolist() == [[0, 1, 1, 0], [1, 0, 0, 0], [1, 0, 0, 0], [0, 0, 0, 0]]


def test_map_work_that_is_kept_comes_to_the_same_as_from_scratch(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    file = tmp_path / "rows.json"
    assert analysis.main(["--size", "256", "--repeats", "1", "--json", str(file)]) == 0
    assert capsys.readouterr().out.count("both come to the same") == len(analysis.MAPS)
    for row in json.loads(file.read_text()):
        assert row["same"]
        assert sum(row["kept_parts"].values()) == pytest.approx(row["kept_s"])


def test_a_surveyor_that_missed_a_reveal_is_found_out() -> None:
    growing = analysis._Growing(analysis.generated("cave", 256, analysis.RESOLUTION_M, 1), 1)
    cells = growing.reveal()
    assert not growing.kept(cells[:0]).says_what(growing.scratch())


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


def test_views_that_differ_are_said_to() -> None:
    (row,) = sim.bench_sight(sizes=(256,), repeats=1, views=5)
    assert row.same
    told = sim.table([replace(row, same=False, reference_s=1.0), replace(row, reference_s=None)], [])
    assert "see DIFFERENT cells" in told


def test_a_command_is_used_once_and_then_again(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(first_use.COMMANDS, "scenarios", ("scenarios",))
    assert first_use.main(["scenarios", "--repeats", "1"]) == 0
    shown = capsys.readouterr()
    assert shown.out.splitlines()[-1].endswith("marsupial scenarios")
    assert shown.err == "scenarios, nothing kept\nscenarios, again\n"


def test_a_command_that_fails_is_told_with_what_it_says(tmp_path: Path) -> None:
    with pytest.raises(UsageError, match=r"marsupial plan .*situation\.json .*failed: error: .*situation\.json"):
        first_use.use(first_use.COMMANDS["plan"], tmp_path)
    with pytest.raises(UsageError, match="no first use of 'demo' is measured; there are run, plan"):
        first_use.main(["demo"])


def ours(module: str) -> Function:
    return str(ROOT.joinpath(*module.split(".")).with_suffix(".py")), 1, "work"


def entry(own_s: float, callers: Callers | None = None, calls: int = 1) -> tuple[int, int, float, float, Callers]:
    return calls, calls, own_s, own_s, callers or {}


def test_time_counts_for_the_part_of_a_module_or_of_those_who_called_it() -> None:
    def called(seconds: float) -> tuple[int, int, float, float]:
        return 1, 1, seconds, seconds

    library: Function = ("/elsewhere/numpy/lib.py", 1, "unique")
    stats = {
        ours("maps.survey"): entry(1.0),
        ours("sim.world"): entry(1.0),
        ours("maps.sight"): entry(4.0, {ours("sim.world"): called(3.0), ours("maps.survey"): called(1.0)}),
        library: entry(2.0, {ours("maps.sight"): called(2.0)}),
        ("/elsewhere/alone.py", 1, "alone"): entry(2.0),
    }
    shares = Profile(stats, {"maps": "analysis", "maps.sight": CALLERS, "sim": "sensing"}).shares(10.0)
    assert shares == pytest.approx({"sensing": 0.55, "analysis": 0.25, REST: 0.2})


def test_what_profiling_takes_for_each_call_is_taken_off() -> None:
    stats = {ours("sim.world"): entry(3.0, calls=10), ours("maps.survey"): entry(12.0, calls=90)}
    shares = Profile(stats, {"maps": "analysis", "sim": "sensing"}).shares(5.0)
    assert shares == pytest.approx({"sensing": 0.4, "analysis": 0.6, REST: 0.0})
