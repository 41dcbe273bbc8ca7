import re
from pathlib import Path

import numpy as np
import numpy.typing as npt
import pytest
from PIL import Image

from marsupial.errors import MapError, ScenarioError
from marsupial.formats.mapfiles.masks import FilterMasks, KeepoutMask, SpeedMask, read_mask
from marsupial.formats.mapfiles.nav2 import read_nav2, read_occupancy
from marsupial.formats.mapfiles.occupancy import Occupancy, occupancy_on
from marsupial.formats.scenario import read_scenario
from marsupial.model.grid import FLOOR, OBSTACLE, ROUGH, TERRAINS, UNKNOWN, Grid, Terrain

KEEPOUT, SLOW, CRAWL = 3, 4, 5


def occupancy_of(*rows: list[int], resolution_m: float = 1.0, origin_m: tuple[float, float, float] = (0, 0, 0)):
    """Return a mask; the last row is the lowest."""
    return Occupancy(values=np.array(rows[::-1], dtype=np.int8), resolution_m=resolution_m, origin_m=origin_m)


def grid_of(*rows: list[int]) -> Grid:
    return Grid(cells=np.array(rows[::-1], dtype=np.uint8), resolution_m=1.0)


def keepout(occupancy: Occupancy) -> FilterMasks:
    return FilterMasks(keepout=KeepoutMask(occupancy=occupancy, code=KEEPOUT))


def test_only_known_ground_below_a_full_keepout_cell_is_painted() -> None:
    grid = grid_of([FLOOR, ROUGH, OBSTACLE, UNKNOWN, FLOOR, FLOOR])
    painted = keepout(occupancy_of([100, 100, 100, 100, 99, -1])).painted(grid)
    assert painted.cells.tolist() == [[KEEPOUT, KEEPOUT, OBSTACLE, UNKNOWN, FLOOR, FLOOR]]


def test_a_mask_of_another_frame_is_looked_up_by_place() -> None:
    grid = grid_of([FLOOR] * 4, [FLOOR] * 4)
    mask = occupancy_of([0, 0, 100, 100], [0, 0, 100, 100], resolution_m=0.5, origin_m=(1, 1, 0))
    assert keepout(mask).painted(grid).cells[::-1].tolist() == [[FLOOR, FLOOR, KEEPOUT, FLOOR], [FLOOR] * 4]


def test_a_turned_mask_is_looked_up_by_place() -> None:
    mask = occupancy_of([0, 0, 100], origin_m=(2, 0, np.pi / 2))
    assert occupancy_on(mask, grid_of(*[[FLOOR] * 2] * 3))[::-1].tolist() == [[-1, 100], [-1, 0], [-1, 0]]


def test_a_cell_takes_the_lowest_step_that_its_limit_does_not_exceed() -> None:
    mask = SpeedMask(occupancy=occupancy_of([0, -1, 39, 40, 75, 99, 100]), percents={CRAWL: 25, SLOW: 60})
    painted = FilterMasks(speed=mask).painted(grid_of([FLOOR] * 7))
    assert painted.cells.tolist() == [[FLOOR, FLOOR, FLOOR, SLOW, CRAWL, CRAWL, FLOOR]]


def test_base_and_multiplier_are_those_of_nav2() -> None:
    mask = SpeedMask(occupancy=occupancy_of([30, 60]), percents={SLOW: 50}, base=0.0, multiplier=1.0)
    assert FilterMasks(speed=mask).painted(grid_of([FLOOR, FLOOR])).cells.tolist() == [[SLOW, FLOOR]]


def test_keepout_counts_for_more_than_speed() -> None:
    mask = occupancy_of([100, 50])
    both = FilterMasks(
        keepout=KeepoutMask(occupancy=mask, code=KEEPOUT), speed=SpeedMask(occupancy=mask, percents={SLOW: 50})
    )
    assert both.painted(grid_of([FLOOR, FLOOR])).cells.tolist() == [[KEEPOUT, SLOW]]


def test_the_warehouse_keeps_robots_out_where_its_mask_says_so(shared_maps: Path) -> None:
    grid = read_nav2(shared_maps / "warehouse_nav2.yaml").grid
    painted = keepout(read_occupancy(shared_maps / "warehouse_nav2_keepout.yaml")).painted(grid)
    area = np.count_nonzero(painted.cells == KEEPOUT) * grid.cell_area_m2
    assert area == pytest.approx(30.62, abs=0.01)
    assert np.array_equal(painted.cells == KEEPOUT, (painted.cells != grid.cells))


def scenario_file(folder: Path, masks: str) -> Path:
    Image.fromarray(np.array([[0, 254, 102]], dtype=np.uint8)).save(folder / "mask.png")
    (folder / "mask.yaml").write_text(
        "image: mask.png\nresolution: 1\norigin: [0, 0, 0]\nnegate: 0\n"
        "mode: scale\noccupied_thresh: 1\nfree_thresh: 0\n"
    )
    (folder / "hall.yaml").write_text(f"""
format: marsupial-scenario
version: 1
terrains: [{{name: keepout}}, {{name: slow}}]
robot_types:
  - {{name: carrier, role: carrier, speed_mps: 1, sensor_range_m: 5, radius_m: 0, terrains: [floor], capacity: 0}}
team: [{{name: mother, type: carrier, start: [1.5, 0.5]}}]
map:
  rows: ["..."]
  resolution_m: 1
{masks}
""")
    return folder / "hall.yaml"


def test_a_scenario_has_masks_beside_its_map(tmp_path: Path) -> None:
    path = scenario_file(
        tmp_path, "  keepout: {file: mask.yaml, terrain: keepout}\n  speed: {file: mask.yaml, terrains: {slow: 50}}"
    )
    assert read_scenario(path).grid.cells.tolist() == [[3, FLOOR, 4]]


def test_errors_in_masks_are_reported_by_field(tmp_path: Path) -> None:
    path = scenario_file(
        tmp_path,
        "  keepout: {file: gone.yaml, terrain: keepuot, also: 1}\n  speed: {file: mask.yaml, terrains: {slow: 0, 4}}",
    )
    with pytest.raises(ScenarioError) as caught:
        read_scenario(path)
    told = str(caught.value).replace(f"{path}: ", "").replace(str(tmp_path), "").splitlines()
    lines = [re.sub(r"^line \d+: ", "", line) for line in told]
    assert lines == [
        "map.keepout.terrain: unknown terrain 'keepuot', did you mean 'keepout'?",
        "map.keepout.also: unknown field; the fields here are file, terrain",
        "map.keepout.file: /gone.yaml: no such file",
        "map.speed.terrains.slow: must be positive, got 0",
        "map.speed.terrains.4: unknown terrain '4'",
    ]


# Terrain of an image.

GRASS = 3


def grass_grid(cells: list[list[int]]) -> Grid:
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
    grid = grass_grid([[FLOOR, FLOOR, FLOOR]])
    masked = read_mask(grid, mask_of(tmp_path, [[255, 100, 50]]), {255: FLOOR, 100: ROUGH, 50: GRASS})
    assert masked.cells.tolist() == [[FLOOR, ROUGH, GRASS]]
    assert (masked.resolution_m, masked.origin_m, masked.terrains) == (0.5, (1.0, 2.0, 0.0), grid.terrains)
    assert grid.cells.tolist() == [[FLOOR, FLOOR, FLOOR]]


def test_the_bottom_row_of_the_mask_is_row_0(tmp_path: Path) -> None:
    masked = read_mask(grass_grid([[FLOOR], [FLOOR]]), mask_of(tmp_path, [[9], [7]]), {7: FLOOR, 9: ROUGH})
    assert masked.cells.tolist() == [[FLOOR], [ROUGH]]


def test_obstacles_and_unknown_cells_stay_whatever_is_painted_on_them(tmp_path: Path) -> None:
    grid = grass_grid([[OBSTACLE, UNKNOWN, FLOOR]])
    masked = read_mask(grid, mask_of(tmp_path, [[1, 2, 3]]), {3: ROUGH})
    assert masked.cells.tolist() == [[OBSTACLE, UNKNOWN, ROUGH]]


def test_transparent_pixels_leave_the_cell_as_it_is(tmp_path: Path) -> None:
    path = mask_of(tmp_path, [[[9, 9, 9, 255], [9, 9, 9, 0], [1, 1, 1, 128]]])
    assert read_mask(grass_grid([[FLOOR, FLOOR, ROUGH]]), path, {9: GRASS}).cells.tolist() == [[GRASS, FLOOR, ROUGH]]


@pytest.mark.parametrize(
    ("width", "greys", "codes", "problems"),
    [
        (1, [0, 0], {0: FLOOR}, "size: must be that of the map, 1 x 1, got 2 x 1"),
        (4, [255, 100, 100, 7], {255: FLOOR},
         "grey 7: has no terrain code (1 cell)\ngrey 100: has no terrain code (2 cells)"),
        (1, [0], {0: 9, 300: FLOOR, 1: UNKNOWN},
         "grey 300: must be from 0 to 255\n"
         "grey 0: terrain code 9 is none of the map's classes [0, 1, 2, 3]\n"
         "grey 1: terrain code 255 is none of the map's classes [0, 1, 2, 3]"),
    ],
    ids=["another size", "greys without a code", "codes that the map does not have"],
)  # fmt: skip
def test_a_mask_that_does_not_fit_is_refused_with_all_faults(
    tmp_path: Path, width: int, greys: list[int], codes: dict[int, int], problems: str
) -> None:
    assert problems_of(grass_grid([[FLOOR] * width]), mask_of(tmp_path, [greys]), codes) == problems.splitlines()


def test_of_a_picture_of_all_greys_the_first_are_named_and_the_others_counted(tmp_path: Path) -> None:
    path = mask_of(tmp_path, [list(range(256))])
    problems = problems_of(grass_grid([[FLOOR] * 256]), path, {255: FLOOR})
    assert problems[:2] == ["grey 0: has no terrain code (1 cell)", "grey 1: has no terrain code (1 cell)"]
    assert (len(problems), problems[-1]) == (11, "and 245 more faults like these")
