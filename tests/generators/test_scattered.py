from __future__ import annotations

import numpy as np
import pytest

from marsupial.generators.papers import scattered
from marsupial.model.grid import FLOOR, OBSTACLE


@pytest.mark.parametrize(("columns", "rows", "obstacles"), [(25, 25, 0), (25, 20, 10), (31, 31, 40), (2, 2, 4)])
def test_there_are_as_many_obstacles_of_one_cell_as_asked_for(columns: int, rows: int, obstacles: int) -> None:
    grid = scattered(columns, rows, obstacles, seed=1)
    assert (grid.width, grid.height, grid.resolution_m) == (columns, rows, 1.0)
    assert np.count_nonzero(grid.cells == OBSTACLE) == obstacles
    assert np.count_nonzero(grid.cells == FLOOR) == columns * rows - obstacles


def test_the_seed_says_where_they_are() -> None:
    assert scattered(25, 25, 20, seed=1).cells.tobytes() == scattered(25, 25, 20, seed=1).cells.tobytes()
    assert len({scattered(25, 25, 20, seed=seed).cells.tobytes() for seed in range(8)}) == 8
