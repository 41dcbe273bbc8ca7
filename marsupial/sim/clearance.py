"""Where robots can stand clear of each other on the known map, and their ways there."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping

import numpy as np

from marsupial.maps.footprint import standable
from marsupial.model import UNKNOWN, Cell, Grid, Mask, RobotType
from marsupial.paths.fields import PathSearch
from marsupial.paths.routes import Route

Claim = tuple[Cell, Cell]
"""The ends of the line that a robot is on: a cell twice, or two neighbouring ones."""

_CLOSE = 1e-9


class Clearance:
    """Finds room and ways for robots on a known map, whose cells become known but never change."""

    def __init__(self, grid: Grid, kinds: Mapping[str, RobotType]) -> None:
        self._grid = grid
        self._apart = {
            (a.name, b.name): (a.radius_m + b.radius_m) / grid.resolution_m - _CLOSE
            for a in kinds.values()
            for b in kinds.values()
        }
        self._standable: dict[str, tuple[int, Mask]] = {}  # by type: how many cells were known, and what follows

    def apart(self, kind: RobotType, other: RobotType) -> float:
        """Return how far two robots have to be apart, in cells: the sum of their radii."""
        return self._apart[kind.name, other.name]

    def ground(self, kind: RobotType) -> Mask:
        """Return the mask of known cells on which a robot can stand; it must not be changed."""
        known = int(np.count_nonzero(self._grid.cells != UNKNOWN))
        if self._standable.get(kind.name, (0,))[0] != known:
            self._standable[kind.name] = known, standable(self._grid, kind)
        return self._standable[kind.name][1]

    def room(self, kind: RobotType, here: Cell, others: Iterable[tuple[RobotType, Claim]]) -> Mask:
        """Return the mask of those on which a robot can stand clear of these others, and of the cell where it is."""
        room = self.ground(kind).copy()
        for other, claim in others:
            _bar(room, claim, self.apart(kind, other))
        room[here.y, here.x] = True
        return room

    def route(self, kind: RobotType, start: Cell, goal: Cell, room: Mask | None = None) -> Route | None:
        """Return the shortest route, in a room or else anywhere on known ground."""
        return PathSearch(self.ground(kind) if room is None else room, kind.diagonal).route(start, goal)

    def refuge(self, kind: RobotType, here: Cell, room: Mask, way: Iterable[Cell], other: RobotType) -> Route | None:
        """Return the route to the nearest cell in a room that is clear of the way of another robot."""
        lengths = PathSearch(room, kind.diagonal).field(here)
        free = room.copy()
        free[here.y, here.x] = False
        _bar(free, way, self.apart(kind, other))
        lengths[~free] = math.inf
        nearest = int(lengths.argmin())
        if not math.isfinite(lengths.flat[nearest]):
            return None
        return self.route(kind, here, Cell(nearest % room.shape[1], nearest // room.shape[1]), room)


def gap(one: Claim, other: Claim) -> float:
    """Return the distance in cells between two claims."""
    (p, q), (a, b) = one, other
    if (p.x + q.x, p.y + q.y) == (a.x + b.x, a.y + b.y) and p != q and a != b:
        return 0.0  # they swap cells, or cross: diagonals of one square are the only lines that cross
    return min(_off(p, other), _off(q, other), _off(a, one), _off(b, one))


def _off(cell: Cell, claim: Claim) -> float:
    """Return the distance of a cell from a claim."""
    a, b = claim
    x, y, dx, dy = cell.x - a.x, cell.y - a.y, b.x - a.x, b.y - a.y
    share = 0.0 if a == b else min(max((x * dx + y * dy) / (dx * dx + dy * dy), 0.0), 1.0)
    return math.hypot(x - share * dx, y - share * dy)


def _bar(mask: Mask, cells: Iterable[Cell], apart: float) -> None:
    """Take out of a mask all cells nearer than `apart` to one of these."""
    reach = math.ceil(apart)
    span = np.arange(-reach, reach + 1)
    near = np.hypot(span[:, None], span[None, :]) < apart
    height, width = mask.shape
    for cell in cells:
        top, left = max(0, cell.y - reach), max(0, cell.x - reach)
        bottom, right = min(height, cell.y + reach + 1), min(width, cell.x + reach + 1)
        rows, columns = (
            slice(top - cell.y + reach, bottom - cell.y + reach),
            slice(left - cell.x + reach, right - cell.x + reach),
        )
        mask[top:bottom, left:right] &= ~near[rows, columns]
