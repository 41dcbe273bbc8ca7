"""How a map was understood, cell by cell: what is seen, who can stand where, what is cut off, where it leaks."""

from __future__ import annotations

from collections.abc import Sequence
from enum import IntEnum

import numpy as np

from marsupial.maps.reach import parts, standable
from marsupial.model.grid import OBSTACLE, UNKNOWN, CellArray, Grid, Mask
from marsupial.model.robots import RobotType, Role
from marsupial.replay.palette import LIGHT, REACH


class MapClass(IntEnum):
    """What a cell is; the numbers of obstacles and unknown cells are those they have on a grid."""

    WALL = OBSTACLE
    CARRIERS = 1
    ROVERS = 2
    NARROW = 3
    ISLAND = 4
    LEAK = 5
    UNSEEN = UNKNOWN


TEXTS = {
    MapClass.CARRIERS: "carriers can stand here",
    MapClass.ROVERS: "only rovers can",
    MapClass.NARROW: "free, too narrow for all",
    MapClass.ISLAND: "island: cut off from the rest",
    MapClass.LEAK: "leak at the border",
    MapClass.WALL: "obstacle",
    MapClass.UNSEEN: "unknown",
}
"""What a key says of each, in its order."""

LEAK_M = 0.3
"""How far from the border free cells on it are marked: a line of one cell would not be seen."""


LEAST_ISLANDS_M2 = 0.05
"""Islands that come to less than that, all together, are not told apart: nobody would see them."""


def map_classes(grid: Grid, kinds: Sequence[RobotType]) -> CellArray:
    """Return the `MapClass` of every cell, uint8 (height, width).

    An island is where a robot can stand without a way, for any robot, to the largest connected area; a leak is free
    ground at the border that is connected to that area.
    """
    free = (grid.cells != OBSTACLE) & (grid.cells != UNKNOWN)
    carriers, rovers = (_standable(grid, [kind for kind in kinds if kind.role is role]) for role in Role)
    anybody = carriers | rovers
    found = np.where(free, np.uint8(MapClass.NARROW), np.where(grid.cells == UNKNOWN, np.uint8(UNKNOWN), np.uint8(0)))
    found[anybody] = MapClass.ROVERS
    found[carriers] = MapClass.CARRIERS
    labels, count = parts(anybody)
    if count:
        largest = int(np.bincount(labels.ravel())[1:].argmax()) + 1
        islands = anybody & (labels != largest)
        if np.count_nonzero(islands) * grid.cell_area_m2 >= LEAST_ISLANDS_M2:
            found[islands] = MapClass.ISLAND
        found[_leak(grid, free, labels == largest)] = MapClass.LEAK
    return found.astype(np.uint8)


def _standable(grid: Grid, kinds: Sequence[RobotType]) -> Mask:
    found = np.zeros(grid.cells.shape, dtype=np.bool_)
    for kind in kinds:
        found |= standable(grid, kind)
    return found


def _leak(grid: Grid, free: Mask, area: Mask) -> Mask:
    """Return the free cells by the border, where the free ground there is connected to an area."""
    labels, count = parts(free)
    with_area = np.zeros(count + 1, dtype=np.bool_)
    with_area[labels[area]] = True
    deep = max(1, round(LEAK_M / grid.resolution_m))
    border = np.ones(free.shape, dtype=np.bool_)
    border[deep:-deep, deep:-deep] = False
    edge = np.ones(free.shape, dtype=np.bool_)
    edge[1:-1, 1:-1] = False
    open_edge = edge & free & with_area[labels]
    rows, columns = np.nonzero(open_edge)
    near = np.zeros(free.shape, dtype=np.bool_)
    for y, x in zip(rows.tolist(), columns.tolist(), strict=True):
        near[max(0, y - deep) : y + deep + 1, max(0, x - deep) : x + deep + 1] = True
    return np.asarray(border & near & free)


COLOURS = {
    MapClass.CARRIERS: REACH["carriers"],
    MapClass.ROVERS: REACH["rovers"],
    MapClass.NARROW: REACH["narrow"],
    MapClass.ISLAND: REACH["islands"],
    MapClass.LEAK: REACH["leaks"],
    MapClass.WALL: LIGHT.wall,
    MapClass.UNSEEN: LIGHT.unknown,
}
