import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from support.maps.drawn_maps import draw, on_map, picture, random_cells, rover, where
from support.maps.from_scratch import flood

from marsupial.maps.discs import disc
from marsupial.maps.footprint import Contact
from marsupial.model.grid import FLOOR, OBSTACLE, Cell, CellArray, Grid

RADII = [0.0, 0.6, 1.0, 1.2, 1.5, 2.0, 2.3, 3.1]


def touched(*rows: str, radius_m: float) -> list[str]:
    grid = draw(*rows)
    (cell,) = where("r", *rows)
    return picture(on_map(Contact(rover(radius_m=radius_m), grid.resolution_m).touched(grid.cells, cell), grid))


def test_a_robot_touches_what_is_one_cell_beyond_its_footprint() -> None:
    open_ground = (".....", ".....", "..r..", ".....", ".....")
    assert touched(*open_ground, radius_m=0.3) == [".....", "..x..", ".xxx.", "..x..", "....."]
    assert touched(*open_ground, radius_m=0.6) == [".....", ".xxx.", ".xxx.", ".xxx.", "....."]
    assert touched(*open_ground, radius_m=1.2) == ["..x..", ".xxx.", "xxxxx", ".xxx.", "..x.."]


@pytest.mark.parametrize("turned", range(4))
def test_behind_a_closed_corner_nothing_is_touched(turned: int) -> None:
    cells = np.rot90(draw("...", ".r#", ".#.").cells, turned)
    seen = Contact(rover(radius_m=0.6), 1.0).touched(np.ascontiguousarray(cells), Cell(1, 1))
    behind = np.rot90(np.array([sign == "x" for sign in "..x......"]).reshape(3, 3), turned)
    assert picture(on_map(seen, Grid(cells=cells.copy(), resolution_m=1.0))) == picture(~behind)


def test_past_one_obstacle_the_corner_is_touched() -> None:
    assert touched("...", ".r#", "...", radius_m=0.6) == ["xxx", "xxx", "xxx"]


@given(truth=random_cells(smallest=2, largest=14), radius=st.sampled_from(RADII), data=st.data())
def test_touched_free_cells_are_connected_to_the_robot(truth: CellArray, radius: float, data: st.DataObject) -> None:
    at = _start(truth, data)
    grid = Grid(cells=truth, resolution_m=1.0)
    found = on_map(Contact(rover(radius_m=radius), 1.0).touched(truth, at), grid)
    assert not (found & (truth != OBSTACLE) & ~flood(found & (truth != OBSTACLE), [at])).any()


@given(truth=random_cells(smallest=2, largest=14), radius=st.sampled_from(RADII), data=st.data())
def test_contact_decides_whether_a_robot_can_drive_on(truth: CellArray, radius: float, data: st.DataObject) -> None:
    at = _start(truth, data)
    height, width = truth.shape
    found = on_map(Contact(rover(radius_m=radius), 1.0).touched(truth, at), Grid(cells=truth, resolution_m=1.0))
    if (truth[_under(at, radius, truth)] == OBSTACLE).any():
        return  # the robot can't stand there
    for dx, dy in ((1, 0), (-1, 0), (0, 1), (0, -1)):
        beside = Cell(at.x + dx, at.y + dy)
        if 0 <= beside.x < width and 0 <= beside.y < height:
            body = _under(beside, radius, truth)
            off_the_map = len(body[0]) < len(disc(radius))
            assert found[body].all() or (found[body] & (truth[body] == OBSTACLE)).any() or off_the_map


def _start(truth: CellArray, data: st.DataObject) -> Cell:
    height, width = truth.shape
    start = Cell(data.draw(st.integers(0, width - 1)), data.draw(st.integers(0, height - 1)))
    truth[start.y, start.x] = FLOOR
    return start


def _under(cell: Cell, radius: float, truth: CellArray) -> tuple[np.ndarray, np.ndarray]:
    """Return rows and columns of the map's cells under a robot."""
    height, width = truth.shape
    x, y = (disc(radius) + np.array(cell)).T
    inside = (x >= 0) & (y >= 0) & (x < width) & (y < height)
    return y[inside], x[inside]
