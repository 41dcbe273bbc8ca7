"""Robots that see only ahead while they drive."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from support.missions.small_teams import carrier_at, drawn_grid, kinds_of

import marsupial
from marsupial.errors import ScenarioError
from marsupial.formats.scenario.write import type_fields
from marsupial.model import UNKNOWN, Cell, RobotType, Scenario
from marsupial.sim.sensors import FieldOfView, ahead
from marsupial.sim.world import SimulatedWorld

HALL = ("###############", *["#.............#"] * 13, "###############")
MIDDLE = Cell(7, 7)


def seen_with(angle_deg: float, heading: int) -> set[tuple[int, int]]:
    grid = drawn_grid(*HALL)
    kind = replace(kinds_of()["carrier"], sensor_range_m=4.0 * grid.resolution_m)
    seen = ahead(FieldOfView().visible(grid, kind, MIDDLE), grid, MIDDLE, heading, angle_deg)
    return {(int(i) % grid.width - MIDDLE.x, int(i) // grid.width - MIDDLE.y) for i in seen}


@pytest.mark.parametrize("heading", range(8))
def test_a_view_of_90_degrees_is_a_quarter_around_the_heading(heading: int) -> None:
    seen = seen_with(90, heading)
    ahead_of = [(1, 0), (1, 1), (0, 1), (-1, 1), (-1, 0), (-1, -1), (0, -1), (1, -1)]
    (x, y), left, behind = ahead_of[heading], ahead_of[(heading + 2) % 8], ahead_of[(heading + 4) % 8]
    assert {(0, 0), (x, y), (2 * x, 2 * y)} <= seen
    assert not {left, behind} & seen
    assert {ahead_of[(heading + 1) % 8], ahead_of[(heading - 1) % 8]} <= seen, "the edges belong to it"


def test_360_degrees_are_all_around() -> None:
    assert seen_with(360, 3) == seen_with(360, 0) >= {(3, 0), (-3, 0), (0, 3), (0, -3)}


def known(world: SimulatedWorld) -> set[tuple[int, int]]:
    return {(int(x), int(y)) for y, x in np.argwhere(world.grid.cells != UNKNOWN)}


def test_a_robot_sees_ahead_while_it_drives_and_all_around_where_it_stops() -> None:
    kinds = {name: replace(kind, sensor_range_m=3.0, sensor_angle_deg=40.0) for name, kind in kinds_of().items()}
    world = SimulatedWorld(drawn_grid(*HALL), kinds, [carrier_at(2, 7)])
    world.advance(0)
    before = known(world)
    assert {(2, 4), (2, 10), (5, 7)} <= before, "it begins with a look all around"
    world.drive("c1", [Cell(x, 7) for x in range(2, 9)])
    world.advance(10**6)  # it passes (3, 7)
    assert known(world) - before == {(6, 7)}
    while not world.advance(10**6).finished:
        assert (5, 10) not in known(world)
    assert {(8, 4), (8, 10), (11, 7)} <= known(world)


def with_angle(scenario: Scenario, angle_deg: float) -> Scenario:
    types: tuple[RobotType, ...] = tuple(replace(kind, sensor_angle_deg=angle_deg) for kind in scenario.robot_types)
    return replace(scenario, robot_types=types)


@pytest.mark.parametrize("angle_deg", [1.0, 90.0, 360.0])
def test_missions_end_with_the_whole_map_known_all_the_same(angle_deg: float) -> None:
    result = marsupial.explore(with_angle(marsupial.scenario("lobby"), angle_deg), planner="greedy", steps=1)
    assert (result.status, result.coverage) == ("complete", 1.0)
    if angle_deg == 360.0:
        plain = marsupial.explore("lobby", planner="greedy", steps=1)
        assert result.exploration_time_s == plain.exploration_time_s


FILE = """
format: marsupial-scenario
version: 1
name: hall
map: {{rows: ["#####", "#...#", "#####"], resolution_m: 1}}
robot_types:
  - {{name: cart, role: carrier, speed_mps: 1, sensor_range_m: 3, radius_m: 0, terrains: [floor], capacity: 0,
      sensor_angle_deg: {angle}}}
team: [{{name: one, type: cart, start: drawn}}]
"""


def test_a_scenario_file_has_angles_and_they_are_written_as_they_were_read(tmp_path: Path) -> None:
    path = tmp_path / "hall.yaml"
    path.write_text(FILE.format(angle=90))
    (kind,) = marsupial.scenario(path).robot_types
    assert kind.sensor_angle_deg == 90.0
    assert type_fields(kind, {1: "floor"})["sensor_angle_deg"] == 90.0
    assert "sensor_angle_deg" not in type_fields(replace(kind, sensor_angle_deg=None), {1: "floor"})


@pytest.mark.parametrize("angle", [0, -90, 361, "wide", "null"])
def test_a_wrong_angle_is_refused(tmp_path: Path, angle: object) -> None:
    path = tmp_path / "hall.yaml"
    path.write_text(FILE.format(angle=angle))
    with pytest.raises(ScenarioError, match=r"robot_types\[0\]\.sensor_angle_deg"):
        marsupial.scenario(path)
