import json
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import pytest

from marsupial.cli.main import main
from marsupial.generators.builtin import SCENARIOS
from marsupial.planning.engines import ENGINES, engine_infos
from marsupial.strategies.clairvoyant import CLAIRVOYANT
from marsupial.strategies.registry import STRATEGIES


def test_a_missing_engine_gives_the_reason(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    infos = tuple(replace(info, missing="needs a left hand") for info in engine_infos())
    monkeypatch.setattr("marsupial.planning.engines.engine_infos", lambda: infos)
    assert main(["planners"]) == 0
    assert "no: needs a left hand" in capsys.readouterr().out


@pytest.fixture
def listed(capsys: pytest.CaptureFixture[str]) -> Callable[[str], tuple[str, dict[str, Any]]]:
    """The list of a command: as text, and as JSON by name."""

    def lists(command: str) -> tuple[str, dict[str, Any]]:
        assert main([command]) == 0
        text = capsys.readouterr().out
        assert main([command, "--json"]) == 0
        return text, {entry["name"]: entry for entry in json.loads(capsys.readouterr().out)}

    return lists


def test_every_built_in_scenario_is_listed(listed: Callable[[str], tuple[str, dict[str, Any]]]) -> None:
    text, entries = listed("scenarios")
    assert list(entries) == list(SCENARIOS)
    assert all(name in text for name in SCENARIOS)


def test_every_engine_is_listed_with_its_licence_and_objectives(
    listed: Callable[[str], tuple[str, dict[str, Any]]],
) -> None:
    text, entries = listed("planners")
    assert entries.keys() == ENGINES.keys()
    assert all(info.name in text and info.licence in text for info in engine_infos())
    assert (entries["greedy"]["available"], entries["greedy"]["deterministic_steps"]) == (True, True)
    assert [entries[name]["objectives"] for name in ("greedy", "auto")] == [
        ["makespan"],
        ["makespan", "priced arrival"],
    ]


def test_every_strategy_is_listed_with_its_team_parameters_and_source(
    listed: Callable[[str], tuple[str, dict[str, Any]]],
) -> None:
    text, entries = listed("strategies")
    assert list(entries) == [*STRATEGIES, CLAIRVOYANT]
    assert all(
        words in text for words in ("W_n (2), W_p (2), W_c (1)", "one carrier without rovers", "Wurm et al. 2010")
    )
    assert entries["bidding"]["parameters"] == {"W_n": 2, "W_p": 2, "W_c": 1}
    assert entries["covering"]["parameters"] == {"rounds": 4, "seconds": None}
    assert (entries["temporal"]["asks_planner"], entries["temporal"]["available"]) == (True, True)
