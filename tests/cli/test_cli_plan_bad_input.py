"""`marsupial plan` with invalid files: an exit code and a message, never a traceback."""

import json
from dataclasses import replace
from pathlib import Path

import pytest
from support.planning.situations import in_flight, many_rooms, one_hall, out_of_reach, two_rooms
from support.planning.spots import situation_of

from marsupial.cli.main import main
from marsupial.formats.situation import situation_to_json
from marsupial.model.situation import Situation, SituationGoal

PLAIN = ("--planner", "greedy", "--steps", "1")


def plan(tmp_path: Path, text: str, *options: str) -> int:
    path = tmp_path / "situation.json"
    path.write_text(text, encoding="utf-8")
    return main(["plan", str(path), *(options or PLAIN)])


@pytest.mark.parametrize("planner", ["greedy", "anytime", "auto"])
def test_a_goal_out_of_reach_is_proven_and_the_target_named(
    planner: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert plan(tmp_path, situation_to_json(out_of_reach()), "--planner", planner, "--steps", "2") == 4
    captured = capsys.readouterr()
    assert captured.out == ""
    assert f"{planner}: unsolvable" in captured.err
    assert "t2" in captured.err


def test_rovers_that_no_carrier_has_places_for_are_proven_not_to_come_aboard(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    situation = replace(in_flight(), goal=SituationGoal(recover_rovers=True))
    assert plan(tmp_path, situation_to_json(situation)) == 4
    assert "no place aboard for r2: no carrier with places can get there" in capsys.readouterr().err


def test_a_carrier_that_gets_stuck_is_no_plan(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    data = json.loads(situation_to_json(two_rooms()))
    first, second = (data["places"].index(name) for name in ("m1", "m2"))
    data["travel_ms"]["carrier"][first][second] = data["travel_ms"]["carrier"][second][first] = None
    assert plan(tmp_path, json.dumps(data)) == 5
    assert "found no way to t" in capsys.readouterr().err


@pytest.mark.parametrize(
    "situation", [situation_of([], {}, {}, {}), one_hall().restricted(targets=frozenset()), many_rooms(2, 1, 100, 5)]
)
def test_no_robots_no_targets_or_many_are_planned_for(situation: Situation, tmp_path: Path) -> None:
    assert plan(tmp_path, situation_to_json(situation)) == 0
