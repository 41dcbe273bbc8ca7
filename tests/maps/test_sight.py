import math
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from support.maps.drawn_maps import draw, on_map, picture, random_cells, random_flags, where

from marsupial.maps.sight import Sight, hopeful_codes
from marsupial.maps.window import Window
from marsupial.model.grid import FLOOR, OBSTACLE, ROUGH, UNKNOWN, Cell, CellArray, Grid, Terrain

FAR = 100.0


def seen_from(grid: Grid, cell: Cell, range_cells: float = FAR) -> list[str]:
    return picture(on_map(Sight(grid.cells, grid.opaque_codes()).visible(cell, range_cells), grid))


def test_an_empty_room_is_seen_with_its_walls() -> None:
    rows = ("#####", "#...#", "#.o.#", "#...#", "#####")
    # no side of the walls' corners faces the room
    assert seen_from(draw(*rows), *where("o", *rows)) == [".xxx.", "xxxxx", "xxxxx", "xxxxx", ".xxx."]


def test_a_wall_is_seen_but_nothing_behind_it() -> None:
    rows = ("......", "......", "o.#...", "......", "......")
    assert seen_from(draw(*rows), Cell(0, 2)) == ["xxxxxx", "xxxxx.", "xxx...", "xxxxx.", "xxxxxx"]


@pytest.mark.parametrize("turned", range(4))
def test_a_gap_between_corners_is_closed_in_every_direction(turned: int) -> None:
    cells = np.full((5, 5), FLOOR, dtype=np.uint8)
    cells[2, 3] = cells[3, 2] = OBSTACLE
    cells = np.ascontiguousarray(np.rot90(cells, turned))
    seen = Sight(cells, Grid(cells=cells, resolution_m=1.0).opaque_codes()).visible(Cell(2, 2), FAR)
    behind = np.rot90(np.pad(np.ones((2, 2), dtype=np.bool_), ((3, 0), (3, 0))), turned)
    assert not (behind & np.isin(np.arange(25), seen).reshape(5, 5)).any()
    assert len(seen) == 17


def test_range_is_measured_to_the_centre_of_a_cell() -> None:
    grid = draw(*["......."] * 7)
    assert seen_from(grid, Cell(3, 3), 2.0) == [
        ".......",
        "...x...",
        "..xxx..",
        ".xxxxx.",
        "..xxx..",
        "...x...",
        ".......",
    ]
    assert seen_from(grid, Cell(3, 3), math.sqrt(8)) == [".......", *[".xxxxx."] * 5, "......."]


def test_terrain_does_not_block_sight_unless_its_class_says_so() -> None:
    assert seen_from(draw("o,,."), Cell(0, 0)) == ["xxxx"]
    hedge = Terrain(code=ROUGH, name="hedge", blocks_sight=True)
    floor = Terrain(code=FLOOR, name="floor")
    grid = Grid(cells=draw("o.,.").cells, resolution_m=1.0, terrains=(floor, hedge))
    assert seen_from(grid, Cell(0, 0)) == ["xxx."]


def test_the_unknown_blocks_sight_unless_the_table_says_that_it_does_not() -> None:
    grid = draw("o?..")
    assert seen_from(grid, Cell(0, 0)) == ["xx.."]
    hopeful = grid.opaque_codes()
    hopeful[UNKNOWN] = 0
    assert picture(on_map(Sight(grid.cells, hopeful).visible(Cell(0, 0), FAR), grid)) == ["xxxx"]


def test_a_changed_map_is_read_again() -> None:
    cells = np.full((1, 5), FLOOR, dtype=np.uint8)
    sight = Sight(cells, Grid(cells=cells, resolution_m=1.0).opaque_codes())
    assert sorted(sight.visible(Cell(0, 0), FAR).tolist()) == [0, 1, 2, 3, 4]
    cells[0, 2] = OBSTACLE
    assert sorted(sight.visible(Cell(0, 0), FAR).tolist()) == [0, 1, 2]
    cells[0, 2] = FLOOR
    assert sorted(sight.visible(Cell(4, 0), FAR).tolist()) == [0, 1, 2, 3, 4]


@given(cells=random_cells(), data=st.data())
def test_each_cell_is_named_once_and_the_own_one_always(cells: CellArray, data: st.DataObject) -> None:
    grid, cell, range_cells = _case(cells, data)
    seen = Sight(grid.cells, grid.opaque_codes()).visible(cell, range_cells).tolist()
    assert len(seen) == len(set(seen))
    assert cell.y * grid.width + cell.x in seen


@given(cells=random_cells(), data=st.data())
def test_a_robot_that_has_looked_around_has_no_unknown_cell_in_view(cells: CellArray, data: st.DataObject) -> None:
    grid, cell, range_cells = _case(cells, data)
    known = np.where(data.draw(random_flags(cells.shape)), cells, UNKNOWN).astype(np.uint8)
    seen = Sight(cells, grid.opaque_codes()).visible(cell, range_cells)
    known.ravel()[seen] = cells.ravel()[seen]
    hoped = Sight(known, hopeful_codes(grid)).visible(cell, range_cells)
    assert sorted(hoped.tolist()) == sorted(seen.tolist())


@given(cells=random_cells(largest=16), data=st.data())
def test_the_first_to_see_some_cells_is_the_first_of_whose_view_they_are(cells: CellArray, data: st.DataObject) -> None:
    grid, _, range_cells = _case(cells, data)
    y, x = (sorted(data.draw(st.tuples(st.integers(0, n - 1), st.integers(0, n - 1)))) for n in cells.shape)
    window = Window(bottom=y[0], top=y[1] + 1, left=x[0], right=x[1] + 1)
    wanted = np.zeros(cells.shape, dtype=np.bool_)
    wanted[window.cut] = data.draw(random_flags(wanted[window.cut].shape))
    stands = np.array(data.draw(st.permutations(range(cells.size)))[:20], dtype=np.int64)
    sight = Sight(cells, grid.opaque_codes())
    seeing = [
        Cell(stand % grid.width, stand // grid.width)
        for stand in stands.tolist()
        if wanted.ravel()[sight.visible(Cell(stand % grid.width, stand // grid.width), range_cells)].any()
    ]
    assert sight.first_to_see(stands, wanted.ravel(), window, range_cells) == (seeing[0] if seeing else None)


@given(cells=random_cells(codes=(OBSTACLE, FLOOR, FLOOR, FLOOR, UNKNOWN)), data=st.data())
def test_seen_cells_are_those_hit_by_rays(cells: CellArray, data: st.DataObject) -> None:
    grid, cell, range_cells = _case(cells, data)
    opaque = grid.opaque_codes()
    seen = set(Sight(grid.cells, opaque).visible(cell, range_cells).tolist())
    met = {
        index
        for angle in _between_corners(cell, grid)
        for index in _ray(grid, opaque, cell, angle)
        if math.hypot(index % grid.width - cell.x, index // grid.width - cell.y) <= range_cells + 1e-6
    }
    assert seen == met


def _case(cells: CellArray, data: st.DataObject) -> tuple[Grid, Cell, float]:
    grid = Grid(cells=cells, resolution_m=1.0)
    cell = Cell(data.draw(st.integers(0, grid.width - 1)), data.draw(st.integers(0, grid.height - 1)))
    return grid, cell, data.draw(st.floats(0.0, 15.0))


def _between_corners(cell: Cell, grid: Grid) -> list[float]:
    """Return one direction between each two consecutive corners of cells: all rays between them hit the same cells.

    None is along an axis.
    """
    corners = {
        math.atan2(2 * (y - cell.y) + 1, 2 * (x - cell.x) + 1)
        for y in range(-1, grid.height)
        for x in range(-1, grid.width)
    }
    ordered = sorted(corners)
    ordered.append(ordered[0] + 2 * math.pi)
    return [a + 0.45 * (b - a) for a, b in pairwise(ordered) if b - a > 1e-12]


def _ray(grid: Grid, opaque: CellArray, cell: Cell, angle: float) -> list[int]:
    """Return the cells that a ray from the centre of `cell` crosses, up to and including the first opaque one."""
    step_x, step_y = (1 if math.cos(angle) > 0 else -1), (1 if math.sin(angle) > 0 else -1)
    next_x, next_y = abs(0.5 / math.cos(angle)), abs(0.5 / math.sin(angle))
    x, y = cell
    met = [y * grid.width + x]
    while True:
        if next_x < next_y:
            x, next_x = x + step_x, next_x + abs(1 / math.cos(angle))
        else:
            y, next_y = y + step_y, next_y + abs(1 / math.sin(angle))
        if not grid.contains(Cell(x, y)):
            return met
        met.append(y * grid.width + x)
        if opaque[grid.cells[y, x]]:
            return met
