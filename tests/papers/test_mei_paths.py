from itertools import pairwise

import numpy as np
import pytest

from marsupial.model.grid import Cell
from marsupial.papers.mei2006.paths import (
    PRINTED_LONGER,
    PRINTED_SAVED,
    RoutePairs,
    blocked_at_random,
    path_table,
    path_to,
    route_pairs,
    shortest_paths,
)
from marsupial.paths.energy import MotionCosts
from marsupial.paths.fields import PathSearch
from marsupial.paths.routes import route_length

MAP = blocked_at_random(20, 0.2, 3)
FREE = [Cell(int(x), int(y)) for y, x in np.argwhere(MAP)]


def cell_of(index: int) -> Cell:
    return Cell(index % 20, index // 20)


def test_paths_that_keep_corners_are_as_long_as_those_of_our_search() -> None:
    source = FREE[5]
    before = shortest_paths(MAP, source, cuts_corners=False)
    field = PathSearch(MAP).field(source)
    reached = np.flatnonzero(before >= 0).tolist()
    assert reached == np.flatnonzero(np.isfinite(field)).tolist()
    for cell in map(cell_of, reached):
        assert route_length(path_to(cell, before, 20)) == pytest.approx(field[cell.y, cell.x])


def test_paths_that_cut_corners_lead_over_free_cells_and_are_no_longer() -> None:
    source = FREE[5]
    keeping, cutting = (shortest_paths(MAP, source, cuts_corners=cuts) for cuts in (False, True))
    for cell in map(cell_of, np.flatnonzero(keeping >= 0).tolist()):
        path = path_to(cell, cutting, 20)
        assert all(MAP[y, x] for x, y in path)
        assert all(max(abs(a.x - b.x), abs(a.y - b.y)) == 1 for a, b in pairwise(path))
        assert route_length(path) <= route_length(path_to(cell, keeping, 20)) + 1e-9


@pytest.mark.parametrize("cuts_corners", [False, True])
def test_routes_of_least_energy_take_no_more_energy_and_are_no_shorter(cuts_corners: bool) -> None:
    pairs = route_pairs(MAP, 12, 1, cuts_corners=cuts_corners)
    assert len(pairs.shortest) == len(pairs.cheapest) > 60
    assert (pairs.cheapest[:, 1] <= pairs.shortest[:, 1] + 1e-9).all()
    assert (pairs.cheapest[:, 0] >= pairs.shortest[:, 0] - 1e-9).all()
    saved, longer = pairs.gains
    assert (0.0 < saved < 0.2, longer >= 0.0) == (True, True)


def test_without_turning_costs_nothing_can_be_saved() -> None:
    pairs = route_pairs(MAP, 8, 1, costs=MotionCosts(stop=0.0, turn=(0.0, 0.0, 0.0, 0.0)))
    assert pairs.gains == pytest.approx((0.0, 0.0))


def test_means_of_ratios_and_ratios_of_sums() -> None:
    shortest, cheapest = np.array([[10.0, 20.0], [30.0, 60.0]]), np.array([[11.0, 15.0], [30.0, 60.0]])
    both = RoutePairs(shortest=shortest, cheapest=cheapest)
    assert both.gains == pytest.approx((0.125, 0.05))
    assert both.gains_in_all == pytest.approx((5 / 80, 1 / 40))


def test_a_table_is_that_of_all_its_maps() -> None:
    table = path_table(maps=2, ends=3, side=20)
    second = route_pairs(blocked_at_random(20, 0.2, 2), 3, 2)
    assert len(table.shortest) > len(second.shortest)
    assert table.shortest[-len(second.shortest) :].tolist() == second.shortest.tolist()


@pytest.mark.slow
def test_the_printed_savings_are_met() -> None:
    table = path_table()
    assert len(table.shortest) > 3800
    assert table.gains[0] == pytest.approx(PRINTED_SAVED, abs=0.015)
    assert table.gains[1] == pytest.approx(PRINTED_LONGER, abs=0.005)
