"""Scenario files: what is read, what is refused and in which words, and that writing loses nothing."""

from __future__ import annotations

import copy
import json
import os
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from hypothesis import given, settings
from hypothesis import strategies as st
from PIL import Image

from marsupial.errors import ScenarioError
from marsupial.formats.scenario import is_scenario_file, read_scenario, scenario_text, with_team, write_scenario
from marsupial.maps.builtin import SCENARIOS, bare_map_scenario, builtin_scenario
from marsupial.maps.generators import GENERATORS
from marsupial.model.grid import FLOOR, OBSTACLE, ROUGH, TERRAINS, UNKNOWN, Cell, Grid, Terrain
from marsupial.model.robots import EnergyModel, Role, TeamMember
from marsupial.model.scenario import Goal, Limits, PlanningTime, Scenario

DOCS = Path(__file__).resolve().parents[2] / "docs" / "scenario-format.md"

GOOD: dict[str, Any] = {
    "format": "marsupial-scenario",
    "version": 1,
    "map": {
        "resolution_m": 1.0,
        "rows": [
            "########",
            "#....~~#",
            "#....~~#",
            "#....~~#",
            "########",
        ],
    },
    "robot_types": [
        {
            "name": "carrier",
            "role": "carrier",
            "speed_mps": 1.0,
            "sensor_range_m": 10.0,
            "radius_m": 0.5,
            "terrains": ["floor"],
            "capacity": 2,
        },
        {
            "name": "rover",
            "role": "rover",
            "speed_mps": 0.5,
            "sensor_range_m": 5.0,
            "radius_m": 0.1,
            "terrains": ["floor", "rough"],
            "dock_s": 10.0,
            "undock_s": 5.0,
        },
    ],
    "team": [
        {"name": "anna", "type": "carrier", "start": [2.5, 2.5]},
        {"name": "joey", "type": "rover", "carrier": "anna"},
        {"name": "jill", "type": "rover", "start": [6.5, 1.5]},
    ],
}


def changed(**changes: Any) -> dict[str, Any]:
    """The good scenario with some fields replaced: ``team__1__type="x"`` replaces team[1].type, `...` removes it."""
    data = copy.deepcopy(GOOD)
    for path, value in changes.items():
        *parents, last = [int(key) if key.isdigit() else key for key in path.split("__")]
        place: Any = data
        for key in parents:
            place = place[key]
        if value is ...:
            del place[last]
        else:
            place[last] = value
    return data


def stored(folder: Path, data: object) -> Path:
    path = folder / "yard.yaml"
    path.write_text(data if isinstance(data, str) else yaml.safe_dump(data, sort_keys=False), encoding="utf-8")
    return path


def faults(folder: Path, data: object) -> list[str]:
    with pytest.raises(ScenarioError) as caught:
        read_scenario(stored(folder, data))
    assert caught.value.source == str(folder / "yard.yaml")
    return [str(problem) for problem in caught.value.problems]


def assert_same(a: Scenario, b: Scenario) -> None:
    assert replace(a, grid=b.grid) == b
    assert a.grid.cells.tolist() == b.grid.cells.tolist()
    assert (a.grid.resolution_m, a.grid.origin_m) == (b.grid.resolution_m, b.grid.origin_m)
    assert a.grid.terrains == b.grid.terrains


# --- what is read ---------------------------------------------------------------------------------------------------


def test_every_field_is_read_in_the_units_of_the_model(tmp_path: Path) -> None:
    data = changed(
        name="my yard",
        start_seed=7,
        goal={"recover_rovers": False, "return_home": True},
        limits={"time_s": 90.5},
        planning_time="charged",
        robot_types__0__energy={"idle_w": 20, "drive_w": 60.5},
    )
    scenario = read_scenario(stored(tmp_path, data))
    carrier, rover = scenario.robot_types
    assert scenario.name == "my yard"
    assert scenario.grid.cells[1].tolist() == [0, FLOOR, FLOOR, FLOOR, FLOOR, ROUGH, ROUGH, 0]
    assert (carrier.role, carrier.capacity, carrier.terrains) == (Role.CARRIER, 2, {FLOOR})
    assert carrier.energy == EnergyModel(idle_w=20.0, drive_w=60.5)
    assert (rover.role, rover.dock_ms, rover.undock_ms) == (Role.ROVER, 10_000, 5_000)
    assert (rover.speed_mps, rover.sensor_range_m, rover.radius_m) == (0.5, 5.0, 0.1)
    assert scenario.team == (
        TeamMember(name="anna", type="carrier", start=Cell(2, 2)),
        TeamMember(name="joey", type="rover", carrier="anna"),
        TeamMember(name="jill", type="rover", start=Cell(6, 1)),
    )
    assert scenario.goal == Goal(recover_rovers=False, return_home=True)
    assert scenario.limits == Limits(time_ms=90_500)
    assert scenario.planning_time is PlanningTime.CHARGED
    assert scenario.start_seed == 7


def test_what_is_absent_has_its_default(tmp_path: Path) -> None:
    scenario = read_scenario(stored(tmp_path, GOOD))
    assert scenario.name == "yard"
    assert (scenario.goal, scenario.limits) == (Goal(), Limits())
    assert scenario.planning_time is PlanningTime.INSTANT
    assert scenario.start_seed is None
    assert scenario.robot_types[0].energy == EnergyModel()


def test_json_is_read_too_with_its_way_of_writing_numbers(tmp_path: Path) -> None:
    path = tmp_path / "yard.json"
    path.write_text(json.dumps(changed(limits={"time_s": 1000})).replace("1000", "1e3"), encoding="utf-8")
    assert read_scenario(path).limits.time_ms == 1_000_000


def test_the_example_of_the_documentation_is_read(tmp_path: Path) -> None:
    example = DOCS.read_text(encoding="utf-8").split("```yaml\n")[1].split("```")[0]
    scenario = read_scenario(stored(tmp_path, example))
    assert [member.name for member in scenario.team] == ["mother", "joey1", "joey2"]
    assert scenario.grid.terrains[3] == Terrain(code=3, name="mud")
    assert 3 in scenario.robot_types[1].terrains


def test_the_documentation_names_every_generator() -> None:
    text = DOCS.read_text(encoding="utf-8")
    assert all(f"`{name}`" in text for name in GENERATORS)


def test_a_team_by_numbers_is_docked_and_drawn(tmp_path: Path) -> None:
    scenario = read_scenario(stored(tmp_path, changed(team={"carriers": 2, "rovers_per_carrier": 1})))
    assert scenario.team == (
        TeamMember(name="carrier1", type="carrier"),
        TeamMember(name="rover1_1", type="rover", carrier="carrier1"),
        TeamMember(name="carrier2", type="carrier"),
        TeamMember(name="rover2_1", type="rover", carrier="carrier2"),
    )


def test_a_team_by_numbers_can_name_its_types(tmp_path: Path) -> None:
    data = changed(team={"carriers": 1, "rovers_per_carrier": 3, "carrier_type": "truck"})
    data["robot_types"].append({**data["robot_types"][0], "name": "truck", "capacity": 3})
    scenario = read_scenario(stored(tmp_path, data))
    assert [member.type for member in scenario.team] == ["truck", "rover", "rover", "rover"]


def test_a_start_may_be_drawn(tmp_path: Path) -> None:
    assert read_scenario(stored(tmp_path, changed(team__0__start="drawn"))).team[0].start is None


def test_a_generated_map_is_that_of_the_generator(tmp_path: Path) -> None:
    size = {"width_m": 20, "height_m": 12.5, "resolution_m": 0.5, "seed": 4}
    data = changed(map={"generator": "random", "share": 0.3, **size}, team={"carriers": 1, "rovers_per_carrier": 0})
    expected = GENERATORS["random"].make(share=0.3, **size)
    assert read_scenario(stored(tmp_path, data)).grid.cells.tolist() == expected.cells.tolist()


def test_a_map_file_and_its_mask_are_found_beside_the_scenario(tmp_path: Path) -> None:
    (tmp_path / "maps").mkdir()
    (tmp_path / "maps" / "swamp.map").write_text("type octile\nheight 2\nwidth 3\nmap\n..@\n...\n", encoding="utf-8")
    greys = np.array([[255, 60, 60], [255, 128, 127]], dtype=np.uint8)
    Image.fromarray(greys).save(tmp_path / "maps" / "terrain.png")
    mask = {"file": "maps/terrain.png", "greys": {"floor": 255, "rough": [127, 128], "mud": 60}}
    data = changed(
        map={"file": "maps/swamp.map", "mask": mask},
        terrains=[{"name": "mud", "code": 9, "blocks_sight": True}],
        team={"carriers": 1, "rovers_per_carrier": 0},
    )
    grid = read_scenario(stored(tmp_path, data)).grid
    assert grid.cells.tolist() == [[FLOOR, ROUGH, ROUGH], [FLOOR, 9, OBSTACLE]]
    assert grid.terrains == (*TERRAINS, Terrain(code=9, name="mud", blocks_sight=True))


def test_terrains_without_a_code_get_the_lowest_free_one(tmp_path: Path) -> None:
    data = changed(terrains=[{"name": "mud"}, {"name": "ice", "code": 4}, {"name": "sand"}])
    terrains = read_scenario(stored(tmp_path, data)).grid.terrains
    assert [(t.name, t.code) for t in terrains[3:]] == [("mud", 3), ("ice", 4), ("sand", 5)]


# --- what is refused: every message in full -------------------------------------------------------------------------

BROKEN: dict[str, tuple[dict[str, Any], list[str]]] = {
    "a number of the wrong sign": (
        {"robot_types__1__speed_mps": -1},
        ["robot_types[1].speed_mps: must be positive, got -1"],
    ),
    "a negative radius": ({"robot_types__0__radius_m": -0.5}, ["robot_types[0].radius_m: must be 0 or more, got -0.5"]),
    "a speed like a glacier's": (
        {"robot_types__0__speed_mps": 1e-9},
        ["robot_types[0].speed_mps: must be 0.001 or more, got 1e-09"],
    ),
    "a boolean for a number": (
        {"robot_types__0__speed_mps": True},
        ["robot_types[0].speed_mps: must be a number, got true"],
    ),
    "a text for a number": (
        {"robot_types__0__speed_mps": "fast"},
        ["robot_types[0].speed_mps: must be a number, got 'fast'"],
    ),
    "a number that is none": (
        {"robot_types__0__sensor_range_m": float("nan")},
        ["robot_types[0].sensor_range_m: must be finite, got nan"],
    ),
    "an infinite number": (
        {"robot_types__1__dock_s": float("inf")},
        ["robot_types[1].dock_s: must be finite, got inf"],
    ),
    "half a rover": ({"robot_types__0__capacity": 1.5}, ["robot_types[0].capacity: must be an integer, got 1.5"]),
    "a boolean for an integer": (
        {"robot_types__0__capacity": True},
        ["robot_types[0].capacity: must be an integer, got true"],
    ),
    "missing fields": (
        {"robot_types__1__undock_s": ..., "robot_types__0__capacity": ..., "format": ...},
        ["format: missing", "robot_types[0].capacity: missing", "robot_types[1].undock_s: missing"],
    ),
    "missing parts": (
        {"map": ..., "robot_types": ..., "team": ...},
        ["map: missing", "robot_types: missing", "team: missing"],
    ),
    "a misspelt field": (
        {"robot_types__0__speed_mps": ..., "robot_types__0__speed_mp": 1.0},
        [
            "robot_types[0].speed_mps: missing",
            "robot_types[0].speed_mp: unknown field, did you mean 'speed_mps'?",
        ],
    ),
    "a field like no other": ({"colour": "red"}, ["colour: unknown field"]),
    "fields of the other role": (
        {"robot_types__0__dock_s": 1, "robot_types__1__capacity": 1},
        ["robot_types[0].dock_s: only rovers have it", "robot_types[1].capacity: only carriers have it"],
    ),
    "a role like no other": (
        {"robot_types__1__role": "kangaroo"},
        [
            "robot_types[1].role: must be carrier or rover, got 'kangaroo'",
        ],
    ),
    "a type twice": (
        {"robot_types__1__name": "Carrier"},
        [
            "robot_types[1].name: 'Carrier' is used twice",
            "team[1].type: unknown robot type 'rover'",
            "team[2].type: unknown robot type 'rover'",
        ],
    ),
    "no types": ({"robot_types": []}, ["robot_types: must not be empty"]),
    "types that are no list": ({"robot_types": {"a": 1}}, ["robot_types: must be a list, got {'a': 1}"]),
    "a type that is no mapping": (
        {"robot_types": ["carrier"]},
        ["robot_types[0]: must be a mapping of fields, got 'carrier'"],
    ),
    "unknown terrains": (
        {"robot_types__0__terrains": ["flor", 3], "robot_types__1__terrains": ["obstacle", "lava"]},
        [
            "robot_types[0].terrains[1]: must be a text, got 3",
            "robot_types[1].terrains[0]: no robot can drive on obstacles",
            "robot_types[1].terrains[1]: unknown terrain 'lava'",
        ],
    ),
    "a misspelt terrain": (
        {"robot_types__0__terrains": ["flor"]},
        ["robot_types[0].terrains[0]: unknown terrain 'flor', did you mean 'floor'?"],
    ),
    "no terrain": ({"robot_types__0__terrains": []}, ["robot_types[0].terrains: must be a list of texts, got []"]),
    "wrong further terrains": (
        {
            "terrains": [
                {"name": "floor"},
                {"name": "mud", "code": 2},
                {"name": "ice", "code": 255},
                {"name": "sand", "code": 7, "blocks_sight": 1},
                {"name": "snow", "code": 7},
            ]
        },
        [
            "terrains[0].name: 'floor' is used twice",
            "terrains[1].code: must be 3 or more, got 2",
            "terrains[2].code: must be at most 254, got 255",
            "terrains[3].blocks_sight: must be true or false, got 1",
            "terrains[4].code: 7 is used twice",
        ],
    ),
    "a robot twice": ({"team__2__name": "Joey"}, ["team[2].name: 'Joey' is used twice"]),
    "a name that PDDL can't say": (
        {"team__2__name": "jill b"},
        ["team[2].name: must be a letter followed by letters, digits, '_' or '-', got 'jill b'"],
    ),
    "an unknown type": (
        {"team__2__type": "rovr"},
        ["team[2].type: unknown robot type 'rovr', did you mean 'rover'?"],
    ),
    "an unknown carrier": (
        {"team__1__carrier": "ana"},
        ["team[1].carrier: unknown carrier 'ana', did you mean 'anna'?"],
    ),
    "a rover on a rover": ({"team__1__carrier": "jill"}, ["team[1].carrier: 'jill' is a rover and can't carry"]),
    "a carrier on a carrier": (
        {"team__0": {"name": "anna", "type": "carrier", "carrier": "anna"}},
        ["team[0].carrier: 'anna' is a carrier and can't be carried"],
    ),
    "more rovers than places": (
        {"robot_types__0__capacity": 0},
        ["team[0]: carries 1 rovers, type 'carrier' has capacity 0"],
    ),
    "a start and a carrier": (
        {"team__1__start": [1.5, 1.5]},
        ["team[1].start: give 'start' or 'carrier', not both"],
    ),
    "no start": (
        {"team__2__start": ...},
        ["team[2].start: missing: needs [x, y] in metres, 'drawn', or a 'carrier'"],
    ),
    "starts that are no points": (
        {"team__0__start": [1, 2, 3], "team__2__start": [True, 1]},
        [
            "team[0].start: must be a list of 2 numbers, got [1, 2, 3]",
            "team[2].start: must be a list of 2 numbers, got [True, 1]",
        ],
    ),
    "a start outside": ({"team__2__start": [-0.5, 2]}, ["team[2].start: [-0.5, 2] is outside the map"]),
    "a start in a wall": (
        {"team__2__start": [0.5, 0.5]},
        ["team[2].start: a rover can't stand at [0.5, 0.5]: the cell is obstacle"],
    ),
    "a start on ground for others": (
        {"team__0__start": [5.5, 2.5]},
        ["team[0].start: a carrier can't stand at [5.5, 2.5]: the cell is rough"],
    ),
    "a start too close to a wall": (
        {"robot_types__0__radius_m": 1.1, "team__0__start": [1.5, 2.5]},
        ["team[0].start: a carrier can't stand at [1.5, 2.5]: its radius of 1.1 m does not fit there"],
    ),
    "a team without carriers": (
        {"team": [{"name": "jill", "type": "rover", "start": [6.5, 1.5]}]},
        ["team: needs at least one carrier"],
    ),
    "an empty team": ({"team": []}, ["team: needs at least one carrier"]),
    "a team that is a number": (
        {"team": 3},
        ["team: must be a list of robots, or a mapping with 'carriers' and 'rovers_per_carrier'"],
    ),
    "a team of nobody": (
        {"team": {"carriers": 0, "rovers_per_carrier": -1}},
        ["team.carriers: must be 1 or more, got 0", "team.rovers_per_carrier: must be 0 or more, got -1"],
    ),
    "too many rovers by number": (
        {"team": {"carriers": 1, "rovers_per_carrier": 3}},
        ["team.rovers_per_carrier: 3 for each carrier, but type 'carrier' has capacity 2"],
    ),
    "types of the wrong role by number": (
        {"team": {"carriers": 1, "rovers_per_carrier": 1, "carrier_type": "rover", "rover_type": "rver"}},
        [
            "team.carrier_type: 'rover' is a rover, not a carrier",
            "team.rover_type: unknown robot type 'rver', did you mean 'rover'?",
        ],
    ),
    "a later version": (
        {"version": 2, "fuel": 3, "team": 0},
        ["version: must be at most 1, got 2: the file is for a later marsupial"],
    ),
    "another format": (
        {"format": "marsupial-log"},
        ["format: must be marsupial-scenario, got 'marsupial-log'"],
    ),
    "a map from nowhere": (
        {"map": {"fil": "a.map"}},
        [
            "map: needs one of file, generator, rows, got none",
            "map.fil: unknown field, did you mean 'file'?",
        ],
    ),
    "a map from two places": (
        {"map__file": "a.map"},
        ["map: needs one of file, generator, rows, got file and rows"],
    ),
    "rows of several lengths and strange characters": (
        {"map__rows": ["####", "#x#", "#??#"]},
        ["map.rows[1]: has 3 characters, the first row has 4", "map.rows[1]: unknown character 'x' at column 1"],
    ),
    "no rows": ({"map__rows": [""]}, ["map.rows[0]: is empty"]),
    "rows without a size": (
        {"map__resolution_m": 0, "map__origin_m": [0, 0]},
        [
            "map.resolution_m: must be positive, got 0",
            "map.origin_m: must be a list of 3 numbers, got [0, 0]",
        ],
    ),
    "a wrong legend": (
        {"map__legend": {"mm": "rough", "#": "floor", "r": "rouch"}},
        [
            "map.legend.mm: must be a text of one character, none of # . ~ ?",
            "map.legend.#: must be a text of one character, none of # . ~ ?",
            "map.legend.r: unknown terrain 'rouch', did you mean 'rough'?",
        ],
    ),
    "an unknown generator": (
        {"map": {"generator": "ofice", "width_m": 60, "height_m": 36}},
        ["map.generator: unknown generator 'ofice', did you mean 'office'?"],
    ),
    "a generator's parameters": (
        {"map": {"generator": "random", "width_m": 60, "height_m": 3, "share": 0.9, "depth": 1}},
        ["map.share: must be 0 to 0.35, got 0.9", "map.depth: unknown field"],
    ),
    "a generated map too small": (
        {"map": {"generator": "office", "width_m": 6, "height_m": 3}},
        ["map.width_m: must be 30 to 500, got 6.0", "map.height_m: must be 24 to 500, got 3.0"],
    ),
    "a wrong goal": (
        {"goal": {"recover_rovers": "yes", "come_home": True}, "limits": {"time_s": 0}, "planning_time": "never"},
        [
            "goal.recover_rovers: must be true or false, got 'yes'",
            "goal.come_home: unknown field, did you mean 'return_home'?",
            "limits.time_s: must be positive, got 0",
            "planning_time: must be instant or charged, got 'never'",
        ],
    ),
    "a time without end": (
        {"limits": {"time_s": 1e9}},
        ["limits.time_s: must be at most 10000000, got 1000000000.0"],
    ),
    "a negative seed": ({"start_seed": -1}, ["start_seed: must be 0 or more, got -1"]),
    "a name that is a number": ({"name": 12}, ["name: must be a text, got 12"]),
}


@pytest.mark.parametrize("case", BROKEN)
def test_a_broken_scenario_is_told_exactly_what_is_wrong(case: str, tmp_path: Path) -> None:
    changes, expected = BROKEN[case]
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


def test_the_message_names_the_file(tmp_path: Path) -> None:
    with pytest.raises(ScenarioError) as caught:
        read_scenario(stored(tmp_path, changed(robot_types__1__speed_mps=-1)))
    assert str(caught.value) == f"{tmp_path}/yard.yaml: robot_types[1].speed_mps: must be positive, got -1"


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "must be a mapping of fields, got nothing"),
        ("- 1\n", "must be a mapping of fields, got [1]"),
        ("just words\n", "must be a mapping of fields, got 'just words'"),
        ("format: marsupial-scenario\nname: a\nname: b\n", "line 3, column 1: field 'name' is given twice"),
        ("map: {\n", "line 2, column 1: did not find expected node content"),
        (
            "map: !!python/object/apply:os.getcwd []\n",
            "line 1, column 6: could not determine a constructor",
        ),
        ("version: " + "9" * 5000, "is not YAML: Exceeds the limit"),
        ("a\0b", "is not YAML"),
    ],
)
def test_what_is_no_yaml_is_told_where(tmp_path: Path, text: str, message: str) -> None:
    (only,) = faults(tmp_path, text)
    assert only.startswith(message)


def test_what_is_no_text_is_told(tmp_path: Path) -> None:
    (tmp_path / "yard.yaml").write_bytes(b"\xff\xfe\x00\x01")
    with pytest.raises(ScenarioError, match="is not UTF-8 text"):
        read_scenario(tmp_path / "yard.yaml")


def test_deep_nesting_is_an_error_and_no_crash(tmp_path: Path) -> None:
    assert len(faults(tmp_path, "[" * 3000)) == 1


def test_a_missing_file_is_told(tmp_path: Path) -> None:
    with pytest.raises(ScenarioError, match="no such file"):
        read_scenario(tmp_path / "yard.yaml")


def test_a_missing_map_and_mask_are_told_with_their_fields(tmp_path: Path) -> None:
    (only,) = faults(tmp_path, changed(map={"file": "gone.map"}))
    assert only == f"map.file: {tmp_path}/gone.map: no such file"
    data = changed(map__mask={"file": "gone.png", "greys": {"floor": 255, "lava": 3, "rough": 256}})
    assert faults(tmp_path, data)[:2] == [
        "map.mask.greys.lava: unknown terrain 'lava'",
        "map.mask.greys.rough: must be a grey from 0 to 255 or a list of them, got 256",
    ]


def test_a_mask_of_another_size_is_told(tmp_path: Path) -> None:
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


@settings(max_examples=150, deadline=None)
@given(path=st.sampled_from(_PATHS), junk=_JUNK)
def test_junk_in_any_field_is_refused_or_read_but_never_breaks_the_reader(
    path: str, junk: Any, tmp_path_factory: pytest.TempPathFactory
) -> None:
    file = stored(tmp_path_factory.getbasetemp(), changed(**{path: junk}))
    try:
        read_scenario(file)
    except ScenarioError:
        return


# --- writing --------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", SCENARIOS)
def test_a_built_in_scenario_is_the_same_after_writing_and_reading(name: str, tmp_path: Path) -> None:
    scenario = builtin_scenario(name)
    write_scenario(scenario, tmp_path / "a.yaml")
    assert_same(read_scenario(tmp_path / "a.yaml"), scenario)


def test_everything_a_scenario_can_hold_survives_writing_and_reading(tmp_path: Path) -> None:
    terrains = (*TERRAINS, Terrain(code=3, name="mud"), Terrain(code=254, name="hedge", blocks_sight=True))
    cells = np.array([[0, 1, 2, 3], [254, UNKNOWN, 1, 1], [1, 1, 1, 1]], dtype=np.uint8)
    grid = Grid(cells=cells, resolution_m=0.1, origin_m=(-3.25, 7.125, 0.3), terrains=terrains)
    carrier, rover = bare_map_scenario("x", grid).robot_types
    scenario = Scenario(
        name="a: strange # name",
        grid=grid,
        robot_types=(
            rover,
            replace(rover, name="crab", terrains=frozenset({3, 254}), dock_ms=1, undock_ms=12_345, radius_m=0.05),
            replace(carrier, radius_m=0.0, capacity=7),
        ),
        team=(
            TeamMember(name="b", type="crab", start=Cell(3, 0)),
            TeamMember(name="a", type="carrier", start=Cell(2, 1)),
            TeamMember(name="c", type="carrier"),
            TeamMember(name="d", type="rover", carrier="c"),
        ),
        goal=Goal(recover_rovers=False, return_home=True),
        limits=Limits(time_ms=1_234_567),
        planning_time=PlanningTime.CHARGED,
        start_seed=0,
    )
    write_scenario(scenario, tmp_path / "a.yaml")
    assert_same(read_scenario(tmp_path / "a.yaml"), scenario)


def test_what_was_written_reads_well() -> None:
    text = scenario_text(builtin_scenario("lobby"))
    assert "team:\n  carriers: 2\n  rovers_per_carrier: 2\n" in text
    assert "  terrains: [floor]\n" in text
    assert text.count("\n  - '#") == 44


def test_a_failed_write_leaves_what_was_there(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "a.yaml"
    path.write_text("before", encoding="utf-8")

    def full(*_: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "replace", full)
    with pytest.raises(ScenarioError, match=r"can't be written \(No space left on device\)"):
        write_scenario(builtin_scenario("lobby"), path)
    assert path.read_text(encoding="utf-8") == "before"
    assert list(tmp_path.iterdir()) == [path]


def test_a_folder_that_is_missing_is_told_when_writing(tmp_path: Path) -> None:
    with pytest.raises(ScenarioError, match="can't be written"):
        write_scenario(builtin_scenario("lobby"), tmp_path / "gone" / "a.yaml")


def test_a_terrain_without_a_name_can_not_be_written() -> None:
    grid = Grid(cells=np.full((2, 2), 9, dtype=np.uint8), resolution_m=1.0)
    with pytest.raises(ScenarioError, match="terrain code 9 of the map has no name"):
        scenario_text(bare_map_scenario("x", grid))


# --- which file is which, and other teams ---------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("name", "text", "is_one"),
    [
        ("a.yaml", "format: marsupial-scenario\n", True),
        ("a.yml", "team: []\n", True),
        ("a.json", "{", True),
        ("a.yaml", "image: a.pgm\nresolution: 0.05\n", False),
        ("a.yaml", "{", False),
        ("a.map", "type octile\n", False),
    ],
)
def test_scenario_files_are_told_from_maps(name: str, text: str, is_one: bool, tmp_path: Path) -> None:
    (tmp_path / name).write_text(text, encoding="utf-8")
    assert is_scenario_file(tmp_path / name) is is_one


def test_no_other_team_asked_for_changes_nothing(tmp_path: Path) -> None:
    scenario = read_scenario(stored(tmp_path, GOOD))
    assert with_team(scenario, None, None) is scenario


@pytest.mark.parametrize(
    ("carriers", "rovers", "names"),
    [
        (2, None, ["carrier1", "rover1_1", "carrier2", "rover2_1"]),
        (None, 2, ["carrier1", "rover1_1", "rover1_2"]),
        (1, 0, ["carrier1"]),
    ],
)
def test_another_team_keeps_what_was_not_asked_for(
    carriers: int | None, rovers: int | None, names: list[str], tmp_path: Path
) -> None:
    team = with_team(read_scenario(stored(tmp_path, GOOD)), carriers, rovers).team
    assert [member.name for member in team] == names
    assert all(member.start is None for member in team)


@pytest.mark.parametrize(
    ("carriers", "rovers", "message"),
    [
        (0, 1, "carriers: must be 1 or more, got 0"),
        (1, 3, "rovers: 3 for each carrier, but type 'carrier' has capacity 2"),
    ],
)
def test_a_team_the_scenario_has_no_room_for_is_refused(
    carriers: int, rovers: int, message: str, tmp_path: Path
) -> None:
    with pytest.raises(ScenarioError) as caught:
        with_team(read_scenario(stored(tmp_path, GOOD)), carriers, rovers)
    assert str(caught.value) == message
