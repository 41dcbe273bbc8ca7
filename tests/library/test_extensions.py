"""Strategies and engines of installed packages are available by name like our own."""

import json
from collections.abc import Mapping
from pathlib import Path

import pytest
from support.planning.situations import one_hall

import marsupial
from marsupial.cli.main import main
from marsupial.errors import EngineUnavailable, UsageError
from marsupial.model.planning import Budget
from marsupial.planning.engines import ENGINES, engine, engine_infos, mission_engine
from marsupial.planning.names import engine_names
from marsupial.strategies.registry import STRATEGIES, asks_planner, strategy, strategy_names

CODE = '''
from marsupial import Decision, EngineInfo, Finished, Improved, Outcome, StrategyInfo
from marsupial.planning.greedy import Greedy, serve


class Plain:
    """A strategy that asks no planner."""

    name = "plain"
    info = StrategyInfo(
        name="plain", summary="lists what can be done", parameters={"patience": 3.0}, source="Nobody 2020"
    )

    def decide(self, briefing):
        return Decision(plan=serve(briefing.situation, briefing.previous)[0])


class Asking:
    """A strategy that asks one."""

    asks_planner = True
    name = "asking"

    def __init__(self, engine, budget):
        self.engine, self.budget = engine, budget

    def decide(self, briefing):
        events = list(self.engine.solve(briefing.situation, self.budget))
        plans = [event.plan for event in events if isinstance(event, Improved)]
        return Decision(plan=plans[-1] if plans else serve(briefing.situation)[0])


class Copy(Greedy):
    """An engine."""

    info = EngineInfo(name="copy", summary="list scheduling once more", licence="MIT", deterministic_steps=True)


class Half:
    """Neither."""

    info = "none"


def fails():
    raise RuntimeError("out of order")
'''


def install(folder: Path, name: str, groups: Mapping[str, Mapping[str, str]], code: str = CODE) -> Path:
    """Write a package `name` with these entry points to `folder`, which must then be on `sys.path`."""
    info = folder / f"{name}-1.0.dist-info"
    info.mkdir(parents=True)
    (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {name}\nVersion: 1.0\n")
    lines = [
        line for group, names in groups.items() for line in (f"[{group}]", *(f"{k} = {v}" for k, v in names.items()))
    ]
    (info / "entry_points.txt").write_text("\n".join(lines) + "\n")
    (folder / f"{name}.py").write_text(code)
    return folder


STEP = Budget(steps=1)


@pytest.fixture(autouse=True)
def _package(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    groups = {
        "marsupial.strategies": {
            "plain": "others:Plain", "asking": "others:Asking", "gone": "others:Gone", "failing": "others:fails",
            "heuristic": "others:Plain",
        },
        "marsupial.engines": {
            "copy": "others:Copy", "lost": "nowhere_at_all:Engine", "half": "others:Half", "failing": "others:fails",
            "greedy": "others:Copy",
        },
    }  # fmt: skip
    monkeypatch.syspath_prepend(install(tmp_path / "site", "others", groups))


def test_names_are_listed_after_ours_without_those_that_are_taken() -> None:
    assert strategy_names() == (*STRATEGIES, "asking", "failing", "gone", "plain")
    assert engine_names() == (*sorted(ENGINES), "copy", "failing", "half", "lost")


def test_an_engine_is_found_by_its_name() -> None:
    assert engine("copy").info.licence == "MIT"
    assert mission_engine("copy", STEP).info.deterministic_steps


def test_our_own_engine_keeps_its_name() -> None:
    assert type(engine("greedy")).__module__.startswith("marsupial.")


def test_unusable_engines_give_the_reason_and_break_no_other() -> None:
    missing = {info.name: info.missing for info in engine_infos()}
    assert missing["copy"] is None
    assert missing["lost"] == "can't be loaded from others: ModuleNotFoundError: No module named 'nowhere_at_all'"
    assert "no engine" in str(missing["half"])
    assert missing["failing"] == "can't be made: RuntimeError: out of order"
    assert missing["greedy (others)"] == "others can't take this name: it is one of marsupial's own"
    with pytest.raises(EngineUnavailable, match="planner lost: can't be loaded from others"):
        mission_engine("lost", STEP)
    with pytest.raises(EngineUnavailable, match="out of order"):
        next(iter(engine("failing").solve(one_hall(), STEP)))


def test_a_name_given_by_two_packages_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    other = {"marsupial.engines": {"copy": "more:Copy"}}
    monkeypatch.syspath_prepend(install(tmp_path / "more", "more", other))
    with pytest.raises(EngineUnavailable, match="named more than once, by more and others"):
        mission_engine("copy", STEP)


def test_strategies_are_made_with_a_planner_if_they_ask_one() -> None:
    assert (asks_planner("plain"), asks_planner("asking"), asks_planner("nobody")) == (False, True, False)
    assert strategy("plain", planner="none", budget=STEP).name == "plain"
    made = strategy("asking", planner="copy", budget=STEP)
    assert made.engine.info.name == "copy"  # type: ignore[attr-defined]


@pytest.mark.parametrize(
    ("name", "reason"),
    [
        ("gone", "strategy gone: can't be loaded from others: AttributeError"),
        ("failing", "strategy failing of others can't be made: RuntimeError: out of order"),
    ],
)
def test_an_unusable_strategy_gives_the_reason(name: str, reason: str) -> None:
    with pytest.raises(EngineUnavailable, match=reason):
        strategy(name, planner="greedy", budget=STEP)


def test_an_unknown_name_gets_the_list_of_all() -> None:
    with pytest.raises(UsageError, match=r"unknown strategy 'nope'; there are .*plain"):
        strategy("nope", planner="greedy", budget=STEP)
    with pytest.raises(UsageError, match=r"unknown planner 'nope'; there are .*copy"):
        engine("nope")


def test_python_and_the_command_line_know_them(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    result = marsupial.explore("lobby", strategy="asking", planner="copy", steps=1, log=tmp_path / "python.jsonl")
    assert (result.status, result.strategy, result.planner) == ("complete", "asking", "copy")
    command = ["run", "lobby", "--strategy", "asking", "--planner", "copy", "--steps", "1"]
    assert main([*command, "--log", str(tmp_path / "shell.jsonl")]) == 0
    assert (tmp_path / "python.jsonl").read_bytes() == (tmp_path / "shell.jsonl").read_bytes()
    assert main(["run", "lobby", "--strategy", "gone", "--steps", "1"]) == 2
    assert "strategy gone: can't be loaded from others" in capsys.readouterr().err


def test_the_command_line_lists_planners_that_are_there_and_those_that_are_not(
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert main(["planners", "--json"]) == 0
    listed = {entry["name"]: entry for entry in json.loads(capsys.readouterr().out)}
    assert listed["copy"]["available"] is True
    assert listed["lost"]["available"] is False


def test_a_comparison_has_them_beside_ours(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    contenders = "plain,temporal:copy,heuristic"
    out = tmp_path / "out"
    command = ["compare", "lobby", "--strategies", contenders, "--runs", "1", "--steps", "1", "--workers", "1"]
    assert main([*command, "--out", str(out)]) == 0
    lines = (out / "rows.csv").read_text().splitlines()
    assert [line.split(",")[1:3] for line in lines[1:]] == [
        ["plain", "none"],
        ["temporal", "copy"],
        ["heuristic", "none"],
    ]
    assert all(",complete," in line for line in lines[1:])


def test_the_service_offers_them(tmp_path: Path) -> None:
    from marsupial_service.planners import planner_infos

    infos = {info.name: info for info in planner_infos({})}
    assert infos["copy"].missing is None
    assert infos["half"].missing is not None
    with pytest.raises(UsageError, match="the name of another planner"):
        planner_infos({"copy": "cmd:plan {domain} {problem}"})


def test_strategies_are_listed_with_their_own_info_and_unusable_ones_with_the_reason(
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert main(["strategies", "--json"]) == 0
    listed = {entry["name"]: entry for entry in json.loads(capsys.readouterr().out)}
    plain = {key: listed["plain"][key] for key in ("summary", "team", "parameters", "source", "available")}
    assert plain == {
        "summary": "lists what can be done", "team": "any", "parameters": {"patience": 3}, "source": "Nobody 2020",
        "available": True,
    }  # fmt: skip
    assert (listed["asking"]["asks_planner"], listed["asking"]["summary"]) == (True, "A strategy that asks one.")
    assert listed["gone"]["missing"].startswith("can't be loaded from others: AttributeError")
    assert listed["heuristic (others)"]["available"] is False
    assert main(["strategies"]) == 0
    assert "not available: can't be loaded" in " ".join(capsys.readouterr().out.split())
