from pathlib import Path

import numpy as np
import numpy.typing as npt
import pytest
from PIL import Image

from marsupial.errors import MapError
from marsupial.formats.mapfiles.masks import read_mask
from marsupial.model.grid import FLOOR, OBSTACLE, ROUGH, TERRAINS, UNKNOWN, Grid, Terrain

GRASS = 3


def grid_of(cells: list[list[int]]) -> Grid:
    return Grid(
        cells=np.array(cells, dtype=np.uint8),
        resolution_m=0.5,
        origin_m=(1.0, 2.0, 0.0),
        terrains=(*TERRAINS, Terrain(code=GRASS, name="grass")),
    )


def mask_of(folder: Path, pixels: npt.ArrayLike) -> Path:
    path = folder / "mask.png"
    Image.fromarray(np.asarray(pixels, dtype=np.uint8)).save(path)
    return path


def problems_of(grid: Grid, path: Path, codes: dict[int, int]) -> list[str]:
    with pytest.raises(MapError) as caught:
        read_mask(grid, path, codes)
    return [str(problem) for problem in caught.value.problems]


def test_floor_takes_the_class_that_is_painted_on_it(tmp_path: Path) -> None:
    grid = grid_of([[FLOOR, FLOOR, FLOOR]])
    masked = read_mask(grid, mask_of(tmp_path, [[255, 100, 50]]), {255: FLOOR, 100: ROUGH, 50: GRASS})
    assert masked.cells.tolist() == [[FLOOR, ROUGH, GRASS]]
    assert (masked.resolution_m, masked.origin_m, masked.terrains) == (0.5, (1.0, 2.0, 0.0), grid.terrains)
    assert grid.cells.tolist() == [[FLOOR, FLOOR, FLOOR]]


def test_the_bottom_row_of_the_mask_is_row_0(tmp_path: Path) -> None:
    masked = read_mask(grid_of([[FLOOR], [FLOOR]]), mask_of(tmp_path, [[9], [7]]), {7: FLOOR, 9: ROUGH})
    assert masked.cells.tolist() == [[FLOOR], [ROUGH]]


def test_obstacles_and_unknown_cells_stay_whatever_is_painted_on_them(tmp_path: Path) -> None:
    grid = grid_of([[OBSTACLE, UNKNOWN, FLOOR]])
    masked = read_mask(grid, mask_of(tmp_path, [[1, 2, 3]]), {3: ROUGH})
    assert masked.cells.tolist() == [[OBSTACLE, UNKNOWN, ROUGH]]


def test_transparent_pixels_leave_the_cell_as_it_is(tmp_path: Path) -> None:
    path = mask_of(tmp_path, [[[9, 9, 9, 255], [9, 9, 9, 0], [1, 1, 1, 128]]])
    assert read_mask(grid_of([[FLOOR, FLOOR, ROUGH]]), path, {9: GRASS}).cells.tolist() == [[GRASS, FLOOR, ROUGH]]


def test_a_mask_of_another_size_is_named(tmp_path: Path) -> None:
    path = mask_of(tmp_path, [[0, 0]])
    assert problems_of(grid_of([[FLOOR]]), path, {0: FLOOR}) == ["size: must be that of the map, 1 x 1, got 2 x 1"]


def test_all_greys_without_a_code_are_named(tmp_path: Path) -> None:
    path = mask_of(tmp_path, [[255, 100, 100, 7]])
    assert problems_of(grid_of([[FLOOR] * 4]), path, {255: FLOOR}) == [
        "grey 7: has no terrain code (1 cell)",
        "grey 100: has no terrain code (2 cells)",
    ]


def test_of_a_picture_of_all_greys_the_first_are_named_and_the_others_counted(tmp_path: Path) -> None:
    path = mask_of(tmp_path, [list(range(256))])
    problems = problems_of(grid_of([[FLOOR] * 256]), path, {255: FLOOR})
    assert problems[:2] == ["grey 0: has no terrain code (1 cell)", "grey 1: has no terrain code (1 cell)"]
    assert (len(problems), problems[-1]) == (11, "and 245 more faults like these")


def test_codes_the_map_does_not_have_are_named(tmp_path: Path) -> None:
    path = mask_of(tmp_path, [[0]])
    assert problems_of(grid_of([[FLOOR]]), path, {0: 9, 300: FLOOR, 1: UNKNOWN}) == [
        "grey 300: must be from 0 to 255",
        "grey 0: terrain code 9 is none of the map's classes [0, 1, 2, 3]",
        "grey 1: terrain code 255 is none of the map's classes [0, 1, 2, 3]",
    ]
