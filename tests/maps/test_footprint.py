import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import ndimage
from support.maps.drawn_maps import carrier, draw, picture, random_cells, rover

from marsupial.maps.discs import disc, fits, standable
from marsupial.maps.footprint import Footprint, footprint_of
from marsupial.model import FLOOR, OBSTACLE, ROUGH, UNKNOWN, Cell, CellArray, Grid, Mask, RobotType

RADII = st.sampled_from([0.0, 0.4, 1.0, 1.2, 1.5, 2.0, 2.3, 3.0])


@pytest.mark.parametrize(
    ("radius_cells", "rows"),
    [
        (0.0, ["x"]),
        (1.0, ["x"]),
        (1.01, [".x.", "xxx", ".x."]),
        (1.5, ["xxx", "xxx", "xxx"]),
        (2.0, ["xxx", "xxx", "xxx"]),
        (2.1, ["..x..", ".xxx.", "xxxxx", ".xxx.", "..x.."]),
        (2.5, [".xxx.", "xxxxx", "xxxxx", "xxxxx", ".xxx."]),
    ],
)
def test_a_disc_holds_the_cells_whose_centre_is_inside(radius_cells: float, rows: list[str]) -> None:
    offsets = disc(radius_cells)
    reach = len(rows) // 2
    mask = np.zeros((len(rows), len(rows)), dtype=np.bool_)
    mask[offsets[:, 1] + reach, offsets[:, 0] + reach] = True
    assert picture(mask) == rows


def test_the_radius_is_in_metres() -> None:
    rows = ["....."] * 5
    assert picture(footprint_of(draw(*rows), carrier(radius_m=1.2)).standable)[2] == ".xxx."
    assert picture(footprint_of(draw(*rows, resolution_m=0.5), carrier(radius_m=1.2)).standable)[2] == "..x.."


@given(cells=random_cells(codes=(OBSTACLE, FLOOR, FLOOR, FLOOR, ROUGH, UNKNOWN)), radius=RADII)
def test_a_robot_stands_where_nothing_that_bars_it_is_nearer_than_its_radius(cells: CellArray, radius: float) -> None:
    kind = carrier(radius_m=radius)
    grid = Grid(cells=cells, resolution_m=1.0)
    footprint = _revealed(grid, kind)
    assert np.array_equal(footprint.standable, _clear_of(cells != FLOOR, radius))
    assert np.array_equal(footprint.standable, standable(grid, kind))
    assert np.array_equal(footprint.possible, _clear_of((cells != FLOOR) & (cells != UNKNOWN), radius))


@given(truth=random_cells(), radius=RADII, data=st.data())
def test_cells_revealed_bit_by_bit_give_what_they_give_at_once(
    truth: CellArray, radius: float, data: st.DataObject
) -> None:
    kind = carrier(radius_m=radius)
    order = np.array(data.draw(st.permutations(range(truth.size))), dtype=np.int64)
    cuts = sorted(data.draw(st.lists(st.integers(0, truth.size), max_size=4)))
    known = np.full_like(truth, UNKNOWN)
    footprint = Footprint(truth.shape, kind, 1.0)
    hopes = footprint.possible.copy()
    for new in np.split(order, cuts):
        known.ravel()[new] = truth.ravel()[new]
        footprint.reveal(new, known)
        assert np.array_equal(footprint.standable, footprint_of(Grid(cells=known, resolution_m=1.0), kind).standable)
        assert not (footprint.possible & ~hopes).any()
        assert not (footprint.standable & ~footprint.possible).any()
        hopes = footprint.possible.copy()
    assert np.array_equal(footprint.standable, footprint.possible)


def _revealed(grid: Grid, kind: RobotType) -> Footprint:
    footprint = Footprint(grid.cells.shape, kind, grid.resolution_m)
    footprint.reveal(np.flatnonzero(grid.cells != UNKNOWN), grid.cells)
    return footprint


def _clear_of(barred: Mask, radius: float) -> Mask:
    """Return where no barred cell's centre, on or off the map, is nearer than `radius`; own cells are always free."""
    free = np.pad(~barred, 1)
    distance = ndimage.distance_transform_edt(free)[1:-1, 1:-1]
    return np.asarray(~barred & (distance >= radius - 1e-9))


@settings(max_examples=50)
@given(cells=random_cells(), radius=RADII)
def test_one_cell_alone_is_judged_as_on_the_whole_map(cells: CellArray, radius: float) -> None:
    grid = Grid(cells=cells, resolution_m=1.0)
    kind = rover(radius_m=radius)
    single = [[fits(grid, kind, Cell(x, y)) for x in range(grid.width)] for y in range(grid.height)]
    assert np.array_equal(np.array(single), footprint_of(grid, kind).standable)
