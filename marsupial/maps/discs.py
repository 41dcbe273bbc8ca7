"""Where the disc of a robot may stand on a map as it is; `footprint` keeps that up to date while a map is revealed.

This module needs no compiled code: programs import it that only ask about a few places.
"""

import math
from collections.abc import Iterable

import numpy as np

from marsupial.arrays import Ints
from marsupial.model.grid import Cell, Grid, Mask, code_table
from marsupial.model.robots import RobotType


def disc(radius_cells: float) -> Ints:
    """Return the offsets (n, 2) as (dx, dy) of the cells with their centre in an open disc, (0, 0) always included."""
    reach = int(radius_cells + 1)
    span = np.arange(-reach, reach + 1)
    touched = np.hypot(span[None, :], span[:, None]) < radius_cells - 1e-9
    touched[reach, reach] = True
    return np.ascontiguousarray(np.argwhere(touched)[:, ::-1] - reach)


def least_cells(kinds: Iterable[RobotType], resolution_m: float, footprints: float) -> dict[str, int]:
    """Return how many cells are as large as some footprints of each type, by name.

    They are none where a type is no larger than a cell: no slit of such a map is narrower than a robot, a few cells can
    be a room, and what is left out for others is only explored later.
    """
    sizes = {kind.name: len(disc(kind.radius_m / resolution_m)) for kind in kinds}
    coarse = min(sizes.values()) == 1
    return {name: 0 if coarse else math.ceil(footprints * size) for name, size in sizes.items()}


def fits(grid: Grid, kind: RobotType, *cells: Cell) -> bool:
    """Return whether a robot of a type may stand on all of these cells, without reading the rest of the map."""
    offsets, at = disc(kind.radius_m / grid.resolution_m), np.array(cells, dtype=np.int64).reshape(-1, 2)
    reach = offsets.max()  # in all four directions, so the outermost cells tell whether all discs are inside
    if (at < reach).any() or (at >= (grid.width - reach, grid.height - reach)).any():
        return False
    row = (1, grid.width)
    return bool(code_table(kind.terrains)[grid.cells.ravel()[(at @ row)[:, None] + offsets @ row]].all())


def standable(grid: Grid, kind: RobotType) -> Mask:
    """Return the cells (height, width) where a robot of a type may stand; for a small part of a map."""
    offsets = disc(kind.radius_m / grid.resolution_m)
    reach, (height, width) = int(offsets.max()), grid.cells.shape
    drivable = np.pad(code_table(kind.terrains)[grid.cells], reach)  # nothing to stand on beyond the edges
    moved = (drivable[reach + v : reach + v + height, reach + u : reach + u + width] for u, v in offsets)
    return np.logical_and.reduce(list(moved))
