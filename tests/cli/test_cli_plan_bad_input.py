"""`marsupial plan` with files that make no sense: an exit code and a message, never a traceback."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from situations import in_flight, many_rooms, one_hall, out_of_reach, situation_of, two_rooms

from marsupial.cli.main import main
from marsupial.formats.situation import situation_to_json
from marsupial.model.situation import Situation, SituationGoal

PLAIN = ("--planner", "greedy", "--steps", "1")


def plan(tmp_path: Path, text: str, *options: str) -> int:
    path = tmp_path / "situation.json"
    path.write_text(text, encoding="utf-8")
    return main(["plan", str(path), *(options or PLAIN)])


def changed(path: tuple[str | int, ...], value: object) -> str:
    """Return the text of a situation with one field changed."""
    data = json.loads(situation_to_json(in_flight()))
    part: Any = data
    for key in path[:-1]:
        part = part[key]
    part[path[-1]] = value
    return json.dumps(data)


@pytest.mark.parametrize(
    ("path", "value", "said"),
    [
        (("robots",), {}, "robots: must be a list"),
        (("robots", 0, "type"), "lorry", "robots[0].type: unknown robot type 'lorry'"),
        (("robots", 1, "carrier"), "c9", "robots[1].carrier: r1 can't be carried by 'c9'"),
        (("robots", 0, "home"), "nowhere", "robots[0].home: unknown home 'nowhere'"),
        (("robots", 0, "name"), "r1", "name 'r1' is used twice"),
        (("robots", 0, "free_at_ms"), 10**30, "robots[0].free_at_ms: must be at most"),
        (("robots", 0, "free_at_ms"), True, "robots[0].free_at_ms: must be an integer, got true"),
        (("types", 0, "capacity"), -1, "types[0].capacity: must be 0 or more"),
        (("types", 0, "capacity"), 10**30, "types[0].capacity: must be at most"),
        (("types", 0, "capacity"), 0, "carries 1 rover, capacity 0"),
        (("types", 1, "dock_ms"), 0.5, "types[1].dock_ms: must be an integer, got 0.5"),
        (("targets", 0, "name"), "t2", "places"),
        (("targets", 0, "explorers"), ["lorry"], "targets[0].explorers: unknown robot type 'lorry'"),
        (("targets", 0, "reveal_m2"), float("nan"), "targets[0].reveal_m2: must be finite"),
        (("goal", "return_home"), 1, "goal.return_home: must be true or false"),
        (("travel_ms",), [], "travel_ms: must be a mapping"),
        (("travel_ms", "rover", 1, 2), float("nan"), "travel_ms.rover[1][2]: must be whole milliseconds"),
        (("travel_ms", "rover", 1, 2), 1.5, "travel_ms.rover[1][2]: must be whole milliseconds"),
        (("travel_ms", "rover", 1, 2), "1", "travel_ms.rover[1][2]: must be whole milliseconds"),
        (("travel_ms", "rover", 1, 2), -1, "travel_ms.rover[1][2]: must be whole milliseconds"),
        (("travel_ms", "rover", 1, 2), False, "travel_ms.rover[1][2]: must be whole milliseconds"),
        (("travel_ms", "rover", 1, 2), 10**30, "travel_ms.rover[1][2]: must be whole milliseconds"),
        (("travel_ms", "rover"), [[0]], "travel_ms.rover: must be a list of 6 rows"),
        (("travel_ms", "lorry"), [], "travel_ms.lorry: unknown field"),
    ],
)
def test_a_wrong_field_is_named(
    path: tuple[str | int, ...], value: object, said: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert plan(tmp_path, changed(path, value)) == 3
    captured = capsys.readouterr()
    assert said in captured.err
    assert captured.out == ""
    assert "Traceback" not in captured.err


def test_robots_of_one_name_and_of_unknown_types_are_named(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    data = json.loads(changed(("robots", 2, "name"), "c1"))
    data["robots"][2]["type"] = "lorry"
    assert plan(tmp_path, json.dumps(data)) == 3
    assert "robots[2].type: unknown robot type 'lorry'" in capsys.readouterr().err


@pytest.mark.parametrize("text", ["", "nonsense", "[]", '{"types": []', '{"types": [], "types": []}', "[" * 10_000])
def test_what_is_no_situation_is_refused(text: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert plan(tmp_path, text) == 3
    assert "situation.json" in capsys.readouterr().err


@pytest.mark.parametrize("planner", ["greedy", "anytime", "auto"])
def test_a_goal_out_of_reach_is_proven_and_the_target_named(
    planner: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert plan(tmp_path, situation_to_json(out_of_reach()), "--planner", planner, "--steps", "2") == 4
    assert "t2" in capsys.readouterr().err


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
