import numpy as np
import pytest
from at_once import grow
from hypothesis import given, settings
from hypothesis import strategies as st
from paths_grids import all_lengths, drawn, masks

from marsupial.model.grid import Cell, Mask


def brute_force(passable: Mask, sources: Mask, limit: float) -> tuple[np.ndarray, np.ndarray]:
    """Nearest source of each cell from the distances between all cells, the lowest index among equals."""
    numbers = np.flatnonzero(sources & passable)
    if not numbers.size:
        return np.full(passable.shape, np.inf), np.full(passable.shape, -1)
    lengths = all_lengths(passable)[numbers]
    nearest = lengths.min(axis=0)
    origins = numbers[np.argmax(lengths <= nearest + 1e-9, axis=0)]
    reached = np.isfinite(nearest) & (nearest <= limit + 1e-9)
    return (
        np.where(reached, nearest, np.inf).reshape(passable.shape),
        np.where(reached, origins, -1).reshape(passable.shape),
    )


def test_sources_on_impassable_ground_or_outside_are_left_out():
    distances, origins = grow(drawn("#.."), [Cell(0, 0), Cell(9, 9), Cell(2, 0), Cell(2, 0)], 1.0)
    assert distances.tolist() == [[np.inf, 1.0, 0.0]]
    assert origins.tolist() == [[-1, 2, 2]]


def test_no_sources_reach_nothing():
    for sources in ([], np.zeros((2, 3), dtype=np.bool_)):
        distances, origins = grow(drawn("...", "..."), sources, 5.0)
        assert np.isinf(distances).all()
        assert (origins == -1).all()


@given(st.data())
@settings(deadline=None, max_examples=150)
def test_growth_is_that_of_brute_force(data: st.DataObject):
    passable = data.draw(masks(12))
    seed, share = data.draw(st.integers(0, 2**32 - 1)), data.draw(st.sampled_from((0.02, 0.2, 0.7, 1.0)))
    sources = np.random.default_rng(seed).random(passable.shape) < share
    limit = data.draw(st.sampled_from((0.0, 1.0, 2.5, 4.0, np.inf)))
    distances, origins = grow(passable, sources, limit)
    expected_distances, expected_origins = brute_force(passable, sources, limit)
    assert distances == pytest.approx(expected_distances, abs=1e-9)
    assert np.array_equal(origins, expected_origins)
