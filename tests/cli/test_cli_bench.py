import json
import sys
from dataclasses import replace
from pathlib import Path

import pytest

from marsupial.bench.suite.best import known_best, read_best, write_best
from marsupial.cli.main import main

SMALL = ("--instance", "rooms-1x1-3", "--budget", "0.2")


def test_in_a_checkout_paths_and_missions_are_timed(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    rows_file = tmp_path / "rows.json"
    assert main(["bench", "paths", "--size", "64", "--repeats", "1", "-q", "--json", str(rows_file)]) == 0
    assert " scipy " in capsys.readouterr().out
    assert {row["size"] for row in json.loads(rows_file.read_text())} == {64}
    assert main(["bench", "sim", "nowhere"]) == 3
    assert capsys.readouterr().err.startswith("error: nowhere: neither a built-in scenario nor a file")


def test_without_a_checkout_a_message_names_the_benchmarks(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "benchmarks.speed.paths", None)
    assert main(["bench", "paths"]) == 2
    assert capsys.readouterr().err == "error: bench paths: only in a checkout, as `python -m benchmarks paths`\n"


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
def test_unusable_engines_and_instances_are_reported(
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
