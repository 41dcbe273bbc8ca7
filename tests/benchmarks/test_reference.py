"""The reference searches in plain C find the same as ours."""

import ctypes

import numpy as np
import pytest

from benchmarks.speed.drawn import MASKS
from benchmarks.speed.reference import BUCKETS, HEAP, NotCompiled, PlainSearch, PlainSight, compiled
from marsupial.maps.sight import Sight
from marsupial.model.grid import FLOOR, OBSTACLE, ROUGH, UNKNOWN, Cell, Grid, Mask
from marsupial.paths.fields import PathSearch


def library(name: str) -> ctypes.CDLL:
    found = compiled(name)
    if isinstance(found, NotCompiled):
        pytest.skip(found.reason)
    return found


def some_cells(passable: Mask, count: int) -> list[Cell]:
    y, x = np.nonzero(passable)
    drawn = np.random.default_rng(4).choice(x.size, count, replace=False)
    return [Cell(int(x[i]), int(y[i])) for i in drawn]


@pytest.mark.parametrize("queue", [HEAP, BUCKETS])
@pytest.mark.parametrize("name", MASKS)
def test_distances_in_c_are_ours(name: str, queue: int) -> None:
    passable = MASKS[name](120, 2)[:80]
    cells = some_cells(passable, 9)
    plain, ours = PlainSearch(library("dijkstra"), passable, queue), PathSearch(passable)
    for cell in cells:
        np.testing.assert_allclose(plain.field(cell), ours.field(cell), atol=1e-6, rtol=0)
    np.testing.assert_allclose(plain.matrix(cells), ours.matrix(cells), atol=1e-6, rtol=0)


@pytest.mark.parametrize("reach", [0.0, 3.0, 7.5, 100.0])
def test_views_in_c_are_ours(reach: float) -> None:
    drawn = np.random.default_rng(8).random((60, 47))
    codes = np.select([drawn < 0.08, drawn < 0.3, drawn < 0.32], [OBSTACLE, ROUGH, UNKNOWN], FLOOR).astype(np.uint8)
    grid = Grid(cells=codes, resolution_m=0.1)
    plain, ours = PlainSight(library("sight"), grid), Sight(grid.cells, grid.opaque_codes())
    for cell in [Cell(0, 0), Cell(46, 59), *some_cells(codes == FLOOR, 40)]:
        assert sorted(plain.visible(cell, reach)) == sorted(ours.visible(cell, reach))
