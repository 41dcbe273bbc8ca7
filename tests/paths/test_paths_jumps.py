import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from paths_grids import SQRT2, all_lengths, cells_of

from marsupial.model.grid import Cell, Mask
from marsupial.paths import fields
from marsupial.paths.fields import PathSearch
from marsupial.paths.jumps import Jumps


def built(height: int, width: int, share: float, boxes: int, seed: int) -> Mask:
    """Draw ground wider than a word of bits, with boxes on it and single cells closed."""
    rng = np.random.default_rng(seed)
    mask = rng.random((height, width)) >= share
    for _ in range(boxes):
        y, x = rng.integers(height), rng.integers(width)
        mask[y : y + rng.integers(1, 12), x : x + rng.integers(1, 12)] = False
    return mask


GROUNDS = st.builds(
    built,
    st.integers(1, 70),
    st.integers(1, 150),
    st.sampled_from((0.0, 0.02, 0.1, 0.4)),
    st.integers(0, 12),
    st.integers(0, 9999),
)


@given(GROUNDS, st.sampled_from((1.0, 1.2, SQRT2)), st.integers(0, 9999))
def test_jumps_find_the_lengths_of_the_search_that_settles_every_cell(mask: Mask, diagonal: float, seed: int) -> None:
    cells = np.flatnonzero(mask)
    if not cells.size:
        return
    rng = np.random.default_rng(seed)
    source, wanted = int(rng.choice(cells)), rng.choice(cells, 30)
    width = mask.shape[1]
    jumps = Jumps(mask.shape, diagonal)
    assert jumps.load(mask) is not None
    found = jumps.costs(source, wanted)
    field = PathSearch(mask, diagonal).field(Cell(source % width, source // width))
    assert found == pytest.approx(field.ravel()[wanted], abs=1e-9)


@given(GROUNDS, st.integers(0, 9999))
def test_opened_and_closed_cells_are_detected(mask: Mask, seed: int) -> None:
    rng = np.random.default_rng(seed)
    jumps = Jumps(mask.shape, SQRT2)
    before = mask & (rng.random(mask.shape) < 0.7)
    jumps.load(before)
    opened = jumps.load(mask)
    assert sorted(opened.tolist()) == np.flatnonzero(mask & ~before).tolist()
    if (mask & ~before).any():
        assert jumps.load(before) is None


@given(st.data(), GROUNDS, st.sampled_from((0.0, fields.RAGGED, 10.0)))
def test_a_matrix_stays_that_of_dijkstra_while_the_map_grows(data: st.DataObject, whole: Mask, ragged: float) -> None:
    """A few cached cells change, as places do; after cells are closed, the map counts as a new one."""
    whole = whole[:16, :26]  # a matrix over all cells is large
    rng = np.random.default_rng(data.draw(st.integers(0, 9999)))
    order = rng.permutation(np.flatnonzero(whole))
    mask = np.zeros_like(whole)
    search = PathSearch(mask)
    monkeypatch = pytest.MonkeyPatch()
    monkeypatch.setattr(fields, "RAGGED", ragged)
    places = data.draw(st.lists(cells_of(whole), max_size=9))
    for part in np.array_split(order, 6):
        mask.ravel()[part] = True
        if data.draw(st.integers(0, 5)) == 0:
            mask[rng.integers(mask.shape[0])] = False
        places = [*places[data.draw(st.integers(0, 3)) :], *data.draw(st.lists(cells_of(whole), max_size=4))]
        search.lengths(Cell(0, 0), [Cell(1, 1)])
        found = search.matrix(places)
        lengths = all_lengths(mask)
        at = np.array([cell.y * mask.shape[1] + cell.x for cell in places], dtype=np.int64)
        closed = ~mask.ravel()[at]
        expected = lengths[np.ix_(at, at)]
        expected[closed], expected[:, closed] = np.inf, np.inf
        assert found == pytest.approx(expected, abs=1e-9)
    monkeypatch.undo()


def test_there_is_room_for_all_corners_of_a_wide_map_that_is_all_corners() -> None:
    mask = np.ones((120, 1500), dtype=np.bool_)
    mask[1::2, 1::2] = False
    jumps = Jumps(mask.shape, SQRT2)
    jumps.load(mask)
    wanted = np.array([119 * 1500 + 1499, 1499])
    assert jumps.costs(0, wanted) == pytest.approx(PathSearch(mask).field(Cell(0, 0)).ravel()[wanted])
    assert jumps.steps == 0
