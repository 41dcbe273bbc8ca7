"""A strategy in a file is run and compared without a package."""

import json
import pickle
from pathlib import Path

import pytest

from marsupial.bench.compare.folder import read_rows
from marsupial.cli.main import main
from marsupial.errors import InputError, UsageError
from marsupial.model.planning import NO_PLANNER, Budget
from marsupial.strategies.files import StrategyFile, strategy_file
from marsupial.strategies.registry import asks_planner, is_strategy, strategy

CODE = """
from dataclasses import dataclass

from marsupial import Decision, Strategy
from marsupial.planning.greedy import serve


@dataclass
class Plain(Strategy):
    name: str = "plain"

    def decide(self, briefing):
        return Decision(plan=serve(briefing.situation, briefing.previous)[0])


class Asking(Plain):
    asks_planner = True

    def __init__(self, engine, budget):
        super().__init__()
        self.engine = engine


class Faulty(Plain):
    def decide(self, briefing):
        return briefing.nothing


class Undecided(Strategy):
    name = "undecided"


class Nothing:
    pass


class Unmade(Plain):
    def __init__(self, file):
        pass


LIMIT = 3
"""
STEP = Budget(steps=1)
QUICK = ("--steps", "1", "--runs", "1", "--carriers", "1", "--rovers", "1", "--workers", "1")


@pytest.fixture(autouse=True)
def _folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("rules.py").write_text(CODE)


def the(text: str) -> tuple[StrategyFile, str | None]:
    found = strategy_file(text)
    assert found is not None
    return found


def test_a_text_names_a_class_in_a_file_and_perhaps_a_planner() -> None:
    assert strategy_file("temporal:greedy") is None
    found, planner = the("rules.py:Asking:greedy")
    assert (found.name, planner) == ("rules.py:Asking", "greedy")
    assert asks_planner(found)
    assert strategy(found, planner="greedy", budget=STEP).engine.info.name == "greedy"  # type: ignore[attr-defined]


def test_the_code_that_was_read_is_what_another_process_runs() -> None:
    found, _ = the("rules.py:Plain")
    Path("rules.py").unlink()
    there = pickle.loads(pickle.dumps(found))
    assert there.digest == found.digest
    assert strategy(there, planner=NO_PLANNER, budget=STEP).name == "plain"


def test_a_name_alone_never_runs_a_file() -> None:
    assert not is_strategy("rules.py:Plain")
    with pytest.raises(UsageError, match="unknown strategy"):
        strategy("rules.py:Plain", planner=NO_PLANNER, budget=STEP)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("rules.py", "rules.py: needs the name of a class behind it, as in rules.py:MyStrategy"),
        ("rules.py:", "rules.py: needs the name of a class behind it, as in rules.py:MyStrategy"),
        ("gone.py:Plain", "gone.py: no such file"),
        ("rules.py:plain", "rules.py: unknown class 'plain'"),
        ("rules.py:LIMIT", "rules.py: LIMIT is no class, it is of type int"),
        ("cut.py:Plain", "cut.py: line 2: SyntaxError"),
        ("lost.py:Plain", "lost.py: line 1: ModuleNotFoundError: No module named 'nowhere_at_all'"),
        ("empty.py:Plain", "empty.py: has no classes"),
    ],
)
def test_what_names_no_class_is_refused(text: str, message: str) -> None:
    Path("cut.py").write_text("\ndef f(:\n")
    Path("lost.py").write_text("import nowhere_at_all\n")
    Path("empty.py").write_text("")
    with pytest.raises((InputError, UsageError)) as caught:
        strategy_file(text)
    assert str(caught.value).startswith(message)


@pytest.mark.parametrize(
    ("arguments", "code", "message"),
    [
        (("--strategy", "rules.py:Undecided"), 2, "strategy rules.py:Undecided: Undecided has no decide of its own"),
        (("--strategy", "rules.py:Nothing"), 2, "strategy rules.py:Nothing: Nothing has no name and no decide"),
        (("--strategy", "rules.py:Unmade"), 2, "strategy rules.py:Unmade of rules.py can't be made: TypeError"),
        (("--strategy", "rules.py:Faulty"), 3, "rules.py: line 26: AttributeError: 'Briefing' object has no"),
        (("--strategy", "rules.py:Plain:greedy"), 2, "name its planner with --planner greedy"),
        (("--strategy", "rules.py:Plain", "--server", "http://127.0.0.1:9"), 2, "does not run the strategies of your"),
    ],
)
def test_run_says_what_a_strategy_lacks(
    capsys: pytest.CaptureFixture[str], arguments: tuple[str, ...], code: int, message: str
) -> None:
    assert main(["run", "lobby", *arguments]) == code
    assert message in capsys.readouterr().err


def test_run_takes_one(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["run", "lobby", "--strategy", "rules.py:Asking", "--planner", "greedy", "--steps", "1", "--json"]) == 0
    summary = json.loads(capsys.readouterr().out)
    assert (summary["strategy"], summary["planner"]) == ("rules.py:Asking", "greedy")


def test_a_comparison_takes_one_and_is_not_resumed_once_its_file_changed(capsys: pytest.CaptureFixture[str]) -> None:
    command = ["compare", "lobby", "--strategies", "rules.py:Plain,rules.py:Asking:greedy,heuristic", *QUICK]
    assert main([*command, "--out", "out"]) == 0
    rows = {str(row.trial.contender): row.status for row in read_rows(Path("out"))}
    assert rows == dict.fromkeys(("rules.py:Plain", "rules.py:Asking (greedy)", "heuristic"), "complete")
    assert len(list(Path("out/replays").iterdir())) == 2
    capsys.readouterr()
    assert main([*command, "--out", "out"]) == 0
    assert "3 of them done before" in capsys.readouterr().err
    Path("rules.py").write_text(CODE + "\n# another\n")
    assert main([*command, "--out", "out"]) == 2
    changed = "files: changed since the folder was begun: rules.py:Plain, rules.py:Asking"
    assert changed in capsys.readouterr().err


def test_a_planner_is_refused_for_one_that_asks_none(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["compare", "lobby", "--strategies", "rules.py:Plain:greedy", "--out", "out"]) == 2
    assert "rules.py:Plain asks no planner, so it can't have 'greedy'" in capsys.readouterr().err
