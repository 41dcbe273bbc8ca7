from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from paths_grids import drawn, masks

from marsupial.model.grid import Cell, Mask
from marsupial.paths.distances import Distances
from marsupial.paths.fields import PathSearch


class Counting(PathSearch):
    """Counts the cells searched from, one by one."""

    def __init__(self, passable: Mask) -> None:
        super().__init__(passable)
        self.searched = 0

    def costs(self, source, wanted):  # type: ignore[no-untyped-def]
        self.searched += 1
        return super().costs(source, wanted)


def opened(passable: Mask, *cells: Cell) -> np.ndarray:
    for cell in cells:
        passable[cell.y, cell.x] = True
    return np.array([cell.y * passable.shape[1] + cell.x for cell in cells], dtype=np.int64)


def test_a_pair_asked_for_again_is_not_searched_again() -> None:
    search = Counting(drawn("......"))
    distances = Distances(search)
    cells = [Cell(0, 0), Cell(2, 0), Cell(3, 0)]
    first = distances.matrix(cells)
    assert distances.matrix(cells).tolist() == first.tolist()
    assert search.searched == 0
    assert distances.matrix([*cells, Cell(5, 0)])[3].tolist() == [5, 3, 2, 0]
    assert search.searched == 1


def test_a_shortcut_that_opens_far_from_a_pair_costs_it_no_search() -> None:
    passable = drawn(
        "........#.",
        "........#.",
    )
    search = Counting(passable)
    distances = Distances(search)
    cells = [Cell(0, 0), Cell(1, 0), Cell(1, 1)]
    distances.matrix(cells)
    distances.open(opened(passable, Cell(8, 0), Cell(8, 1)))
    distances.matrix(cells)
    assert search.searched == 0


def test_a_diagonal_set_free_by_a_cell_beside_it_counts() -> None:
    passable = drawn(
        "...",
        ".#.",
        "...",
    )
    distances = Distances(PathSearch(passable))
    cells = [Cell(0, 1), Cell(1, 2), Cell(2, 1)]
    assert distances.matrix(cells)[0].tolist() == [0, 2, 4]
    distances.open(opened(passable, Cell(1, 1)))
    assert distances.matrix(cells)[0].tolist() == [0, 2**0.5, 2]


def test_a_wall_between_cells_is_no_distance_until_it_opens() -> None:
    passable = drawn("..#..")
    distances = Distances(PathSearch(passable))
    cells = [Cell(0, 0), Cell(1, 0), Cell(3, 0), Cell(2, 0)]
    assert np.isinf(distances.matrix(cells)[0]).tolist() == [False, False, True, True]
    distances.open(opened(passable, Cell(2, 0)))
    assert distances.matrix(cells)[0].tolist() == [0, 1, 3, 2]


@settings(deadline=None)
@given(truth=masks(most=8), data=st.data())
def test_distances_kept_equal_distances_searched(truth: Mask, data: st.DataObject) -> None:
    height, width = truth.shape
    passable = truth & np.random.default_rng(data.draw(st.integers(0, 99))).integers(0, 2, truth.shape).astype(np.bool_)
    distances = Distances(PathSearch(passable))
    cells = st.lists(st.builds(Cell, st.integers(0, width - 1), st.integers(0, height - 1)), min_size=1, max_size=8)
    asked = data.draw(cells)
    for _ in range(data.draw(st.integers(1, 5))):
        asked = data.draw(st.lists(st.sampled_from(asked), max_size=6)) + data.draw(cells)[:3]
        expected = PathSearch(passable).matrix(asked)
        assert np.allclose(distances.matrix(asked), expected, rtol=0, atol=1e-9)
        closed = [cell for cell in data.draw(cells) if truth[cell.y, cell.x] and not passable[cell.y, cell.x]]
        distances.open(opened(passable, *closed))
