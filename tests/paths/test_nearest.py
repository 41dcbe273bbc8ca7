import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from paths_grids import all_lengths, drawn, masks

from marsupial.model import SQRT2, Mask
from marsupial.paths.nearest import Nearest

EVERY = np.arange(100, dtype=np.int64)


def at(*indices: int) -> np.ndarray:
    return np.array(indices, dtype=np.int64)


def test_of_two_sources_equally_near_the_lower_index_counts() -> None:
    nearest = Nearest(drawn("....."), 9.0)
    nearest.add(at(4))
    assert nearest.add(at(0)).tolist() == [0, 1, 2]
    assert nearest.origins(EVERY[:5]).tolist() == [0, 0, 0, 4, 4]


def test_cells_beyond_the_limit_or_behind_a_wall_have_no_source() -> None:
    nearest = Nearest(drawn("...#."), 1.0)
    nearest.add(at(0))
    assert nearest.origins(EVERY[:5]).tolist() == [0, 0, -1, -1, -1]


def test_a_door_that_opens_lets_distances_through() -> None:
    passable = drawn("..#..")
    nearest = Nearest(passable, 9.0)
    nearest.add(at(0))
    passable[0, 2] = True
    assert sorted(nearest.add(at(), at(2)).tolist()) == [2, 3, 4]


@pytest.mark.parametrize("limit", [254.5, 255.0, 300.0, math.inf])
def test_a_way_may_take_hundreds_of_steps_of_either_kind(limit: float) -> None:
    corridor = Nearest(np.ones((1, 400), dtype=np.bool_), limit)
    corridor.add(at(0))
    assert (corridor.origins(np.arange(400)) == 0).tolist() == [steps <= limit for steps in range(400)]
    square = Nearest(np.ones((300, 300), dtype=np.bool_), limit)
    square.add(at(0))
    reached = square.origins(np.arange(300) * 301) == 0
    assert reached.tolist() == [SQRT2 * steps <= limit for steps in range(300)]


def test_asking_once_leaves_nothing_behind() -> None:
    nearest = Nearest(drawn("....."), 9.0)
    assert nearest.once(at(1), EVERY[:5]).tolist() == [1] * 5
    assert nearest.once(at(3), EVERY[:5]).tolist() == [3] * 5
    assert nearest.origins(EVERY[:5]).tolist() == [-1] * 5


def nearest_by_dijkstra(passable: Mask, sources: Mask, limit: float) -> np.ndarray:
    """Return the nearest source of each cell (height, width), the lowest index among equals, -1 for none in reach."""
    numbers = np.flatnonzero(sources)
    if not numbers.size:
        return np.full(passable.shape, -1)
    lengths = all_lengths(passable)[numbers]
    least = lengths.min(axis=0)
    origins = numbers[np.argmax(lengths <= least + 1e-9, axis=0)]
    return np.where(np.isfinite(least) & (least <= limit + 1e-9), origins, -1).reshape(passable.shape)


@given(truth=masks(12), limit=st.sampled_from((0.5, 1.5, 2.5, 4.0, math.inf)), data=st.data())
def test_cells_added_incrementally_have_the_nearest_source(truth: Mask, limit: float, data: st.DataObject) -> None:
    indices = st.lists(st.integers(0, truth.size - 1), max_size=4, unique=True).map(lambda cells: at(*cells))
    passable, sources = np.zeros_like(truth), np.zeros_like(truth)
    nearest = Nearest(passable, limit)
    for _ in range(data.draw(st.integers(1, 5))):
        opened = data.draw(indices)
        opened = opened[truth.ravel()[opened] & ~passable.ravel()[opened]]
        passable.ravel()[opened] = True
        added = data.draw(indices)
        added = added[passable.ravel()[added]]
        sources.ravel()[added] = True
        before = nearest.origins(np.arange(truth.size))
        changed = nearest.add(added, opened)
        after = nearest.origins(np.arange(truth.size))
        assert set(np.flatnonzero(before != after).tolist()) <= set(changed.tolist())
        assert np.array_equal(after, nearest_by_dijkstra(passable, sources, limit).ravel())
