"""Invalid scenario files: every message in full, all errors of a file at once, and no input breaks the reader."""

from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from PIL import Image
from yard import GOOD, changed, faults, stored

from marsupial.errors import ScenarioError
from marsupial.formats.scenario import read_scenario

BROKEN: list[tuple[Any, ...]] = [
    ({"robot_types__1__speed_mps": -1}, "robot_types[1].speed_mps: must be positive, got -1"),
    ({"robot_types__0__radius_m": -0.5}, "robot_types[0].radius_m: must be 0 or more, got -0.5"),
    (
        {
            "map__resolution_m": 0.001,
            "robot_types__0__radius_m": 5.0,
            "team__0__start": "drawn",
            "team__2__start": "drawn",
        },
        "robot_types[0].radius_m: must be at most 200 cells of the map, got 5000 cells of 0.001 m",
    ),
    ({"robot_types__0__speed_mps": 1e-9}, "robot_types[0].speed_mps: must be 0.001 or more, got 1e-09"),
    ({"robot_types__0__speed_mps": True}, "robot_types[0].speed_mps: must be a number, got true"),
    ({"robot_types__0__speed_mps": "fast"}, "robot_types[0].speed_mps: must be a number, got 'fast'"),
    ({"robot_types__0__sensor_range_m": float("nan")}, "robot_types[0].sensor_range_m: must be finite, got nan"),
    ({"robot_types__1__dock_s": float("inf")}, "robot_types[1].dock_s: must be finite, got inf"),
    (
        {
            "robot_types__0__energy": {"stop_j": -1, "turn_j": [0, 1]},
            "robot_types__1__energy": {"turn_j": [0, 1, -2, 3]},
        },
        "robot_types[0].energy.turn_j: must be a list of 4 numbers, got [0, 1]",
        "robot_types[0].energy.stop_j: must be 0 or more, got -1",
        "robot_types[1].energy.turn_j[2]: must be 0 or more, got -2",
    ),
    ({"robot_types__0__routes": "scenic"}, "robot_types[0].routes: must be shortest or energy, got 'scenic'"),
    (
        {"robot_types__1__routes": "energy", "robot_types__1__energy": {"stop_j": 1.0}},
        "robot_types[1].routes: no way takes less energy than another: driving takes none (energy.metre_j, "
        "energy.drive_w)",
    ),
    ({"robot_types__0__capacity": 1.5}, "robot_types[0].capacity: must be an integer, got 1.5"),
    ({"robot_types__0__capacity": True}, "robot_types[0].capacity: must be an integer, got true"),
    (
        {"robot_types__1__undock_s": ..., "robot_types__0__capacity": ..., "format": ...},
        "format: missing",
        "robot_types[0].capacity: missing",
        "robot_types[1].undock_s: missing",
    ),
    ({"map": ..., "robot_types": ..., "team": ...}, "map: missing", "robot_types: missing", "team: missing"),
    (
        {"robot_types__0__speed_mps": ..., "robot_types__0__speed_mp": 1.0},
        "robot_types[0].speed_mps: missing",
        "robot_types[0].speed_mp: unknown field, did you mean 'speed_mps'?; the fields here are name, role, "
        "speed_mps, sensor_range_m, radius_m, terrains, energy, diagonal, routes, battery, sensor_angle_deg, "
        "capacity, seats",
    ),
    (
        {"colour": "red", "weight": 3},
        "colour: unknown field",
        "weight: unknown field; the fields here are format, version, name, terrains, map, chargers, robot_types, team, "
        "start_seed, goal, limits, planning_time, interference, faults, zones",
    ),
    (
        {
            "terrains": [{"name": "mud", "deep": 1}],
            "robot_types__1__energy": {"fuel": 1},
            "robot_types__1__colour": "red",
            "team__1__colour": "red",
            "limits": {"money": 1},
            "map__colour": "red",
        },
        "terrains[0].deep: unknown field; the fields here are name, code, blocks_sight",
        "map.colour: unknown field; the fields here are rows, resolution_m, origin_m, legend, mask, keepout, speed",
        "robot_types[1].energy.fuel: unknown field; the fields here are turn_j, idle_w, drive_w, metre_j, stop_j",
        "robot_types[1].colour: unknown field; the fields here are name, role, speed_mps, sensor_range_m, "
        "radius_m, terrains, energy, diagonal, routes, battery, sensor_angle_deg, dock_s, undock_s, radio_range_m",
        "team[1].colour: unknown field; the fields here are name, type, carrier",
        "limits.money: unknown field; the fields here are time_s, coverage",
    ),
    (
        {"robot_types__0__dock_s": 1, "robot_types__1__capacity": 1},
        "robot_types[0].dock_s: only rovers have it",
        "robot_types[1].capacity: only carriers have it",
    ),
    ({"robot_types__1__role": "kangaroo"}, "robot_types[1].role: must be carrier or rover, got 'kangaroo'"),
    (
        {"robot_types__1__name": "Carrier"},
        "robot_types[1].name: 'Carrier' is used twice",
        "team[1].type: unknown robot type 'rover'",
        "team[2].type: unknown robot type 'rover'",
    ),
    ({"robot_types": []}, "robot_types: must not be empty"),
    ({"robot_types": {"a": 1}}, "robot_types: must be a list, got {'a': 1}"),
    ({"robot_types": ["carrier"]}, "robot_types[0]: must be a mapping of fields, got 'carrier'"),
    (
        {"robot_types__0__terrains": ["flor", 3], "robot_types__1__terrains": ["obstacle", "lava"]},
        "robot_types[0].terrains[1]: must be a text, got 3",
        "robot_types[1].terrains[0]: no robot can drive on obstacles",
        "robot_types[1].terrains[1]: unknown terrain 'lava'",
    ),
    (
        {"robot_types__0__terrains": ["flor"]},
        "robot_types[0].terrains[0]: unknown terrain 'flor', did you mean 'floor'?",
    ),
    ({"robot_types__0__terrains": []}, "robot_types[0].terrains: must be a list of texts, got []"),
    (
        {
            "terrains": [
                {"name": "floor"},
                {"name": "mud", "code": 2},
                {"name": "ice", "code": 255},
                {"name": "sand", "code": 7, "blocks_sight": 1},
                {"name": "snow", "code": 7},
            ]
        },
        "terrains[0].name: 'floor' is used twice",
        "terrains[1].code: must be 3 or more, got 2",
        "terrains[2].code: must be at most 254, got 255",
        "terrains[3].blocks_sight: must be true or false, got 1",
        "terrains[4].code: 7 is used twice",
    ),
    (
        {"team__2__name": "s_joey"},
        "team[2].name: 's_joey' looks like a place: names must not begin with 's_', 't_', 'm_', 'h_' or 'charge_'",
    ),
    ({"team__2__name": "Joey"}, "team[2].name: 'Joey' is used twice"),
    (
        {"team__2__name": "jill b"},
        "team[2].name: must be a letter followed by letters, digits, '_' or '-', got 'jill b'",
    ),
    ({"team__2__type": "rovr"}, "team[2].type: unknown robot type 'rovr', did you mean 'rover'?"),
    ({"team__1__carrier": "ana"}, "team[1].carrier: unknown carrier 'ana', did you mean 'anna'?"),
    ({"team__1__carrier": "jill"}, "team[1].carrier: 'jill' is a rover and can't carry"),
    (
        {"team__0": {"name": "anna", "type": "carrier", "carrier": "anna"}},
        "team[0].carrier: 'anna' is a carrier and can't be carried",
    ),
    ({"robot_types__0__seats": {"rover": 0}}, "team[1].carrier: type 'rover' does not fit on type 'carrier'"),
    (
        {"robot_types__0__seats": {"rovr": 1}},
        "robot_types[0].seats.rovr: unknown robot type 'rovr', did you mean 'rover'?",
        "team[1].carrier: type 'rover' does not fit on type 'carrier'",
    ),
    (
        {"robot_types__0__seats": {"carrier": 1, "rover": 2}},
        "robot_types[0].seats.carrier: 'carrier' is a carrier, not a rover",
    ),
    ({"robot_types__0__seats": {"rover": -1}}, "robot_types[0].seats.rover: must be 0 or more, got -1"),
    ({"robot_types__0__seats": {"rover": 1.5}}, "robot_types[0].seats.rover: must be an integer, got 1.5"),
    ({"robot_types__0__seats": {}}, "robot_types[0].seats: must name a rover type; leave it out if all fit"),
    ({"robot_types__0__seats": 3}, "robot_types[0].seats: must be a mapping of fields, got 3"),
    ({"robot_types__1__seats": {"rover": 1}}, "robot_types[1].seats: only carriers have it"),
    (
        {"robot_types__0__seats": {"rover": 1}, "team": {"carriers": 1, "rovers_per_carrier": 2}},
        "team.rovers_per_carrier: each carrier carries 2 rovers of type 'rover', type 'carrier' has 1 seat for them",
    ),
    (
        {"robot_types__0__seats": {"rover": 1}, "team__2": {"name": "jill", "type": "rover", "carrier": "anna"}},
        "team[0]: carries 2 rovers of type 'rover', type 'carrier' has 1 seat for them",
    ),
    ({"robot_types__0__capacity": 0}, "team[0]: carries 1 rover, type 'carrier' has capacity 0"),
    ({"team__1__start": [1.5, 1.5]}, "team[1].start: give 'start' or 'carrier', not both"),
    ({"team__2__start": ...}, "team[2].start: missing: needs [x, y] in metres, 'drawn', or a 'carrier'"),
    (
        {"team__0__start": [1, 2, 3], "team__2__start": [True, 1]},
        "team[0].start: must be a list of 2 numbers, got [1, 2, 3]; a comma separates numbers: write 2.5, not 2,5",
        "team[2].start[0]: must be a number, got true",
    ),
    ({"team__2__start": [-0.5, 2]}, "team[2].start: [-0.5, 2] is outside the map"),
    ({"team__2__start": [0.5, 0.5]}, "team[2].start: a rover can't stand at [0.5, 0.5]: the cell is obstacle"),
    ({"team__0__start": [5.5, 2.5]}, "team[0].start: a carrier can't stand at [5.5, 2.5]: the cell is rough"),
    (
        {"robot_types__0__radius_m": 1.1, "team__0__start": [1.5, 2.5]},
        "team[0].start: a carrier can't stand at [1.5, 2.5]: its radius of 1.1 m does not fit there",
    ),
    ({"team": [{"name": "jill", "type": "rover", "start": [6.5, 1.5]}]}, "team: needs at least one carrier"),
    ({"team": []}, "team: needs at least one carrier"),
    ({"team": 3}, "team: must be a list of robots, or a mapping with 'carriers' and 'rovers_per_carrier'"),
    (
        {"team": {"carriers": 0, "rovers_per_carrier": -1}},
        "team.carriers: must be 1 or more, got 0",
        "team.rovers_per_carrier: must be 0 or more, got -1",
    ),
    ({"team": {"carriers": 10**9, "rovers_per_carrier": 1}}, "team.carriers: must be at most 1000, got 1000000000"),
    (
        {"team": {"carriers": 501, "rovers_per_carrier": 1}},
        "team.carriers: a team has at most 1000 robots with all rovers, this one 1002",
    ),
    ({"team": [{}] * 1001}, "team: a team has at most 1000 robots with all rovers, this one 1001"),
    (
        {"team": {"carriers": 1, "rovers_per_carrier": 3}},
        "team.rovers_per_carrier: 3 for each carrier, but type 'carrier' has capacity 2",
    ),
    (
        {"team": {"carriers": 1, "rovers_per_carrier": 1, "carrier_type": "rover", "rover_type": "rver"}},
        "team.carrier_type: 'rover' is a rover, not a carrier",
        "team.rover_type: unknown robot type 'rver', did you mean 'rover'?",
    ),
    ({"version": 2, "fuel": 3, "team": 0}, "version: must be at most 1, got 2: the file is for a later marsupial"),
    ({"format": "marsupial-log"}, "format: must be marsupial-scenario, got 'marsupial-log'"),
    (
        {"map": {"fil": "a.map"}},
        "map: needs one of file, generator, rows, got none",
        "map.fil: unknown field, did you mean 'file'?; the fields here are file, generator, rows, mask, keepout, "
        "speed, width_m, height_m, resolution_m, seed, origin_m, legend",
    ),
    ({"map__file": "a.map"}, "map: needs one of file, generator, rows, got file and rows"),
    (
        {"map__rows": ["####", "#x#", "#??#"]},
        "map.rows[1]: has 3 characters, the first row has 4",
        "map.rows[1]: unknown character 'x' at column 1",
    ),
    ({"map__rows": [""]}, "map.rows[0]: is empty"),
    (
        {"map__resolution_m": 0, "map__origin_m": [0, 0]},
        "map.resolution_m: must be positive, got 0",
        "map.origin_m: must be a list of 3 numbers, got [0, 0]",
    ),
    (
        {"map__legend": {"mm": "rough", "#": "floor", "r": "rouch"}},
        "map.legend.mm: must be a text of one character, none of # . ~ ?",
        "map.legend.#: must be a text of one character, none of # . ~ ?",
        "map.legend.r: unknown terrain 'rouch', did you mean 'rough'?",
    ),
    (
        {"map": {"generator": "ofice", "width_m": 60, "height_m": 36}},
        "map.generator: unknown generator 'ofice', did you mean 'office'?",
    ),
    (
        {"map": {"generator": "random", "width_m": 60, "height_m": 3, "share": 0.9, "depth": 1}},
        "map.share: must be 0 to 0.35, got 0.9",
        "map.depth: unknown field; the fields here are generator, width_m, height_m, resolution_m, seed, share, "
        "mask, keepout, speed",
    ),
    (
        {"map": {"generator": "office", "width_m": 6, "height_m": 3}},
        "map.width_m: must be 30 to 500, got 6.0",
        "map.height_m: must be 24 to 500, got 3.0",
    ),
    (
        {
            "goal": {"recover_rovers": "yes", "come_home": True, "least_ground": -1},
            "limits": {"time_s": 0},
            "planning_time": "never",
        },
        "goal.recover_rovers: must be true or false, got 'yes'",
        "goal.come_home: unknown field, did you mean 'return_home'?; the fields here are recover_rovers, return_home, "
        "least_ground",
        "goal.least_ground: must be 0 or more, got -1",
        "limits.time_s: must be positive, got 0",
        "planning_time: must be instant or charged, got 'never'",
    ),
    ({"limits": {"time_s": 1e9}}, "limits.time_s: must be at most 10000000, got 1000000000.0"),
    ({"start_seed": -1}, "start_seed: must be 0 or more, got -1"),
    ({"name": 12}, "name: must be a text, got 12"),
]
"""Changes of the valid scenario, and the errors of each."""


@pytest.mark.parametrize(("changes", "expected"), [(case[0], case[1:]) for case in BROKEN])
def test_a_broken_scenario_is_reported_with_its_exact_errors(
    tmp_path: Path, changes: dict[str, Any], expected: tuple[str, ...]
) -> None:
    assert sorted(faults(tmp_path, changed(**changes))) == sorted(expected)


def test_all_problems_of_a_file_come_at_once(tmp_path: Path) -> None:
    data = changed(
        name=3, map__resolution_m="1", robot_types__1__speed_mps=-1, team__0__name=None, goal=[], planning_time=1
    )
    assert faults(tmp_path, data) == [
        "name: must be a text, got 3",
        "map.resolution_m: must be a number, got '1'",
        "robot_types[1].speed_mps: must be positive, got -1",
        "team[0].name: must be a text, got nothing",
        "team[1].carrier: unknown carrier 'anna'",
        "goal: must be a mapping of fields, got []",
        "planning_time: must be a text, got 1",
    ]


def test_the_message_names_file_and_line(tmp_path: Path) -> None:
    with pytest.raises(ScenarioError) as caught:
        read_scenario(stored(tmp_path, changed(robot_types__1__speed_mps=-1)))
    assert str(caught.value) == f"{tmp_path}/yard.yaml: line 22: robot_types[1].speed_mps: must be positive, got -1"


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "must be a mapping of fields, got nothing"),
        ("- 1\n", "must be a mapping of fields, got [1]"),
        ("just words\n", "must be a mapping of fields, got 'just words'"),
        ("format: marsupial-scenario\nname: a\nname: b\n", "line 3, column 1: field 'name' is given twice"),
        ("map:\n\tfile: a.yaml\n", "line 2, column 1: a tab can't stand here: YAML is indented by spaces"),
        ("map: {\n", "line 2, column 1: did not find expected node content"),
        ("map: !!python/object/apply:os.getcwd []\n", "line 1, column 6: could not determine a constructor"),
        ("version: " + "9" * 5000, "line 1, column 10: can't be read (Exceeds the limit"),
        ("a\0b", "line 1: unacceptable character #x0000"),
    ],
)
def test_invalid_yaml_is_reported_with_its_place(tmp_path: Path, text: str, message: str) -> None:
    (only,) = faults(tmp_path, text)
    assert only.startswith(message)


def test_a_file_that_is_not_text_is_reported(tmp_path: Path) -> None:
    (tmp_path / "yard.yaml").write_bytes(b"\xe9t\xe9 2026")
    with pytest.raises(ScenarioError, match="is not UTF-8 text"):
        read_scenario(tmp_path / "yard.yaml")


def test_deep_nesting_is_an_error_and_no_crash(tmp_path: Path) -> None:
    for text in ("[" * 100_000, "{a: " * 100_000, "- " * 100_000):
        assert faults(tmp_path, text) == ["lists and mappings are nested more than 20 levels deep"]


def test_aliases_that_multiply_are_refused(tmp_path: Path) -> None:
    layers = [f"x{i}: &x{i} [{', '.join([f'*x{i - 1}'] * 9)}]" for i in range(1, 15)]
    text = "\n".join(["x0: &x0 [lol]", *layers, "format: *x14"])
    assert faults(tmp_path, text) == ["aliases repeat more than 100000 values"]


def test_a_missing_map_and_mask_are_reported_with_their_fields(tmp_path: Path) -> None:
    (only,) = faults(tmp_path, changed(map={"file": "gone.map"}))
    assert only == f"map.file: {tmp_path}/gone.map: no such file"
    data = changed(map__mask={"file": "gone.png", "greys": {"floor": 255, "lava": 3, "rough": 256}})
    assert faults(tmp_path, data)[:2] == [
        "map.mask.greys.lava: unknown terrain 'lava'",
        "map.mask.greys.rough: must be a grey from 0 to 255 or a list of them, got 256",
    ]


def test_the_scale_of_a_map_that_has_one_is_its_own(tmp_path: Path) -> None:
    (only,) = faults(tmp_path, changed(map={"file": "depot.yaml", "resolution_m": 0.1}))
    assert only == "map.resolution_m: a nav2 map has its own: 'resolution' in its yaml"
    (only,) = faults(tmp_path, changed(map={"file": "arena.map", "resolution_m": 0}))
    assert only.startswith("map.resolution_m: must be positive")


def test_a_mask_of_another_size_is_reported(tmp_path: Path) -> None:
    Image.new("L", (3, 3), 255).save(tmp_path / "mask.png")
    (only,) = faults(tmp_path, changed(map__mask={"file": "mask.png", "greys": {"floor": 255}}))
    assert only.startswith("map.mask: ")
    assert only.endswith("must be that of the map, 8 x 5, got 3 x 3")


def test_one_grey_can_not_be_two_terrains(tmp_path: Path) -> None:
    data = changed(map__mask={"file": "mask.png", "greys": {"floor": [1, 2], "rough": 2}})
    assert "map.mask.greys.rough: grey 2 is given to two terrains" in faults(tmp_path, data)


_JUNK = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=5),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=5), inner, max_size=3),
    max_leaves=5,
)
_PATHS = sorted(
    ["version", "format", "map", "robot_types", "team", "map__rows", "map__resolution_m", "team__0", "team__1__carrier"]
    + [f"robot_types__{i}__{key}" for i in (0, 1) for key in GOOD["robot_types"][i]]
    + ["goal", "limits", "terrains", "start_seed", "planning_time", "map__mask", "map__legend", "map__origin_m"]
)


@given(path=st.sampled_from(_PATHS), junk=_JUNK)
def test_junk_in_any_field_is_refused_or_read_but_never_breaks_the_reader(
    path: str, junk: Any, tmp_path_factory: pytest.TempPathFactory
) -> None:
    file = stored(tmp_path_factory.getbasetemp(), changed(**{path: junk}))
    try:
        read_scenario(file)
    except ScenarioError:
        return
