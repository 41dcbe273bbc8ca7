"""The searches in plain C: they find what ours find."""

from __future__ import annotations

import ctypes

import numpy as np
import pytest
from drawn_maps import mask_of

from benchmarks.speed import reference
from benchmarks.speed.drawn import MASKS
from benchmarks.speed.reference import BUCKETS, HEAP, NotCompiled, PlainSearch, PlainSight, compiled
from marsupial.maps.sight import Sight
from marsupial.model.grid import FLOOR, OBSTACLE, ROUGH, UNKNOWN, Cell, Grid, Mask
from marsupial.model.robots import SQRT2
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


@pytest.mark.parametrize("queue", [HEAP, BUCKETS])
def test_a_search_in_c_that_stops_at_a_cell_has_its_distance(queue: int) -> None:
    passable = MASKS["rand20"](90, 2)
    start, *goals = some_cells(passable, 8)
    plain, ours = PlainSearch(library("dijkstra"), passable, queue), PathSearch(passable).field(start)
    for goal in goals:
        assert plain.field(start, goal)[goal.y, goal.x] == pytest.approx(ours[goal.y, goal.x], abs=1e-6)


@pytest.mark.parametrize("queue", [HEAP, BUCKETS])
def test_a_diagonal_in_c_needs_both_cells_beside_it(queue: int) -> None:
    passable = mask_of(
        "xx.",
        "xxx",
        ".xx",
    )
    field = PlainSearch(library("dijkstra"), passable, queue).field(Cell(1, 1))
    assert field[::-1].tolist() == [
        [pytest.approx(SQRT2), 1, np.inf],
        [1, 0, 1],
        [np.inf, 1, pytest.approx(SQRT2)],
    ]
    assert PlainSearch(library("dijkstra"), passable, queue).field(Cell(0, 1))[2, 0] == 1


@pytest.mark.parametrize("reach", [0.0, 3.0, 7.5, 100.0])
def test_views_in_c_are_ours(reach: float) -> None:
    drawn = np.random.default_rng(8).random((60, 47))
    codes = np.select([drawn < 0.08, drawn < 0.3, drawn < 0.32], [OBSTACLE, ROUGH, UNKNOWN], FLOOR).astype(np.uint8)
    grid = Grid(cells=codes, resolution_m=0.1)
    plain, ours = PlainSight(library("sight"), grid), Sight(grid.cells, grid.opaque_codes())
    for cell in [Cell(0, 0), Cell(46, 59), *some_cells(codes == FLOOR, 40)]:
        assert sorted(plain.visible(cell, reach)) == sorted(ours.visible(cell, reach))


def test_what_a_compiler_says_against_a_source_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    library("dijkstra")
    monkeypatch.setattr(reference, "COMPILER", ("cc", "-no-such-option", "-shared"))
    found = compiled.__wrapped__("dijkstra")
    assert isinstance(found, NotCompiled)
    assert found.reason.startswith("cc -no-such-option -shared failed: ")
    assert "no-such-option" in found.reason.partition("failed: ")[2]
