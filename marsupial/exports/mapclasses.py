"""How a map is interpreted, cell by cell: who can stand where, islands that are cut off, leaks at the border."""

from collections.abc import Sequence
from enum import IntEnum
from typing import NamedTuple

import numpy as np

from marsupial.maps.footprint import footprint_of
from marsupial.maps.reach import parts
from marsupial.model import OBSTACLE, UNKNOWN, CellArray, Grid, Mask, RobotType, Role
from marsupial.model.grid import ground_in
from marsupial.replay.palette import LIGHT, REACH


class MapClass(IntEnum):
    """The class of a cell; obstacles and unknown cells keep their codes on the grid."""

    WALL = OBSTACLE
    CARRIERS = 1
    ROVERS = 2
    NARROW = 3
    ISLAND = 4
    LEAK = 5
    UNSEEN = UNKNOWN


class Look(NamedTuple):
    """How a class is shown: its label, its colour, and its letter where there are no colours."""

    text: str
    colour: str
    letter: str


LOOKS = {
    MapClass.CARRIERS: Look("carriers can stand here", REACH["carriers"], "."),
    MapClass.ROVERS: Look("only rovers can", REACH["rovers"], "o"),
    MapClass.NARROW: Look("free, too narrow for all", REACH["narrow"], "-"),
    MapClass.ISLAND: Look("island: cut off from the rest", REACH["islands"], "x"),
    MapClass.LEAK: Look("leak at the border", REACH["leaks"], "!"),
    MapClass.WALL: Look("obstacle", LIGHT.wall, "#"),
    MapClass.UNSEEN: Look("unknown", LIGHT.unknown, " "),
}
"""The look of each class, in the order of a legend."""

LEAK_M = 0.3  # depth of the marks of leaks along the border: a line of one cell would not be seen
LEAST_ISLANDS_M2 = 0.05  # least area of all islands together: smaller ones could not be seen


def map_classes(grid: Grid, kinds: Sequence[RobotType]) -> CellArray:
    """Return the `MapClass` of every cell, uint8 (height, width)."""
    # A robot can stand on an island, but no robot gets from there to the largest connected area. A leak is free ground
    # at the border that is connected to that area.
    free = ground_in(grid.cells)
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
    nowhere = np.zeros(grid.cells.shape, dtype=np.bool_)
    return np.logical_or.reduce([nowhere, *(footprint_of(grid, kind).standable for kind in kinds)])


def _leak(grid: Grid, free: Mask, area: Mask) -> Mask:
    """Return the free cells within `LEAK_M` of open border cells, which are connected to `area` over free ground."""
    from scipy import ndimage  # its import takes a sixth of a second, and servers need it for previews only

    labels, count = parts(free)
    with_area = np.zeros(count + 1, dtype=np.bool_)
    with_area[labels[area]] = True
    deep = max(1, round(LEAK_M / grid.resolution_m))
    rows, columns = (np.minimum(np.arange(size), np.arange(size)[::-1]) for size in free.shape)
    depth = np.minimum.outer(rows, columns)  # cells between a cell and the border
    # Only outermost cells leak: there a robot would drive off the map. The cells around them make the mark visible.
    leaking = (depth == 0) & free & with_area[labels]
    near = ndimage.binary_dilation(leaking, np.ones((3, 3), dtype=np.bool_), iterations=deep)
    return np.asarray((depth < deep) & near & free)
