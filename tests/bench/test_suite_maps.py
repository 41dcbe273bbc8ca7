from collections.abc import Mapping
from pathlib import Path

import pytest

from marsupial.bench.suite.maps import FLOORS, LAST, PROOF, TUNING, MapSuite, building_of, real_files
from marsupial.library.exploring import explore
from marsupial.library.scenarios import load_scenario
from marsupial.maps.reach import largest_reach
from marsupial.model.mission import Status

LISTS = (TUNING, PROOF, LAST)


def real_maps(suites: Mapping[str, MapSuite]) -> set[str]:
    return {Path(name).name for suite in suites.values() if suite.real for name in suite.maps}


def test_a_building_is_in_one_list_with_all_its_floors() -> None:
    maps = [real_maps(suites) for suites in LISTS]
    buildings = [set(map(building_of, names)) for names in maps]
    assert sum(map(len, buildings)) == len(set.union(*buildings))
    assert {floor for floors in FLOORS.values() for floor in floors} < set.union(*maps)


def test_a_laser_map_is_in_the_same_list_of_both_suites() -> None:
    for suites in (TUNING, PROOF):
        assert set(suites["laser"].maps) < set(suites["buildings"].maps)


@pytest.mark.parametrize("suites", LISTS)
def test_every_robot_has_ground_on_the_maps_of_all_buildings(suites: Mapping[str, MapSuite], shared_maps: Path) -> None:
    for file in real_files(suites["buildings"].maps, shared_maps):
        scenario = load_scenario(str(file), 4, 2).scenario
        assert scenario.name == file.stem
        assert all(largest_reach(scenario.grid, kind).any() for kind in scenario.robot_types)


def test_a_mission_in_a_real_flat_ends_with_all_but_little_ground_explored(shared_maps: Path) -> None:
    (flat,) = real_files(["buildings/home_sarmis"], shared_maps)
    found = explore(load_scenario(str(flat), 2, 2).scenario, "heuristic")
    assert found.status is Status.COMPLETE
    assert found.coverage >= 0.999  # corners with hardly any ground are left (`Goal.least_ground`)
