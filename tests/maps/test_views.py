import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from support.maps.drawn_maps import draw, random_cells

from marsupial.arrays import Ints
from marsupial.maps import views
from marsupial.maps.sight import Sight
from marsupial.maps.views import Views
from marsupial.model.grid import FLOOR, OBSTACLE, UNKNOWN, Cell, CellArray, Grid

RANGES = (1.0, 2.0, 3.5)


def through_the_unknown(cells: CellArray) -> CellArray:
    table = Grid(cells=cells, resolution_m=1.0).opaque_codes()
    table[UNKNOWN] = 0
    return table


def clusters_of(cells: CellArray, groups: list[Ints], range_cells: float) -> list[tuple[int, list[int]]]:
    """Return the clusters by their definition."""
    sight, width = Sight(cells, through_the_unknown(cells)), cells.shape[1]
    free, found = set(np.concatenate(groups).tolist()) if groups else set(), []
    for group in groups:
        while rest := [index for index in group.tolist() if index in free]:
            x, y = np.mod(rest, width), np.array(rest) // width
            seed = rest[int(np.argmin((x - x.mean()) ** 2 + (y - y.mean()) ** 2))]
            members = free & set(sight.visible(Cell(seed % width, seed // width), range_cells).tolist())
            free -= members
            found.append((seed, sorted(members)))
    return found


def test_unknown_cells_in_a_view_are_counted() -> None:
    cells = draw("..?#", "o.??").cells
    assert Views(cells, through_the_unknown(cells), UNKNOWN).hidden(Cell(0, 0), 100.0) == 3


@pytest.mark.parametrize("most", [0, views.MOST_CELLS])
@given(truth=random_cells(codes=(OBSTACLE, FLOOR, FLOOR)), data=st.data())
def test_views_stay_those_of_a_fresh_look_while_the_map_is_revealed(
    most: int, truth: CellArray, data: st.DataObject
) -> None:
    """Compares hidden cells and clusters for old and new queries, with views that are cached or too large."""
    rng = np.random.default_rng(data.draw(st.integers(0, 9999)))
    cells = np.full_like(truth, UNKNOWN)
    opaque, width = through_the_unknown(cells), truth.shape[1]
    patch = pytest.MonkeyPatch()
    patch.setattr(views, "MOST_CELLS", most)
    found = Views(cells, opaque, UNKNOWN)
    asked = [Cell(int(k) % width, int(k) // width) for k in rng.choice(truth.size, 4)]
    for part in np.array_split(rng.permutation(truth.size), 5):
        if part.size:
            cells.ravel()[part] = truth.ravel()[part]
            found.revealed(part)
        found.forget()
        if data.draw(st.booleans()):
            asked[0] = Cell(int(rng.integers(width)), int(rng.integers(len(truth))))
        for cell in asked:
            range_cells = data.draw(st.sampled_from(RANGES))
            seen = Sight(cells, opaque).visible(cell, range_cells)
            assert found.hidden(cell, range_cells) == int(np.count_nonzero(cells.ravel()[seen] == UNKNOWN))
        chosen = np.sort(rng.choice(truth.size, data.draw(st.integers(0, truth.size)), replace=False))
        groups = [group for group in np.array_split(chosen, 2) if group.size]
        range_cells = data.draw(st.sampled_from(RANGES))
        clusters = [(seed, members.tolist()) for seed, members in found.clusters(groups, range_cells)]
        assert clusters == clusters_of(cells, groups, range_cells)
    patch.undo()
