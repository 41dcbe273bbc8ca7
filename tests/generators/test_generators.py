"""Generated maps: closed, connected, repeatable, and with the features their names promise."""

import numpy as np
import pytest
from scipy import ndimage

from marsupial.errors import MapError
from marsupial.generators import GENERATORS
from marsupial.generators.builtin import SCENARIOS
from marsupial.generators.papers import SIDE, WALLED, scattered
from marsupial.maps.footprint import footprint_of
from marsupial.maps.reach import parts
from marsupial.model import FLOOR, OBSTACLE, ROUGH, Grid, RobotType, Role

SIZES = {name: (one.width_m, one.height_m) for name, one in SCENARIOS.items()}
SEEDS = range(8)
every_generator = pytest.mark.parametrize("name", GENERATORS)


def make(name: str, seed: int = 1, resolution_m: float = 0.25, **options: float) -> Grid:
    width_m, height_m = SIZES[name]
    arguments = {"width_m": width_m, "height_m": height_m, "resolution_m": resolution_m, "seed": seed, **options}
    return GENERATORS[name].make(**arguments)


def robot(radius_m: float, *terrains: int) -> RobotType:
    return RobotType(
        name="r", role=Role.CARRIER, speed_mps=1, sensor_range_m=1, radius_m=radius_m, terrains=frozenset(terrains)
    )


def areas(grid: Grid, kind: RobotType) -> list[int]:
    """Return the sizes in cells of the connected areas where `kind` can stand, largest first."""
    labels, count = parts(footprint_of(grid, kind).standable)
    return sorted(np.bincount(labels.ravel(), minlength=count + 1)[1:].tolist(), reverse=True)


def door_count(grid: Grid, inside: np.ndarray) -> int:
    """Return the number of separate places where the area `inside` is edge-adjacent to floor."""
    touching = inside & ndimage.binary_dilation(grid.cells == FLOOR)
    return int(ndimage.label(touching, structure=np.ones((3, 3)))[1])


def rough_rooms(grid: Grid) -> list[int]:
    """Return the number of doors of each rough room."""
    labels, count = ndimage.label(grid.cells == ROUGH)
    return [door_count(grid, labels == i) for i in range(1, count + 1)]


@every_generator
def test_the_same_seed_gives_the_same_map(name: str) -> None:
    assert make(name).cells.tobytes() == make(name).cells.tobytes()


@every_generator
@pytest.mark.parametrize("resolution_m", [0.1, 0.25, 0.5])
def test_the_map_has_the_size_asked_for(name: str, resolution_m: float) -> None:
    grid = make(name, resolution_m=resolution_m)
    width_m, height_m = SIZES[name]
    assert (grid.width, grid.height) == (round(width_m / resolution_m), round(height_m / resolution_m))
    assert grid.resolution_m == resolution_m


@every_generator
@pytest.mark.parametrize("seed", SEEDS)
def test_the_border_is_closed(name: str, seed: int) -> None:
    cells = make(name, seed).cells
    for edge in (cells[0], cells[-1], cells[:, 0], cells[:, -1]):
        assert (edge == OBSTACLE).all()


@every_generator
@pytest.mark.parametrize("seed", SEEDS)
def test_a_small_rover_that_drives_everywhere_reaches_every_free_cell(name: str, seed: int) -> None:
    grid = make(name, seed)
    assert areas(grid, robot(0.1, FLOOR, ROUGH)) == [int(np.count_nonzero(grid.cells != OBSTACLE))]


@pytest.mark.parametrize("name", ["office", "maze", "lobby"])
@pytest.mark.parametrize("resolution_m", [0.1, 0.25, 0.5])
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_carriers_reach_all_floor_where_terrain_is_the_border(name: str, resolution_m: float, seed: int) -> None:
    grid = make(name, seed, resolution_m)
    assert len(areas(grid, robot(0.3, FLOOR))) == 1
    assert len(areas(grid, robot(0.0, FLOOR))) == 1


@pytest.mark.parametrize("name", ["random", "cave"])
@pytest.mark.parametrize("seed", SEEDS)
def test_carriers_have_room_on_natural_ground(name: str, seed: int) -> None:
    grid = make(name, seed)
    assert areas(grid, robot(0.3, FLOOR))[0] * grid.cell_area_m2 > 300


@pytest.mark.parametrize("seed", SEEDS)
def test_the_mazes_centre_is_one_rough_area_with_openings_on_every_side(seed: int) -> None:
    grid = make("maze", seed)
    assert rough_rooms(grid) == [8]
    ys, xs = np.nonzero(grid.cells == ROUGH)
    assert (xs.max() - xs.min()) * grid.resolution_m > 20
    assert (ys.max() - ys.min()) * grid.resolution_m > 20
    assert abs(float(xs.mean()) - grid.width / 2) < 6


@pytest.mark.parametrize("seed", SEEDS)
def test_some_rooms_have_doors_too_narrow_for_carriers(seed: int) -> None:
    first, *others = areas(make("rooms", seed), robot(0.3, FLOOR))
    assert len(others) >= 3
    assert first > 0.6 * (first + sum(others))


def test_rooms_of_the_least_size_still_leave_one_for_carriers() -> None:
    for seed in SEEDS:
        grid = GENERATORS["rooms"].make(width_m=12.0, height_m=12.0, resolution_m=0.25, seed=seed)
        assert areas(grid, robot(0.3, FLOOR))


@every_generator
def test_every_parameter_out_of_range_is_named(name: str) -> None:
    with pytest.raises(MapError) as caught:
        GENERATORS[name].make(width_m=1.0, height_m=1e9, resolution_m=float("nan"), seed=-1)
    assert {problem.path for problem in caught.value.problems} == {"width_m", "height_m", "resolution_m", "seed"}


def test_too_many_cells_are_refused() -> None:
    with pytest.raises(MapError, match=r"^width_m: must be at most 4000 cells of 0.05 m, got 300.0$"):
        GENERATORS["cave"].make(width_m=300.0, height_m=30.0, resolution_m=0.05, seed=1)


@pytest.mark.parametrize(("name", "least"), [("office", (30, 24)), ("maze", (24, 24)), ("lobby", (8, 9))])
def test_the_least_size_works(name: str, least: tuple[float, float]) -> None:
    for seed in SEEDS:
        grid = GENERATORS[name].make(width_m=least[0], height_m=least[1], resolution_m=0.5, seed=seed)
        assert len(areas(grid, robot(0.3, FLOOR))) == 1
        assert rough_rooms(grid)


@pytest.mark.parametrize(("columns", "rows", "obstacles"), [(25, 25, 0), (25, 20, 10), (31, 31, 40), (2, 2, 4)])
def test_there_are_as_many_obstacles_of_one_cell_as_asked_for(columns: int, rows: int, obstacles: int) -> None:
    grid = scattered(columns, rows, obstacles, seed=1)
    assert (grid.width, grid.height, grid.resolution_m) == (columns, rows, 1.0)
    assert np.count_nonzero(grid.cells == OBSTACLE) == obstacles
    assert np.count_nonzero(grid.cells == FLOOR) == columns * rows - obstacles


def test_the_seed_places_them() -> None:
    assert scattered(25, 25, 20, seed=1).cells.tobytes() == scattered(25, 25, 20, seed=1).cells.tobytes()
    assert len({scattered(25, 25, 20, seed=seed).cells.tobytes() for seed in range(8)}) == 8


@pytest.mark.parametrize("name", WALLED)
def test_areas_are_closed_and_every_room_has_a_door(name: str) -> None:
    grid = WALLED[name]()
    assert grid.cells.shape == (SIDE, SIDE)
    assert set(np.unique(grid.cells)) == {FLOOR, OBSTACLE}
    border = np.concatenate([grid.cells[0], grid.cells[-1], grid.cells[:, 0], grid.cells[:, -1]])
    assert (border == OBSTACLE).all()
    assert ndimage.label(grid.cells == FLOOR)[1] == 1


@pytest.mark.parametrize(("name", "rooms", "width"), [("three-rooms", 4, 4), ("six-rooms", 7, 3)])
def test_closed_doors_leave_so_many_rooms(name: str, rooms: int, width: int) -> None:
    floor = WALLED[name]().cells == FLOOR
    # a wall is one cell thick: a free cell between two wall cells is a door
    beside = ndimage.binary_opening(floor, np.ones((width + 1, width + 1)))
    assert ndimage.label(beside)[1] == rooms
