"""Situations as JSON."""

from __future__ import annotations

import json
from dataclasses import replace

import pytest
from hypothesis import HealthCheck, given, settings
from odd_situations import odd_situations
from situations import SOLVABLE, in_flight, one_hall, one_room

from marsupial.errors import SituationError
from marsupial.formats.situation import situation_from_json, situation_to_json
from marsupial.model.situation import Situation, TargetInfo


@pytest.mark.parametrize("name", SOLVABLE)
def test_a_situation_reads_back_as_the_same(name: str) -> None:
    situation = SOLVABLE[name]()
    assert situation_from_json(situation_to_json(situation)) == situation


@given(odd_situations())
@settings(deadline=None, max_examples=60, suppress_health_check=[HealthCheck.too_slow, HealthCheck.data_too_large])
def test_odd_situations_read_back_too(situation: Situation) -> None:
    assert situation_from_json(situation_to_json(situation)) == situation


def test_no_path_is_null_and_rows_go_by_place() -> None:
    data = json.loads(situation_to_json(one_room()))
    assert data["places"] == ["c1_start", "t1", "m1", "home"]
    assert data["travel_ms"]["carrier"][0] == [0, None, 10_000, 0]
    assert data["robots"][1] == {"name": "r1", "type": "rover", "carrier": "c1", "free_at_ms": 0}


def test_what_is_zero_or_false_may_be_left_out() -> None:
    data = json.loads(situation_to_json(one_hall()))
    for key in ("format", "version", "homes", "goal", "places"):
        del data[key]
    del data["robots"][0]["free_at_ms"]
    del data["types"][0]["dock_ms"]
    assert situation_from_json(json.dumps(data)) == one_hall()


def test_all_problems_are_reported_at_once_with_their_paths() -> None:
    data = json.loads(situation_to_json(in_flight()))
    data["types"][0]["role"] = "lorry"
    data["robots"][0]["free_at_ms"] = -1
    data["robots"][1]["place"] = "here"
    data["targets"][0]["explorers"] = [1]
    data["meetings"] = "m1"
    data["colour"] = "red"
    data["travel_ms"]["carrier"][0][1] = 1.5
    data["travel_ms"]["rover"][2] = []
    with pytest.raises(SituationError) as caught:
        situation_from_json(json.dumps(data))
    paths = [problem.path for problem in caught.value.problems]
    for path in (
        "types[0].role",
        "robots[0].free_at_ms",
        "robots[1]",
        "targets[0].explorers[0]",
        "meetings",
        "colour",
        "travel_ms.carrier[0][1]",
        "travel_ms.rover[2]",
    ):
        assert path in paths, (path, str(caught.value))


@pytest.mark.parametrize(
    ("key", "value", "path"),
    [
        ("format", "nav2", "format"),
        ("version", 2, "version"),
        ("places", ["c1_start"], "places"),
        ("travel_ms", {"carrier": [[0]]}, "travel_ms.carrier"),
        ("robots", [{"name": "c1", "type": "lorry", "place": "c1_start"}], "robots[0].type"),
        ("robots", [7], "robots[0]"),
        ("targets", None, "targets"),
        ("targets", [{"name": "t1", "explorers": [], "reveal_m2": -1}], "targets[0].reveal_m2"),
        ("targets", [{"name": "t\ud800", "explorers": []}], "targets[0].name"),
        ("types", [{"name": "carrier", "role": "carrier", "capacity": 10**30}], "types[0].capacity"),
        ("types", [{"name": "carrier", "role": "carrier", "dock_ms": 10**13}], "types[0].dock_ms"),
    ],
)
def test_a_wrong_field_is_named(key: str, value: object, path: str) -> None:
    data = json.loads(situation_to_json(one_hall()))
    data[key] = value
    with pytest.raises(SituationError) as caught:
        situation_from_json(json.dumps(data))
    assert path in [problem.path for problem in caught.value.problems], str(caught.value)


@pytest.mark.parametrize("text", ["", "{", "[1]", "7", "{" * 3, '{"a": 1}}', "[" * 100_000])
def test_text_that_is_no_json_mapping_is_refused(text: str) -> None:
    with pytest.raises(SituationError):
        situation_from_json(text)


def test_a_field_given_twice_is_refused() -> None:
    with pytest.raises(SituationError, match="'b' is given twice"):
        situation_from_json('{"a": 1, "b": 2, "b": 3}')


def test_a_number_that_json_cannot_hold_is_refused() -> None:
    target = TargetInfo(name="t1", explorers=frozenset({"carrier"}), reveal_m2=float("nan"))
    situation = one_hall()
    with pytest.raises(SituationError, match="reveal_m2"):
        situation_to_json(replace(situation, targets=(target, *situation.targets[1:])))
