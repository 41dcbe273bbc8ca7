from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from paths_grids import SQRT2, all_lengths, cells_of, drawn, is_legal, is_open, masks

from marsupial.model.grid import Cell, Mask
from marsupial.paths.fields import PathSearch
from marsupial.paths.routes import route_length


def scipy_costs(passable: Mask, source: Cell, wanted: list[Cell]) -> list[float]:
    table, width = all_lengths(passable), passable.shape[1]
    if not is_open(passable, source):
        return [np.inf] * len(wanted)
    row = table[source.y * width + source.x]
    return [row[cell.y * width + cell.x] if is_open(passable, cell) else np.inf for cell in wanted]


@given(masks(), st.sampled_from((1.0, 1.2, SQRT2)), st.data())
def test_diagonals_of_any_length_up_to_root_two_give_the_lengths_scipy_finds(
    passable: Mask, diagonal: float, data: st.DataObject
) -> None:
    source = data.draw(cells_of(passable))
    field = PathSearch(passable, diagonal).field(source)
    row = all_lengths(passable, diagonal)[source.y * passable.shape[1] + source.x]
    expected = row.reshape(passable.shape) if is_open(passable, source) else np.full(passable.shape, np.inf)
    assert field == pytest.approx(expected)


def test_nothing_is_reached_from_impassable_ground_or_outside_the_grid():
    search = PathSearch(drawn("#."))
    assert search.field(Cell(0, 0)).tolist() == [[np.inf, np.inf]]
    assert search.lengths(Cell(0, 0), [Cell(0, 0), Cell(1, 0)]).tolist() == [np.inf, np.inf]
    assert search.route(Cell(0, 0), Cell(0, 0)) is None
    search = PathSearch(drawn(".."))
    assert np.isinf(search.field(Cell(0, -1))).all()
    assert search.lengths(Cell(0, 0), [Cell(2, 0), Cell(-1, 0), Cell(1, 0)]).tolist() == [np.inf, np.inf, 1.0]
    assert search.route(Cell(0, 0), Cell(2, 0)) is None


def test_no_wanted_cells_give_no_costs():
    search = PathSearch(drawn(".."))
    assert search.lengths(Cell(0, 0), []).shape == (0,)
    assert search.matrix([]).shape == (0, 0)


def test_a_limit_met_by_diagonals_alone_still_counts():
    field = PathSearch(np.ones((8, 8), dtype=np.bool_)).field(Cell(0, 0), limit=7 * SQRT2)
    assert np.isfinite(field).all()


def test_a_change_of_the_mask_is_seen_by_the_next_call():
    passable = drawn("...", "...", "...")
    search = PathSearch(passable)
    assert search.lengths(Cell(0, 1), [Cell(2, 1)]) == pytest.approx([2.0])
    passable[1, 1] = False
    assert search.lengths(Cell(0, 1), [Cell(2, 1)]) == pytest.approx([4.0])
    passable[:, 1] = False
    assert search.lengths(Cell(0, 1), [Cell(2, 1)]).tolist() == [np.inf]
    assert search.route(Cell(0, 1), Cell(2, 1)) is None
    passable[:] = True
    assert search.matrix([Cell(0, 1), Cell(2, 1)]) == pytest.approx(np.array([[0.0, 2.0], [2.0, 0.0]]))


def test_a_result_is_not_changed_by_later_searches():
    search = PathSearch(drawn("..."))
    field = search.field(Cell(0, 0))
    search.field(Cell(2, 0))
    assert field.tolist() == [[0.0, 1.0, 2.0]]


def test_a_matrix_takes_duplicates_and_impassable_cells():
    search = PathSearch(drawn("..#."))
    matrix = search.matrix([Cell(1, 0), Cell(0, 0), Cell(1, 0), Cell(2, 0), Cell(2, 0), Cell(3, 0)])
    far = np.inf
    expected = [[0, 1, 0, far, far, far], [1, 0, 1, far, far, far], [0, 1, 0, far, far, far]]
    expected += [[far] * 6, [far] * 6, [far] * 5 + [0]]
    assert matrix.tolist() == expected


def test_a_route_in_the_open_bends_as_little_as_it_can():
    route = PathSearch(np.ones((5, 9), dtype=np.bool_)).route(Cell(0, 0), Cell(8, 4))
    assert route is not None
    steps = [(b.x - a.x, b.y - a.y) for a, b in pairwise(route)]
    assert sum(a != b for a, b in pairwise(steps)) == 1


@given(st.data())
def test_fields_and_costs_are_those_of_scipy(data: st.DataObject):
    passable = data.draw(masks())
    search, table = PathSearch(passable), all_lengths(passable)
    for source in data.draw(st.lists(cells_of(passable), min_size=1, max_size=3)):
        row = table[source.y * passable.shape[1] + source.x].reshape(passable.shape)
        limit = data.draw(st.sampled_from((np.inf, 0.0, 2.5, 4.0)))
        assert search.field(source, limit=limit) == pytest.approx(np.where(row <= limit, row, np.inf), abs=1e-9)
        wanted = data.draw(st.lists(cells_of(passable, margin=2), max_size=6))
        assert search.lengths(source, wanted) == pytest.approx(scipy_costs(passable, source, wanted), abs=1e-9)


@given(st.data())
def test_matrices_are_those_of_scipy_and_symmetric(data: st.DataObject):
    passable = data.draw(masks())
    cells = data.draw(st.lists(cells_of(passable, margin=1), max_size=8))
    matrix = PathSearch(passable).matrix(cells)
    expected = np.array([scipy_costs(passable, cell, cells) for cell in cells]).reshape(len(cells), len(cells))
    assert matrix == pytest.approx(expected, abs=1e-9)
    assert np.array_equal(matrix, matrix.T)


@given(st.data())
def test_routes_are_legal_shortest_and_always_the_same(data: st.DataObject):
    passable = data.draw(masks())
    start, goal = data.draw(cells_of(passable, margin=1)), data.draw(cells_of(passable, margin=1))
    search = PathSearch(passable)
    route, cost = search.route(start, goal), scipy_costs(passable, start, [goal])[0]
    assert route == PathSearch(passable.copy()).route(start, goal) == search.route(start, goal)
    if route is None:
        assert cost == np.inf
        return
    assert (route[0], route[-1]) == (start, goal)
    assert all(is_legal(passable, a, b) for a, b in pairwise(route))
    assert route_length(route) == pytest.approx(cost, abs=1e-9)


@given(st.data())
@settings(max_examples=40)
def test_searches_on_a_changing_mask_are_those_of_fresh_ones(data: st.DataObject):
    passable = data.draw(masks(12))
    search = PathSearch(passable)
    for _ in range(4):
        cell = data.draw(cells_of(passable))
        passable[cell.y, cell.x] = not passable[cell.y, cell.x]
        source, limit = data.draw(cells_of(passable)), data.draw(st.sampled_from((np.inf, 3.0)))
        assert np.array_equal(search.field(source, limit=limit), PathSearch(passable).field(source, limit=limit))
