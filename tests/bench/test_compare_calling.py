"""`marsupial.compare`: a comparison in one line of Python."""

import csv
import sys
from collections.abc import Sequence
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import marsupial
from marsupial import Briefing, Decision, Strategy
from marsupial.bench.compare.calling import ComparisonResult
from marsupial.cli.main import main
from marsupial.planning.greedy import serve


class Plain(Strategy):
    """Follows list scheduling, and counts its decisions."""

    def __init__(self, name: str = "plain") -> None:
        self.name = name
        self.decisions = 0

    def decide(self, briefing: Briefing) -> Decision:
        self.decisions += 1
        if self.name == "faulty":
            raise ValueError("out of order")
        return Decision(plan=serve(briefing.situation, briefing.previous)[0])


def compare(strategies: Sequence[Any], scenarios: Any = "lobby", **more: Any) -> ComparisonResult:
    options = {"carriers": 1, "rovers": 1, "runs": 2, "steps": 1, "workers": 0} | more
    return marsupial.compare(scenarios, strategies, **options)


@pytest.fixture(scope="module")
def compared() -> ComparisonResult:
    return compare([Plain(), Plain("faulty"), "temporal:greedy"], rovers=(0, 1))


def test_rows_are_those_of_the_command(compared: ComparisonResult, tmp_path: Path) -> None:
    command = ["compare", "lobby", "--strategies", "temporal:greedy", "--carriers", "1", "--rovers", "0-1"]
    assert main([*command, "--runs", "2", "--steps", "1", "--workers", "1", "--out", str(tmp_path)]) == 0
    with (tmp_path / "rows.csv").open() as file:
        rows = list(csv.DictReader(file))
    ours = [row for row in compared.rows if row["strategy"] == "temporal"]
    assert [{key: "" if value is None else str(value) for key, value in row.items()} for row in ours] == rows


def test_every_mission_gets_a_copy_of_a_strategy_that_is_an_object() -> None:
    own = Plain()
    assert compare([own]).rows[0]["replans"] > 0
    assert own.decisions == 0


def test_printed_it_tells_who_explores_sooner_and_what_failed(compared: ComparisonResult) -> None:
    text = str(compared)
    assert "temporal (greedy)" in text.splitlines()[0]
    assert "scenario  team  strategy" in text
    assert "4 missions not complete, the first: lobby 1x0, faulty, seed 1: error: ValueError: out of order" in text


def test_a_table_has_a_line_for_each_strategy_on_each_case(compared: ComparisonResult) -> None:
    lines = compared.table("distance_m").splitlines()
    assert lines[0].split("  ")[-1].strip() == "less with temporal (greedy), %"
    assert [line.split()[:3] for line in lines[1:4]] == [
        ["lobby", "1x0", "plain"], ["lobby", "1x0", "faulty"], ["lobby", "1x0", "temporal"],
    ]  # fmt: skip
    assert len({len(line) for line in lines if line.endswith("–")}) == 1
    with pytest.raises(marsupial.MarsupialError, match="unknown metric 'qualty', did you mean 'quality'"):
        compared.table("qualty")


def test_latex_has_the_same_cells_with_its_signs_escaped(compared: ComparisonResult) -> None:
    lines = compared.latex("quality").splitlines()
    assert lines[0].startswith("% Exploration quality Q")
    assert lines[1] == r"\begin{tabular}{lllrr}"
    assert lines[3].endswith(r"m\textsuperscript{2}/m & more with temporal (greedy), \% \\")
    rows = [line for line in lines if line.startswith("lobby")]
    assert len(rows) == 6
    assert all(row.count("&") == 4 for row in rows)
    assert r"--" in rows[1]


def test_the_figure_is_one_of_matplotlib(compared: ComparisonResult, tmp_path: Path) -> None:
    compared.plot().savefig(tmp_path / "figure.png")
    with pytest.raises(marsupial.MarsupialError, match="nothing to plot"):
        compare(["heuristic"], runs=1).plot()


def test_a_frame_needs_pandas(compared: ComparisonResult, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "pandas", None)
    with pytest.raises(marsupial.MarsupialError, match="pip install pandas"):
        compared.frame()
    monkeypatch.setitem(sys.modules, "pandas", SimpleNamespace(DataFrame=lambda rows: rows))
    assert compared.frame() == list(compared.rows)


def test_named_strategies_run_in_processes_beside_objects_in_this_one() -> None:
    told: list[str] = []
    result = compare([Plain(), "heuristic"], runs=1, workers=1, progress=told.append)
    assert [row["strategy"] for row in result.rows] == ["plain", "heuristic"]
    assert told == ["1 of 2: lobby 1x1, heuristic, seed 1: complete", "2 of 2: lobby 1x1, plain, seed 1: complete"]


def test_scenarios_of_one_name_are_told_apart() -> None:
    lobby = marsupial.scenario("lobby")
    result = compare(["heuristic"], [lobby, "lobby", lobby], runs=1)
    assert [row["scenario"] for row in result.rows] == ["lobby", "lobby (3)"]


def test_scenarios_may_be_arrays() -> None:
    yard = np.pad(np.ones((40, 60), dtype=np.uint8), 1)
    result = compare(["heuristic"], [yard, yard], runs=1, resolution_m=0.1)
    assert [row["scenario"] for row in result.rows] == ["array", "array (2)"]
    assert result.table().splitlines()[0].endswith("Exploration time, s")


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"strategies": "temporal"}, "strategies: must be a list of names and strategies, got 'temporal'"),
        ({"strategies": [Plain]}, "strategy: must be an object, not the class Plain"),
        ({"strategies": [3]}, "strategy: int has no name and no decide"),
        ({"strategies": []}, "strategies: needs at least one"),
        ({"strategies": [Plain("temporal")]}, "'temporal' is the name of a strategy that marsupial knows"),
        ({"strategies": ["heuristic", "heuristic"]}, "heuristic is named twice"),
        ({"strategies": [Plain(), Plain()]}, "plain is named twice"),
        ({"strategies": ["temporl"]}, "did you mean 'temporal'"),
        ({"strategies": ["temporal"], "scenarios": 3}, "scenarios: must be a list of scenarios, got 3"),
        ({"strategies": ["temporal"], "scenarios": []}, "scenarios: needs at least one"),
        ({"strategies": ["temporal"], "scenarios": ["nowhere"]}, "neither a built-in scenario nor a file"),
        ({"strategies": ["temporal"], "runs": 0}, "runs: must be 1 or more, got 0"),
        ({"strategies": ["temporal"], "carriers": "1-3"}, "carriers: must be a whole number, got '1-3'"),
        ({"strategies": ["bidding"]}, "rovers"),
    ],
)
def test_an_argument_that_cannot_be_used_is_named(arguments: dict[str, Any], message: str) -> None:
    with pytest.raises(marsupial.MarsupialError, match=message):
        compare(**arguments)
