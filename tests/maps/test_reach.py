from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from scipy import ndimage
from support.maps.drawn_maps import carrier, draw, picture, random_cells

from marsupial.formats.mapfiles.read import read_map
from marsupial.maps.reach import groups, largest_reach, parts
from marsupial.model.grid import FLOOR, OBSTACLE, CellArray


@given(cells=random_cells(codes=(OBSTACLE, FLOOR)))
def test_parts_are_those_of_scipy_in_the_same_order(cells: CellArray) -> None:
    labels, count = parts(cells == FLOOR)
    expected, total = ndimage.label(cells == FLOOR)
    assert (count, labels.tolist()) == (total, expected.tolist())


def test_the_largest_reach_is_the_largest_room() -> None:
    grid = draw("..#...", "..#...", "###...")
    assert picture(largest_reach(grid, carrier(radius_m=0.5))) == ["...xxx", "...xxx", "...xxx"]


def test_where_no_robot_fits_the_reach_is_empty() -> None:
    assert not largest_reach(draw(".#.", "#.#"), carrier()).any()


@given(cells=random_cells(codes=(OBSTACLE, FLOOR)))
def test_groups_are_those_of_scipy(cells: CellArray) -> None:
    mask = cells == FLOOR
    labels, count = ndimage.label(mask, structure=np.ones((3, 3)))
    found = groups(np.flatnonzero(mask), mask.shape)
    assert [group.tolist() for group in found] == [np.flatnonzero(labels == i + 1).tolist() for i in range(count)]


@pytest.mark.parametrize(
    ("name", "areas_m2"),
    [
        ("fr079", (246, 163, 24)),
        ("tsc_office", (1181, 903, 427)),
        ("fr101", (124, 88, 72)),
        ("warehouse_aws", (208, 180, 145)),
    ],
)
def test_reach_on_real_maps_shrinks_with_the_radius(
    shared_maps: Path, name: str, areas_m2: tuple[float, float, float]
) -> None:
    grid = read_map(shared_maps / f"{name}.yaml").grid
    found = [
        int(largest_reach(grid, carrier(radius_m=radius)).sum()) * grid.cell_area_m2 for radius in (0.15, 0.3, 0.5)
    ]
    assert found == [pytest.approx(area, rel=0.01, abs=0.5) for area in areas_m2]
