import math
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from paths_grids import SQRT2, cells_of, is_legal, is_open, masks
from scipy.sparse import csr_array
from scipy.sparse.csgraph import dijkstra
from support.maps.drawn_maps import carrier

from marsupial.errors import UsageError
from marsupial.model import Cell, EnergyModel, Mask
from marsupial.paths.energy import EnergySearch, MotionCosts, costs_of, route_energy
from marsupial.paths.fields import PathSearch
from marsupial.paths.routes import STEPS, route_length

PAPER = MotionCosts()
OPEN = np.ones((40, 40), dtype=np.bool_)

energies = st.floats(0, 30, allow_subnormal=False)
motions = st.builds(MotionCosts, distance=st.floats(0.05, 20), stop=energies, turn=st.tuples(*[energies] * 4))
facing = st.one_of(st.none(), st.integers(0, 7))


def changing(motion: MotionCosts, before: int, after: int) -> float:
    turn = min((before - after) % 8, (after - before) % 8)
    return 0.0 if turn == 0 else motion.stop + motion.turn[turn - 1]


def least_energies(
    passable: Mask,
    motion: MotionCosts,
    source: Cell,
    heading: int | None,
    *,
    diagonal: float = SQRT2,
    cuts: bool = False,
) -> np.ndarray:
    """Return scipy's least energies from `source` to all cells, by the graph of the paper with a node per state."""
    height, width = passable.shape
    if not is_open(passable, source):
        return np.full(passable.shape, np.inf)
    starts, ends, weights = [], [], []

    def node(cell: Cell, ahead: int) -> int:
        return 1 + 8 * (cell.y * width + cell.x) + ahead

    def add(start: int, end: int, weight: float) -> None:
        starts.append(start)
        ends.append(end)
        weights.append(weight + 1e-300)  # scipy ignores edges of weight 0

    for a in (Cell(x, y) for y in range(height) for x in range(width)):
        for ahead, (dx, dy) in enumerate(STEPS):
            b = Cell(a.x + dx, a.y + dy)
            ends_open = is_open(passable, a) and is_open(passable, b)
            if is_legal(passable, a, b) or (cuts and ends_open):
                for after in range(8):
                    drive = motion.distance * (diagonal if ahead & 1 else 1.0)
                    add(node(a, ahead), node(b, after), drive + changing(motion, ahead, after))
    for ahead in range(8):
        add(0, node(source, ahead), 0.0 if heading is None else changing(motion, heading, ahead))
    graph = csr_array((weights, (starts, ends)), shape=(1 + 8 * passable.size,) * 2)
    costs = np.asarray(dijkstra(graph, indices=0))[1:].reshape(height, width, 8)
    # the least energy at a cell is that of the arriving heading
    least = costs.min(axis=2)
    least[source.y, source.x] = 0.0
    return least


@given(st.data())
def test_fields_are_those_of_the_graph_of_states(data: st.DataObject) -> None:
    passable, motion, heading = data.draw(masks()), data.draw(motions), data.draw(facing)
    source, cuts = data.draw(cells_of(passable, margin=1)), data.draw(st.booleans())
    diagonal = data.draw(st.sampled_from((1.0, 1.2, SQRT2)))
    field = EnergySearch(passable, motion, diagonal=diagonal, cuts_corners=cuts).field(source, heading)
    expected = least_energies(passable, motion, source, heading, diagonal=diagonal, cuts=cuts)
    assert field == pytest.approx(expected, rel=1e-8, abs=1e-8)


@given(st.data())
def test_costs_lengths_and_routes_fit_together(data: st.DataObject) -> None:
    passable, motion, heading = data.draw(masks()), data.draw(motions), data.draw(facing)
    source = data.draw(cells_of(passable, margin=1))
    wanted = data.draw(st.lists(cells_of(passable, margin=1), max_size=6))
    search = EnergySearch(passable, motion)
    field = search.field(source, heading)
    costs, lengths = search.costs(source, wanted, heading), search.lengths(source, wanted, heading)
    for cell, cost, length in zip(wanted, costs, lengths, strict=True):
        route = search.route(source, cell, heading)
        assert cost == (pytest.approx(field[cell.y, cell.x], rel=1e-8) if is_open(passable, cell) else np.inf)
        if route is None:
            assert (cost, length) == (np.inf, np.inf)
            continue
        assert (route[0], route[-1]) == (source, cell)
        assert all(is_legal(passable, a, b) for a, b in pairwise(route))
        assert route_energy(route, motion, heading) == pytest.approx(cost)
        assert route_length(route) == pytest.approx(length)


@given(st.data())
def test_one_search_after_the_other_is_as_each_alone(data: st.DataObject) -> None:
    first = data.draw(masks())
    second = data.draw(masks().filter(lambda mask: mask.shape == first.shape) | st.just(~first))
    shared = EnergySearch(first, PAPER)
    for passable in (first, second, first):
        shared.passable = passable
        cells = data.draw(st.lists(cells_of(passable), max_size=4))
        headings = data.draw(st.lists(facing, min_size=len(cells), max_size=len(cells)))
        alone = EnergySearch(passable, PAPER).matrix(cells, headings)
        assert shared.matrix(cells, headings).tolist() == alone.tolist()


@given(st.data())
def test_a_matrix_has_the_ways_from_each_cell_to_each(data: st.DataObject) -> None:
    passable = data.draw(masks())
    cells = data.draw(st.lists(cells_of(passable, margin=1), max_size=5))
    headings = data.draw(st.lists(facing, min_size=len(cells), max_size=len(cells)))
    search = EnergySearch(passable, PAPER)
    table = search.matrix(cells, headings)
    for i, (cell, heading) in enumerate(zip(cells, headings, strict=True)):
        assert table[i] == pytest.approx(search.lengths(cell, cells, heading))
    assert search.matrix(cells) == pytest.approx(search.matrix(cells).T)


@given(st.data())
def test_where_stops_and_turns_take_nothing_ways_are_the_shortest(data: st.DataObject) -> None:
    passable = data.draw(masks())
    source = data.draw(cells_of(passable))
    search = EnergySearch(passable, MotionCosts(distance=2.0, stop=0.0, turn=(0.0, 0.0, 0.0, 0.0)))
    assert search.field(source) == pytest.approx(2.0 * PathSearch(passable).field(source))


def test_of_ways_of_the_same_energy_the_shortest_is_taken() -> None:
    # two turns of 45 degrees cost as much as the two cells that a diagonal saves
    passable = np.ones((4, 4), dtype=np.bool_)
    search = EnergySearch(passable, MotionCosts(stop=0.0, turn=(2 - SQRT2, 2 * (2 - SQRT2), 9.0, 9.0)))
    assert search.costs(Cell(0, 0), [Cell(2, 1)]) == pytest.approx([3.0])
    assert search.lengths(Cell(0, 0), [Cell(2, 1)]) == pytest.approx([1 + SQRT2])


def test_the_worked_route_of_the_paper() -> None:
    """Fig. 7: straight, diagonal and straight steps with two turns, length 36.21 and energy 38.01."""
    route = [Cell(x, 0) for x in range(12)] + [Cell(11 + k, k) for k in range(1, 16)]
    route += [Cell(26, y) for y in range(16, 20)]
    assert route_length(route) == pytest.approx(36.21, abs=0.005)
    assert route_energy(route, PAPER) == pytest.approx(38.01, abs=0.005)


def test_turns_that_cost_hundreds_of_cells_are_searched_as_well() -> None:
    motion = MotionCosts(distance=0.01, stop=5.0, turn=(1.0, 2.0, 3.0, 4.0))
    field = EnergySearch(OPEN, motion).field(Cell(3, 3))
    assert field[3, 9] == pytest.approx(0.06)
    assert field[4, 9] == pytest.approx(6 + 0.01 * (5 + SQRT2))
    assert field == pytest.approx(least_energies(OPEN, motion, Cell(3, 3), None))


@pytest.mark.parametrize("wrong", [{"distance": 0.0}, {"stop": -1.0}, {"turn": (0.0, 0.0, 0.0, math.nan)}])
def test_costs_that_make_no_sense_are_refused(wrong: dict[str, float]) -> None:
    with pytest.raises(UsageError):
        MotionCosts(**wrong)


def test_the_costs_of_a_robot_type_are_in_joules_per_cell() -> None:
    energy = EnergyModel(idle_w=7.0, drive_w=10.0, metre_j=3.0, stop_j=1.0, turn_j=(0.1, 0.2, 0.3, 0.4))
    kind = replace(carrier(), speed_mps=0.5, energy=energy)
    assert costs_of(kind, 1.0) == MotionCosts(distance=23.0, stop=1.0, turn=(0.1, 0.2, 0.3, 0.4))
