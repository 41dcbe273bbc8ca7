import numpy as np
import pytest

from marsupial.bench.suite.maps import PROOF, SUITES, TUNING
from marsupial.errors import ScenarioError
from marsupial.generators.builtin import builtin_scenario, is_builtin
from marsupial.generators.footprint import FOOTPRINT_MAPS, footprint_map
from marsupial.maps.reach import largest_reach
from marsupial.model.grid import FLOOR, OBSTACLE
from marsupial.model.robots import default_types

CARRIER, ROVER = default_types(2)
SEEDS = (1, 2, 101, 105)

every_kind = pytest.mark.parametrize("kind", FOOTPRINT_MAPS)


@every_kind
def test_the_same_seed_draws_the_same_closed_map_and_another_seed_another(kind: str) -> None:
    drawn = [footprint_map(kind, seed).cells for seed in (1, 1, 2)]
    assert (drawn[0] == drawn[1]).all()
    assert (drawn[0] != drawn[2]).any()
    for edge in (drawn[0][0], drawn[0][-1], drawn[0][:, 0], drawn[0][:, -1]):
        assert (edge == OBSTACLE).all()


@every_kind
@pytest.mark.parametrize("seed", SEEDS)
def test_rovers_reach_all_of_it_and_carriers_not_but_all_is_floor(kind: str, seed: int) -> None:
    grid = footprint_map(kind, seed)
    free = grid.cells != OBSTACLE
    assert (grid.cells[free] == FLOOR).all()
    carriers, rovers = (largest_reach(grid, each) for each in (CARRIER, ROVER))
    assert (rovers == free).all()
    assert 0.2 < np.count_nonzero(carriers) / np.count_nonzero(free) < 0.95


def test_a_drawn_map_is_a_scenario_by_its_kind_and_seed() -> None:
    comb = builtin_scenario("comb-7", 2, 2)
    assert (comb.grid.cells == footprint_map("comb", 7).cells).all()
    assert comb.robot_types == default_types(2)
    fixed, other = builtin_scenario("office"), builtin_scenario("office-7")
    assert fixed.robot_types == other.robot_types
    assert (builtin_scenario("office-3").grid.cells == fixed.grid.cells).all()
    assert (other.grid.cells != fixed.grid.cells).any()
    assert not any(map(is_builtin, ("comb", "comb-", "comb--7", "comb-x", "closet-7", "comb-²", "comb-7.yaml")))
    with pytest.raises(ScenarioError, match="unknown scenario 'closet-7'"):
        builtin_scenario("closet-7")


@pytest.mark.parametrize("suite", PROOF)
def test_no_map_and_no_seed_to_prove_with_is_one_to_tune_on(suite: str) -> None:
    proof, tuning = PROOF[suite], TUNING[suite]
    assert set(proof.maps).isdisjoint(tuning.maps)
    assert proof.first_seed > tuning.first_seed + 100
    assert {suite, f"{suite}-tuning"} < SUITES.keys()


def test_the_footprint_suite_has_sixty_maps_at_least_eight_of_each_kind() -> None:
    maps = PROOF["footprint"].maps
    assert len(set(maps)) == 60
    assert min(sum(name.startswith(f"{kind}-") for name in maps) for kind in FOOTPRINT_MAPS) == 8
    assert all(map(is_builtin, (*maps, *PROOF["paper"].maps, *TUNING["paper"].maps)))
