from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import pytest

from marsupial.bench.suite.best import digest_of, known_best, read_best, write_best
from marsupial.bench.suite.catalogue import INSTANCES
from marsupial.cli.main import main
from marsupial.planning.checker import check

SMALL = ("--instance", "rooms-1x1-3", "--budget", "0.2")


def test_paths_are_timed_beside_references(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    rows_file = tmp_path / "rows.json"
    sizes = ("--size", "64", "--size", "96")
    assert main(["bench", "paths", *sizes, "--repeats", "1", "--json", str(rows_file)]) == 0
    shown = capsys.readouterr()
    assert "matrix" in shown.out
    assert " scipy " in shown.out
    assert "cave, 96 x 96 cells" in shown.err
    assert {row["size"] for row in json.loads(rows_file.read_text())} == {64, 96}


def test_map_work_is_timed_beside_that_from_scratch(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    rows_file = tmp_path / "rows.json"
    assert main(["bench", "analysis", "--size", "256", "--repeats", "1", "--json", str(rows_file)]) == 0
    assert "both come to the same" in capsys.readouterr().out
    assert [row["map"] for row in json.loads(rows_file.read_text())] == ["rooms", "cave"]


def test_missions_are_timed_by_scenario_and_strategy(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    rows_file = tmp_path / "rows.json"
    asked = ["lobby", "--strategy", "heuristic", "--strategy", "assignment", "--size", "256", "--json", str(rows_file)]
    assert main(["bench", "sim", *asked]) == 0
    shown = capsys.readouterr()
    assert "lobby by assignment" in shown.err
    assert "sensing and driving" in shown.out
    rows = json.loads(rows_file.read_text())
    assert [(row["kind"], row.get("strategy")) for row in rows] == [
        ("sight", None), ("mission", "heuristic"), ("mission", "assignment"),
    ]  # fmt: skip


@pytest.mark.parametrize(
    ("arguments", "code", "message"),
    [
        (["sim", "nowhere"], 3, "error: nowhere: neither a built-in scenario nor a file"),
        (["sim", "lobby", "--strategy", "none"], 2, "error: unknown strategy 'none'"),
        (["sim", "lobby", "--planner", "none"], 2, "error: unknown planner 'none'"),
        (["first-use", "demo"], 2, "error: no first use of 'demo' is measured"),
    ],
)
def test_what_cannot_be_timed_is_said(
    arguments: list[str], code: int, message: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["bench", *arguments]) == code
    assert capsys.readouterr().err.startswith(message)


def test_an_unknown_benchmark_is_named(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["bench", "speed"]) == 2
    assert "'speed'" in capsys.readouterr().err


def test_planners_are_compared_on_the_instances_asked_for(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    rows_file = tmp_path / "rows.json"
    assert main(["bench", "planners", "--engine", "greedy", *SMALL, "--json", str(rows_file)]) == 0
    shown = capsys.readouterr()
    assert "rooms-1x1-3: 1x1, 3 targets; best known" in shown.out
    assert "summary, up to 24 robots: 1 instances" in shown.out
    assert "rooms-1x1-3: greedy, 0.2 s:" in shown.err
    (row,) = json.loads(rows_file.read_text())
    assert (row["instance"], row["engine"], row["budget_s"], row["solved"]) == ("rooms-1x1-3", "greedy", 0.2, True)
    assert row["makespan_ms"] == row["improvements"][-1][1]


def test_a_file_of_best_plans_gets_what_it_lacks_and_loses_nothing(tmp_path: Path) -> None:
    file = tmp_path / "best.json"
    known = known_best()
    del known["rooms-1x1-3"]
    file.write_text(write_best(known))
    asked = ["bench", "planners", "--engine", "greedy", *SMALL, "--update", str(file)]
    assert main(asked) == 0
    assert read_best(file.read_text()) == known_best()
    assert main(asked) == 0
    assert read_best(file.read_text()) == known_best()


def test_worse_plans_in_a_file_are_replaced_and_false_ones_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "best.json"
    known = known_best()
    good = known["rooms-1x1-3"]
    asked = ["bench", "planners", "--engine", "greedy", *SMALL, "--update", str(file)]
    file.write_text(write_best({"rooms-1x1-3": replace(good, lower_bound_ms=0, bound_by="")}))
    assert main(asked) == 0
    assert read_best(file.read_text()) == known
    false = write_best({"rooms-1x1-3": replace(good, makespan_ms=good.makespan_ms - 1)})
    file.write_text(false)
    assert main(asked) == 6
    assert "which is not what is said of it" in capsys.readouterr().err
    assert file.read_text() == false


def test_a_new_file_of_best_plans_begins_with_those_known(tmp_path: Path) -> None:
    file = tmp_path / "best.json"
    assert main(["bench", "planners", "--engine", "greedy", *SMALL, "--update", str(file)]) == 0
    situation = INSTANCES["rooms-1x1-3"].situation()
    best = read_best(file.read_text())
    assert best.keys() == known_best().keys()
    assert best["rooms-1x1-3"].digest == digest_of(situation)
    assert check(situation, best["rooms-1x1-3"].read_plan(situation)).valid


@pytest.mark.parametrize(
    ("options", "code", "message"),
    [
        (["--instance", "nope*"], 2, "error: --instance: no instance matches 'nope*'"),
        (["--engine", "nope"], 2, "error: unknown planner 'nope'"),
        (["--engine", "greedy in parts"], 2, "error: unknown planner 'greedy in parts'"),
        (["--budget", "0"], 2, "error: --budget: must be positive, got 0"),
        (["--budget", "nan"], 2, "error: --budget: must be positive, got nan"),
    ],
)
def test_what_cannot_be_run_is_said(
    options: list[str], code: int, message: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["bench", "planners", *options]) == code
    assert capsys.readouterr().err.startswith(message)


@pytest.mark.parametrize("text", ["", "[]", "{}", '{"suite": 1, "best": {"x": 3}}', '{"suite": 0, "best": {}}'])
def test_a_file_that_holds_no_best_plans_is_left_alone(
    text: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "mine.json"
    file.write_text(text)
    assert main(["bench", "planners", "--engine", "greedy", *SMALL, "--update", str(file)]) == 3
    assert capsys.readouterr().err.startswith(f"error: {file}: ")
    assert file.read_text() == text
