"""Runs encode cells without loss."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays

from marsupial.model.grid import UNKNOWN
from marsupial.model.runs import cells_in, known_runs, paint, run_table, runs_fault, runs_of

MAP = np.array([[1, 1, 1, 2], [2, 2, 0, 0]], dtype=np.uint8)
RUNS = (0, 3, 1, 3, 3, 2, 6, 2, 0)


def test_equal_neighbours_are_one_run_over_the_end_of_a_row_too() -> None:
    assert known_runs(MAP) == RUNS
    assert run_table(RUNS).tolist() == [[0, 3, 1], [3, 3, 2], [6, 2, 0]]


def test_unknown_cells_are_in_no_run() -> None:
    assert known_runs(np.array([[UNKNOWN, 1], [UNKNOWN, UNKNOWN]], dtype=np.uint8)) == (1, 1, 1)
    assert cells_in(())[0].tolist() == []


def test_cells_come_in_the_order_of_the_runs() -> None:
    indices, codes = cells_in((6, 2, 0, 1, 2, 1))
    assert indices.tolist() == [6, 7, 1, 2]
    assert codes.tolist() == [0, 0, 1, 1]


@given(arrays.arrays(np.uint8, st.tuples(st.integers(1, 6), st.integers(1, 6)), elements=st.sampled_from([0, 1, 255])))
def test_a_map_painted_with_its_runs_is_the_same_map(cells: np.ndarray) -> None:
    painted = np.full_like(cells, UNKNOWN)
    paint(painted, known_runs(cells))
    assert (painted == cells).all()
    indices, codes = cells_in(known_runs(cells))
    assert (cells.ravel()[indices] == codes).all()
    assert runs_fault(known_runs(cells), cells.size, {0, 1}) is None
    assert runs_of(np.flatnonzero(cells != UNKNOWN), cells.ravel()) == known_runs(cells)


@pytest.mark.parametrize(
    ("runs", "fault"),
    [
        ((0, 1), "three by three"),
        ((2, 2, 1, 3, 1, 1), "ascending order"),
        ((7, 2, 1), "inside the map"),
        ((0, 0, 1), "inside the map"),
        ((0, 1, 9), "no terrain of code 9; there are 0, 1"),
    ],
)
def test_runs_that_are_no_part_of_the_map_are_refused(runs: tuple[int, ...], fault: str) -> None:
    assert fault in (runs_fault(runs, 8, {0, 1}) or "")
