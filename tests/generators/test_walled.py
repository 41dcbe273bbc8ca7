from __future__ import annotations

import numpy as np
import pytest
from scipy import ndimage

from marsupial.generators.papers import SIDE, WALLED
from marsupial.model.grid import FLOOR, OBSTACLE


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
    # a wall is one cell thick: what has walls on either side of it is a door
    beside = ndimage.binary_opening(floor, np.ones((width + 1, width + 1)))
    assert ndimage.label(beside)[1] == rooms
