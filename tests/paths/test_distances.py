import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from paths_grids import SQRT2, all_lengths

from marsupial.arrays import Floats, Ints
from marsupial.model.grid import Cell, Mask
from marsupial.paths.distances import Distances
from marsupial.paths.fields import PathSearch
from marsupial.paths.openings import SIDE, openings


class Searches:
    """Cached distances on a mask, and the number of searches for them."""

    def __init__(self, passable: Mask, diagonal: float = SQRT2) -> None:
        self.passable, self.diagonal = passable, diagonal
        self.distances = Distances(passable, diagonal)
        self.count = 0

    def between(self, *cells: int) -> Floats:
        width = self.passable.shape[1]
        on_ground = PathSearch(self.passable, self.diagonal)

        def search(source: int, wanted: Ints) -> Floats:
            self.count += 1
            return on_ground.field(Cell(source % width, source // width)).ravel()[wanted]

        return self.distances.between(np.array(cells, dtype=np.int64), search)

    def open(self, *cells: int) -> None:
        self.passable.ravel()[list(cells)] = True
        self.distances.opened(np.array(cells, dtype=np.int64))


def rooms(size: int, rng: np.random.Generator) -> Mask:
    """Draw rooms of 7 x 7 cells with one or two doors each, so that most cells have few paths between them."""
    mask = np.ones((size, size), dtype=np.bool_)
    mask[7::8], mask[:, 7::8] = False, False
    for low in range(7, size, 8):
        for middle in range(0, size, 8):
            mask[low, middle + rng.integers(7) : middle + rng.integers(1, 8)] = True
            mask[middle + rng.integers(7) : middle + rng.integers(1, 8), low] = True
    return mask


def test_a_diagonal_beside_a_cell_that_was_opened_is_a_new_way() -> None:
    size = 2 * SIDE
    beside = SIDE * size + SIDE - 1, (SIDE - 1) * size + SIDE  # neither is in the square around the cell
    mask = np.ones((size, size), dtype=np.bool_)
    mask[SIDE, SIDE] = False
    searches = Searches(mask)
    assert searches.between(*beside)[0, 1] == 2.0
    searches.open(SIDE * size + SIDE)
    assert searches.between(*beside)[0, 1] == SQRT2


def test_a_search_from_new_cells_shows_that_the_other_distances_are_unchanged() -> None:
    """On a comb, where the tips of the teeth are close only by straight-line distance."""
    mask = np.zeros((9, 41), dtype=np.bool_)
    mask[0], mask[:8, ::5] = True, True
    searches = Searches(mask)
    tips = [7 * 41 + x for x in range(0, 41, 10)]
    before, count = searches.between(*tips), searches.count
    searches.open(8 * 41 + 15)
    after = searches.between(*tips, 8 * 41 + 15)
    assert np.array_equal(after[:-1, :-1], before)
    assert after[-1, 1] == 20.0
    assert searches.count == count + 1


def test_a_cell_that_is_new_costs_one_search_and_those_that_are_known_none() -> None:
    mask = np.ones((1, 30), dtype=np.bool_)
    mask[0, 29] = False
    searches = Searches(mask)
    searches.between(0, 5, 10, 20)
    count = searches.count
    searches.open(29)
    assert searches.between(5, 10, 20, 29)[3].tolist() == [24, 19, 9, 0]
    assert searches.count == count + 1


def test_separate_places_are_searched_again_only_if_they_may_now_be_connected() -> None:
    mask = np.ones((3, 30), dtype=np.bool_)
    mask[:, 10], mask[:, 20] = False, False
    searches = Searches(mask)
    assert np.isinf(searches.between(0, 1, 15, 16, 29)[0, 2:]).all()
    searches.open(40)
    found = searches.between(0, 1, 15, 16, 29)
    assert np.isfinite(found[:4, :4]).all()
    assert np.isinf(found[4, :4]).all()


@settings(max_examples=30)
@given(st.integers(0, 9999), st.sampled_from((1.0, 1.2, SQRT2)))
def test_distances_stay_those_of_dijkstra_while_rooms_are_opened(seed: int, diagonal: float) -> None:
    """Rooms are opened from one corner, a few cells at a time, with permanent and temporary places."""
    rng = np.random.default_rng(seed)
    whole = rooms(19, rng) & (rng.random((19, 19)) < rng.choice([0.85, 1.0]))
    inside = np.flatnonzero(whole)
    order = inside[np.argsort(inside % 19 + inside // 19 + rng.uniform(0, 6, inside.size))]
    mask = np.zeros_like(whole)
    searches = Searches(mask, diagonal)
    known, kept = np.empty(0, dtype=np.int64), np.empty(0, dtype=np.int64)
    for part in np.array_split(order, 6):
        searches.open(*part[::2])
        searches.open(*part[1::2])
        known = np.concatenate([known, part])
        places = np.unique(np.concatenate([rng.permutation(kept)[:9], rng.choice(known, 4)]))
        expected = all_lengths(mask, diagonal)[np.ix_(places, places)]
        assert searches.between(*places) == pytest.approx(expected, abs=1e-9)
        kept = places


@given(st.integers(0, 9999), st.sampled_from((1.0, SQRT2)))
def test_no_way_is_shorter_than_by_what_was_opened(seed: int, diagonal: float) -> None:
    rng = np.random.default_rng(seed)
    mask = rng.random((15, 20)) < rng.choice([0.3, 0.6, 0.9])
    opened = np.flatnonzero(mask)[rng.random(np.count_nonzero(mask)) < rng.choice([0.02, 0.2])]
    old = mask.copy()
    old.ravel()[opened] = False
    before, now = all_lengths(old, diagonal), all_lengths(mask, diagonal)
    found = openings(mask, opened, diagonal)
    by = np.full_like(now, np.inf)
    for cell, error in zip(found.cells, found.errors, strict=True):
        by = np.minimum(by, now[:, cell, None] + now[None, cell] - error)
    were = np.flatnonzero(old)
    shorter = (now < before - 1e-9)[np.ix_(were, were)]
    assert (by <= now + 1e-9)[np.ix_(were, were)][shorter].all()
