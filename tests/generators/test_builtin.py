"""Built-in scenarios: fixed maps on which the default team has work for both kinds of robot."""

import hashlib

import numpy as np
import pytest

from marsupial.errors import ScenarioError
from marsupial.generators import GENERATORS
from marsupial.generators.builtin import SCENARIOS, bare_map_scenario, builtin_scenario
from marsupial.model.grid import FLOOR, ROUGH, Grid


@pytest.mark.parametrize(
    ("name", "terrains"),
    [("office", {ROUGH}), ("maze", {ROUGH}), ("lobby", {ROUGH}), ("rooms", {FLOOR, ROUGH}), ("cave", {FLOOR, ROUGH})],
)
def test_rovers_drive_where_the_scenario_wants(name: str, terrains: set[int]) -> None:
    assert builtin_scenario(name).robot_types[1].terrains == terrains


@pytest.mark.parametrize(
    ("name", "digest"),
    [
        ("office", "114ad720ada1"),
        ("maze", "c08b6a03b966"),
        ("rooms", "6a37600f2000"),
        ("random", "efc495212e8f"),
        ("lobby", "f0e21529bb2c"),
    ],
)
def test_a_built_in_map_never_changes(name: str, digest: str) -> None:
    assert hashlib.sha256(builtin_scenario(name).grid.cells.tobytes()).hexdigest()[:12] == digest


@pytest.mark.parametrize(("rovers", "capacity"), [(0, 1), (1, 1), (3, 3)])
def test_carriers_have_a_place_for_each_of_their_rovers(rovers: int, capacity: int) -> None:
    scenario = builtin_scenario("lobby", 3, rovers)
    assert len(scenario.team) == 3 * (1 + rovers)
    assert scenario.robot_types[0].capacity == capacity


def test_an_unknown_scenario_is_answered_with_the_known_ones() -> None:
    with pytest.raises(ScenarioError, match="unknown scenario 'attic'; built in: office, maze,"):
        builtin_scenario("attic")


@pytest.mark.parametrize(
    ("carriers", "rovers", "message"),
    [
        (0, -1, "carriers: must be 1 or more, got 0\nrovers: must be 0 or more, got -1"),
        (10**9, 2, "carriers: must be at most 1000, got 1000000000"),
        (1, 10**9, "rovers: must be at most 1000, got 1000000000"),
        (500, 2, "carriers: a team has at most 1000 robots with all rovers, this one 1500"),
    ],
)
def test_an_empty_or_too_large_team_is_refused(carriers: int, rovers: int, message: str) -> None:
    with pytest.raises(ScenarioError) as caught:
        builtin_scenario("lobby", carriers, rovers)
    assert str(caught.value) == message


def test_a_team_of_as_many_robots_as_there_may_be_is_made() -> None:
    assert len(builtin_scenario("lobby", 500, 1).team) == 1000


def test_a_bare_map_gets_the_default_types() -> None:
    grid = Grid(cells=np.ones((3, 4), dtype=np.uint8), resolution_m=1.0)
    scenario = bare_map_scenario("yard", grid, 1, 3)
    assert scenario.grid is grid
    assert [kind.radius_m for kind in scenario.robot_types] == [0.5, 0.15]
    assert [member.name for member in scenario.team] == ["carrier1", "rover1_1", "rover1_2", "rover1_3"]
    assert scenario.robot_types[0].capacity == 3


def test_a_bare_map_needs_a_carrier_too() -> None:
    grid = Grid(cells=np.ones((3, 4), dtype=np.uint8), resolution_m=1.0)
    with pytest.raises(ScenarioError, match="carriers: must be 1 or more, got 0"):
        bare_map_scenario("yard", grid, 0, 1)


def test_every_generator_has_a_scenario() -> None:
    assert set(SCENARIOS) == set(GENERATORS)
