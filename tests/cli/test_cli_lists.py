from __future__ import annotations

import json
from dataclasses import replace

import pytest

from marsupial.cli.main import main
from marsupial.generators.builtin import SCENARIOS
from marsupial.planning.engines import ENGINES, engine_infos
from marsupial.strategies.clairvoyant import CLAIRVOYANT
from marsupial.strategies.registry import STRATEGIES


def test_every_built_in_scenario_is_listed(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["scenarios"]) == 0
    out = capsys.readouterr().out
    assert all(name in out for name in SCENARIOS)


def test_scenarios_as_json(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["scenarios", "--json"]) == 0
    assert [entry["name"] for entry in json.loads(capsys.readouterr().out)] == list(SCENARIOS)


def test_every_engine_is_listed_with_its_licence(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["planners"]) == 0
    out = capsys.readouterr().out
    for info in engine_infos():
        assert info.name in out
        assert info.licence in out
    assert "priced arrival" in out


def test_planners_as_json(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["planners", "--json"]) == 0
    listed = {entry["name"]: entry for entry in json.loads(capsys.readouterr().out)}
    assert listed.keys() == ENGINES.keys()
    assert listed["greedy"]["available"] is True
    assert listed["greedy"]["deterministic_steps"] is True
    assert listed["greedy"]["objectives"] == ["makespan"]
    assert listed["auto"]["objectives"] == ["makespan", "priced arrival"]


def test_an_engine_that_is_missing_says_why(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    infos = tuple(replace(info, missing="needs a left hand") for info in engine_infos())
    monkeypatch.setattr("marsupial.planning.engines.engine_infos", lambda: infos)
    assert main(["planners"]) == 0
    assert "no: needs a left hand" in capsys.readouterr().out


def test_every_strategy_is_listed_with_its_team_parameters_and_source(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["strategies"]) == 0
    told = capsys.readouterr().out
    for name in (*STRATEGIES, CLAIRVOYANT):
        assert f" {name} " in told
    assert "W_n (2), W_p (2), W_c (1)" in told
    assert "one carrier without rovers" in told
    assert "Wurm et al. 2010" in told


def test_strategies_as_json(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["strategies", "--json"]) == 0
    listed = {entry["name"]: entry for entry in json.loads(capsys.readouterr().out)}
    assert list(listed) == [*STRATEGIES, CLAIRVOYANT]
    assert listed["bidding"]["parameters"] == {"W_n": 2, "W_p": 2, "W_c": 1}
    assert listed["covering"]["parameters"] == {"rounds": 4, "seconds": None}
    assert (listed["temporal"]["asks_planner"], listed["temporal"]["available"]) == (True, True)
