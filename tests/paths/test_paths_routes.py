import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from marsupial.model import UNREACHABLE, Cell
from marsupial.paths.routes import passing_times_ms, route_length, route_of, steps_of, travel_table_ms

STEP_TEXTS = st.text("01234567", max_size=60)


def travel_ms(length_cells: float, resolution_m: float, speed_mps: float) -> int:
    return int(travel_table_ms(np.array([length_cells]), resolution_m, speed_mps)[0])


def test_digits_count_counter_clockwise_from_east():
    ends = [route_of(Cell(5, 5), digit)[1] for digit in "01234567"]
    assert ends == [(6, 5), (6, 6), (5, 6), (4, 6), (4, 5), (4, 4), (5, 4), (6, 4)]


def test_a_single_cell_is_a_route_without_steps():
    route = route_of(Cell(3, 4), "")
    assert (route, steps_of(route), route_length(route)) == ((Cell(3, 4),), "", 0.0)
    assert passing_times_ms(route, 0.05, 1.0).tolist() == [0]


@given(st.integers(-50, 50), st.integers(-50, 50), STEP_TEXTS)
def test_steps_come_back(x: int, y: int, steps: str):
    route = route_of(Cell(x, y), steps)
    assert steps_of(route) == steps
    assert route[0] == Cell(x, y)
    assert len(route) == len(steps) + 1


def test_a_jump_is_not_a_step():
    with pytest.raises(KeyError):
        steps_of([Cell(0, 0), Cell(2, 0)])


def test_diagonals_are_root_two_long():
    assert route_length(route_of(Cell(0, 0), "0123")) == pytest.approx(2 + 2 * np.sqrt(2))


def test_travel_time_is_length_over_speed():
    assert travel_ms(10.0, 0.5, 2.0) == 2500
    assert travel_ms(np.sqrt(2.0), 1.0, 1.0) == 1414
    assert travel_ms(0.0, 0.05, 1.0) == 0


def test_noise_of_summation_does_not_tip_a_half():
    for noise in (-1e-12, 0.0, 1e-12):
        assert travel_ms(2.5 + noise, 0.001, 1.0) == 3


def test_a_table_marks_what_is_unreachable():
    table = travel_table_ms(np.array([[0.0, np.inf], [2.0, 0.0]]), 0.5, 1.0)
    assert table.dtype == np.int64
    assert table.tolist() == [[0, UNREACHABLE], [1000, 0]]


@given(STEP_TEXTS, st.sampled_from((0.05, 0.1, 1.0)), st.sampled_from((0.3, 0.5, 1.0)))
def test_a_cell_is_passed_after_the_travel_time_to_it(steps: str, resolution: float, speed: float):
    route = route_of(Cell(0, 0), steps)
    times = passing_times_ms(route, resolution, speed)
    assert times.tolist() == [travel_ms(route_length(route[: k + 1]), resolution, speed) for k in range(len(route))]


@given(STEP_TEXTS, st.sampled_from((0.05, 0.1, 1.0)))
def test_the_order_of_steps_does_not_change_the_time(steps: str, resolution: float):
    summed = sum(np.sqrt(2.0) if int(digit) % 2 else 1.0 for digit in steps)
    assert travel_ms(summed, resolution, 0.7) == travel_ms(route_length(route_of(Cell(0, 0), steps)), resolution, 0.7)
