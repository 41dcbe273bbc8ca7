"""Situations as JSON."""

import json
from dataclasses import replace
from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings
from support.planning.odd_situations import odd_situations
from support.planning.situations import SOLVABLE, in_flight, one_hall, one_room, seat_taken

from marsupial.errors import SituationError
from marsupial.formats.situation import situation_from_json, situation_to_json
from marsupial.model.situation import Situation, TargetInfo


def changed(path: tuple[str | int, ...], value: object) -> str:
    """Return the text of a situation with one field changed."""
    data = json.loads(situation_to_json(in_flight()))
    part: Any = data
    for key in path[:-1]:
        part = part[key]
    part[path[-1]] = value
    return json.dumps(data)


def fault_of(text: str) -> str:
    with pytest.raises(SituationError) as caught:
        situation_from_json(text)
    return str(caught.value)


@pytest.mark.parametrize("name", SOLVABLE)
def test_a_situation_reads_back_as_the_same(name: str) -> None:
    situation = SOLVABLE[name]()
    assert situation_from_json(situation_to_json(situation)) == situation


@given(odd_situations())
@settings(suppress_health_check=[HealthCheck.too_slow, HealthCheck.data_too_large])
def test_odd_situations_read_back_too(situation: Situation) -> None:
    assert situation_from_json(situation_to_json(situation)) == situation


def test_no_path_is_null_and_rows_go_by_place() -> None:
    data = json.loads(situation_to_json(one_room()))
    assert data["places"] == ["c1_start", "t1", "m1", "home"]
    assert data["travel_ms"]["carrier"][0] == [0, None, 10_000, 0]
    assert data["robots"][1] == {"name": "r1", "type": "rover", "carrier": "c1", "free_at_ms": 0}


def test_zero_and_false_fields_may_be_omitted() -> None:
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
    wrong = {"types[0].role", "robots[0].free_at_ms", "robots[1]", "targets[0].explorers[0]", "meetings", "colour"}
    wrong |= {"travel_ms.carrier[0][1]", "travel_ms.rover[2]"}
    assert wrong <= {problem.path for problem in caught.value.problems}


@pytest.mark.parametrize(
    ("path", "value", "said"),
    [
        (("format",), "nav2", "format: must be "),
        (("version",), 2, "version: must be 1"),
        (("places",), ["c1_start"], "places: "),
        (("robots",), {}, "robots: must be a list"),
        (("robots",), [7], "robots[0]: "),
        (("robots", 0, "type"), "lorry", "robots[0].type: unknown robot type 'lorry'"),
        (("robots", 1, "carrier"), "c9", "robots[1].carrier: r1 can't be carried by 'c9'"),
        (("robots", 0, "home"), "nowhere", "robots[0].home: unknown home 'nowhere'"),
        (("robots", 0, "name"), "r1", "name 'r1' is used twice"),
        (("robots", 0, "free_at_ms"), 10**30, "robots[0].free_at_ms: must be at most"),
        (("robots", 0, "free_at_ms"), True, "robots[0].free_at_ms: must be an integer, got true"),
        (("types", 0, "capacity"), -1, "types[0].capacity: must be 0 or more"),
        (("types", 0, "capacity"), 10**30, "types[0].capacity: must be at most"),
        (("types", 0, "capacity"), 0, "carries 1 rover, type 'carrier' has capacity 0"),
        (("types", 1, "dock_ms"), 10**13, "types[1].dock_ms: must be at most"),
        (("types", 1, "dock_ms"), 0.5, "types[1].dock_ms: must be an integer, got 0.5"),
        (("targets",), None, "targets: "),
        (("targets", 0, "name"), "t2", "places"),
        (("targets", 0, "name"), "t\ud800", "targets[0].name: "),
        (("targets", 0, "explorers"), ["lorry"], "targets[0].explorers: unknown robot type 'lorry'"),
        (("targets", 0, "reveal_m2"), -1, "targets[0].reveal_m2: "),
        (("targets", 0, "reveal_m2"), float("nan"), "targets[0].reveal_m2: must be finite"),
        (("goal", "return_home"), 1, "goal.return_home: must be true or false"),
        (("travel_ms",), [], "travel_ms: must be a mapping"),
        (("travel_ms", "rover"), [[0]], "travel_ms.rover: must be a list of 6 rows"),
        (("travel_ms", "lorry"), [], "travel_ms.lorry: unknown field"),
    ],
)
def test_a_wrong_field_is_named(path: tuple[str | int, ...], value: object, said: str) -> None:
    assert said in fault_of(changed(path, value))


@pytest.mark.parametrize("value", [float("nan"), 1.5, "1", -1, False, 10**30])
def test_a_travel_time_that_is_no_whole_number_of_milliseconds_is_named(value: object) -> None:
    said = fault_of(changed(("travel_ms", "rover", 1, 2), value))
    assert "travel_ms.rover[1][2]: must be whole milliseconds" in said


def test_robots_of_one_name_and_of_unknown_types_are_named() -> None:
    data = json.loads(changed(("robots", 2, "name"), "c1"))
    data["robots"][2]["type"] = "lorry"
    assert "robots[2].type: unknown robot type 'lorry'" in fault_of(json.dumps(data))


@pytest.mark.parametrize("text", ["", "{", "[1]", "7", "{" * 3, '{"a": 1}}', "[" * 100_000, '{"b": 2, "b": 3}'])
def test_text_that_is_no_json_mapping_or_gives_a_field_twice_is_refused(text: str) -> None:
    with pytest.raises(SituationError, match="'b' is given twice" if '"b"' in text else None):
        situation_from_json(text)


def test_a_number_that_json_cannot_hold_is_refused() -> None:
    target = TargetInfo(name="t1", explorers=frozenset({"carrier"}), reveal_m2=float("nan"))
    situation = one_hall()
    with pytest.raises(SituationError, match="reveal_m2"):
        situation_to_json(replace(situation, targets=(target, *situation.targets[1:])))


def test_seats_are_a_mapping_and_left_out_where_there_are_none() -> None:
    types = json.loads(situation_to_json(seat_taken()))["types"]
    assert types[0]["seats"] == {"rover": 1, "climber": 1}
    assert [kind.get("seats_as") for kind in types] == [None, None, None, "rover", None]
    assert all(not {"seats", "seats_as"} & kind.keys() for kind in json.loads(situation_to_json(one_room()))["types"])


def test_a_carrier_carries_as_many_as_it_has_seats_if_no_capacity_is_given() -> None:
    data = json.loads(situation_to_json(seat_taken()))
    data["types"][0] |= {"seats": {"rover": 2, "climber": 1}}
    del data["types"][0]["capacity"]
    assert situation_from_json(json.dumps(data)).type_by_name["carrier"].capacity == 3


@pytest.mark.parametrize(
    ("seats", "said"),
    [
        ({}, "types[0].seats: must name a rover type"),
        ([], "types[0].seats: must be a mapping of fields"),
        ({"rover": 0.5}, "types[0].seats.rover: must be an integer, got 0.5"),
        ({"rovr": 1}, "types[0].seats.rovr: unknown robot type 'rovr'"),
        ({"climber": 2}, "robots[0]: c1 carries 1 rover of type 'rover', type 'carrier' has no seat for them"),
    ],
)
def test_wrong_seats_are_named(seats: object, said: str) -> None:
    data = json.loads(situation_to_json(seat_taken()))
    data["types"][0]["seats"] = seats
    with pytest.raises(SituationError) as caught:
        situation_from_json(json.dumps(data))
    assert said in str(caught.value)
