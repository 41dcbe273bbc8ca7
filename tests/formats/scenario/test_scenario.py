"""Scenario files: reading, writing without loss, and other teams for a scenario."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from yard import GOOD, changed, stored

from benchmarks.scenario_files import write_scenario
from marsupial.errors import ScenarioError
from marsupial.formats.scenario import is_scenario_file, read_scenario, with_team
from marsupial.formats.scenario.write import type_fields
from marsupial.generators import GENERATORS
from marsupial.generators.builtin import SCENARIOS, bare_map_scenario, builtin_scenario
from marsupial.model.grid import FLOOR, OBSTACLE, ROUGH, TERRAINS, UNKNOWN, Cell, Grid, Terrain
from marsupial.model.robots import EnergyModel, Role, Routes, TeamMember
from marsupial.model.scenario import Goal, MissionLimits, PlanningTime, Scenario

DOCS = Path(__file__).resolve().parents[3] / "docs" / "scenario-format.md"


def assert_same(a: Scenario, b: Scenario) -> None:
    assert replace(a, grid=b.grid) == b
    assert a.grid.cells.tolist() == b.grid.cells.tolist()
    assert (a.grid.resolution_m, a.grid.origin_m) == (b.grid.resolution_m, b.grid.origin_m)
    assert a.grid.terrains == b.grid.terrains


# --- reading --------------------------------------------------------------------------------------------------------


def test_every_field_is_read_in_the_units_of_the_model(tmp_path: Path) -> None:
    data = changed(
        name="my yard",
        start_seed=7,
        goal={"recover_rovers": False, "return_home": True},
        limits={"time_s": 90.5},
        planning_time="charged",
        robot_types__0__energy={"idle_w": 20, "drive_w": 60.5},
        robot_types__1__routes="energy",
        robot_types__1__energy={"metre_j": 1, "stop_j": 0.5, "turn_j": [0.4, 0.6, 0.8, 1]},
    )
    scenario = read_scenario(stored(tmp_path, data))
    carrier, rover = scenario.robot_types
    assert scenario.name == "my yard"
    assert scenario.grid.cells[1].tolist() == [0, FLOOR, FLOOR, FLOOR, FLOOR, ROUGH, ROUGH, 0]
    assert (carrier.role, carrier.capacity, carrier.terrains) == (Role.CARRIER, 2, {FLOOR})
    assert carrier.energy == EnergyModel(idle_w=20.0, drive_w=60.5)
    assert rover.energy == EnergyModel(metre_j=1.0, stop_j=0.5, turn_j=(0.4, 0.6, 0.8, 1.0))
    assert (carrier.routes, rover.routes) == (Routes.SHORTEST, Routes.ENERGY)
    assert (rover.role, rover.dock_ms, rover.undock_ms) == (Role.ROVER, 10_000, 5_000)
    assert (rover.speed_mps, rover.sensor_range_m, rover.radius_m) == (0.5, 5.0, 0.1)
    assert scenario.team == (
        TeamMember(name="anna", type="carrier", start=Cell(2, 2)),
        TeamMember(name="joey", type="rover", carrier="anna"),
        TeamMember(name="jill", type="rover", start=Cell(6, 1)),
    )
    assert scenario.goal == Goal(recover_rovers=False, return_home=True)
    assert scenario.limits == MissionLimits(time_ms=90_500)
    assert scenario.planning_time is PlanningTime.CHARGED
    assert scenario.start_seed == 7


def test_absent_fields_have_their_defaults(tmp_path: Path) -> None:
    scenario = read_scenario(stored(tmp_path, GOOD))
    assert scenario.name == "yard"
    assert (scenario.goal, scenario.limits) == (Goal(), MissionLimits())
    assert scenario.planning_time is PlanningTime.INSTANT
    assert not scenario.interference
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
            replace(
                carrier,
                radius_m=0.0,
                capacity=7,
                energy=EnergyModel(metre_j=1.5, turn_j=(0.0, 0.0, 0.25, 1.0)),
                routes=Routes.ENERGY,
            ),
        ),
        team=(
            TeamMember(name="b", type="crab", start=Cell(3, 0)),
            TeamMember(name="a", type="carrier", start=Cell(2, 1)),
            TeamMember(name="c", type="carrier"),
            TeamMember(name="d", type="rover", carrier="c"),
        ),
        goal=Goal(recover_rovers=False, return_home=True),
        limits=MissionLimits(time_ms=1_234_567),
        planning_time=PlanningTime.CHARGED,
        start_seed=0,
        interference=True,
    )
    write_scenario(scenario, tmp_path / "a.yaml")
    assert_same(read_scenario(tmp_path / "a.yaml"), scenario)


# --- kinds of files, and other teams --------------------------------------------------------------------------------


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
def test_scenario_files_are_distinguished_from_maps(name: str, text: str, is_one: bool, tmp_path: Path) -> None:
    (tmp_path / name).write_text(text, encoding="utf-8")
    assert is_scenario_file(tmp_path / name) is is_one


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


def test_seats_are_read_by_rover_type_and_their_number_is_the_capacity_if_there_is_none(tmp_path: Path) -> None:
    seats = changed(robot_types__0__seats={"rover": 3}, robot_types__0__capacity=...)
    (carrier, _) = read_scenario(stored(tmp_path, seats)).robot_types
    assert (carrier.capacity, carrier.seats) == (3, (("rover", 3),))
    (both, _) = read_scenario(stored(tmp_path, changed(robot_types__0__seats={"rover": 1}))).robot_types
    assert (both.capacity, both.seats) == (2, (("rover", 1),))
    assert type_fields(both, {1: "floor"})["seats"] == {"rover": 1}


def test_a_team_of_numbers_takes_the_first_rover_type_that_fits(tmp_path: Path) -> None:
    large = GOOD["robot_types"][1] | {"name": "large"}
    types = [GOOD["robot_types"][0] | {"seats": {"large": 1}}, *GOOD["robot_types"][1:], large]
    scenario = read_scenario(
        stored(tmp_path, changed(robot_types=types, team={"carriers": 1, "rovers_per_carrier": 1}))
    )
    assert [member.type for member in scenario.team] == ["carrier", "large"]
    assert [member.type for member in with_team(scenario, 2, 1).team] == ["carrier", "large"] * 2


@pytest.mark.parametrize(
    ("carriers", "rovers", "message"),
    [
        (0, 1, "carriers: must be 1 or more, got 0"),
        (10**9, 1, "carriers: must be at most 1000, got 1000000000"),
        (1000, 1, "carriers: a team has at most 1000 robots with all rovers, this one 2000"),
        (1, 3, "rovers: 3 for each carrier, but type 'carrier' has capacity 2"),
    ],
)
def test_a_team_the_scenario_has_no_room_for_is_refused(
    carriers: int, rovers: int, message: str, tmp_path: Path
) -> None:
    with pytest.raises(ScenarioError) as caught:
        with_team(read_scenario(stored(tmp_path, GOOD)), carriers, rovers)
    assert str(caught.value) == message
