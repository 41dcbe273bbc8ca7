"""Assignments have the least total cost; ties are broken as by scipy."""

import numpy as np
import pytest
from scipy.optimize import linear_sum_assignment

from marsupial.planning.matching import least_assignment


def test_the_least_sum_is_found_where_the_cheapest_pair_is_not_part_of_it() -> None:
    rows, columns = least_assignment(np.array([[1.0, 2.0], [1.0, 4.0]]))
    assert (rows.tolist(), columns.tolist()) == ([0, 1], [1, 0])


@pytest.mark.parametrize("shape", [(0, 0), (0, 3), (3, 0), (1, 1), (1, 5), (5, 1), (4, 4), (3, 8), (8, 3)])
@pytest.mark.parametrize("costs_below", [2, 5, 10**6])
def test_pairs_are_those_that_scipy_finds_ties_included(shape: tuple[int, int], costs_below: int) -> None:
    rng = np.random.default_rng(costs_below)
    for _ in range(50):
        costs = rng.integers(0, costs_below, shape).astype(np.float64)
        costs[rng.random(shape) < 0.3] = 1e12
        assert [each.tolist() for each in least_assignment(costs)] == [
            each.tolist() for each in linear_sum_assignment(costs)
        ]
