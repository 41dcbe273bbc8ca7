"""Where robots have room beside each other: the distances between claims, and ways around them."""

import math
from collections.abc import Iterable, Mapping

import numpy as np

from marsupial.maps.footprint import footprint_of
from marsupial.maps.targets import cell_at
from marsupial.model import UNKNOWN, Cell, Mask, RobotType
from marsupial.model.zones import ZoneChange, Zones, changed, zoned
from marsupial.paths.fields import PathSearch
from marsupial.paths.routes import Route
from marsupial.sim.motion import Motion

ClaimedCells = tuple[Cell, Cell]
"""The ends of the line that a robot is on: a cell twice, or two neighbouring ones."""

_ROUNDING = 1e-9  # how much nearer than the sum of their radii robots count as touching: sums of radii are rounded


class Clearance:
    """Finds room and ways for robots on the known map."""

    def __init__(self, motion: Motion, kinds: Mapping[str, RobotType]) -> None:
        self._motion = motion
        self._zones: Zones = {}  # that hold
        self._apart = {
            (a.name, b.name): (a.radius_m + b.radius_m) / motion.grid.resolution_m - _ROUNDING
            for a in kinds.values()
            for b in kinds.values()
        }
        self._standable: dict[str, tuple[tuple[int, int], Mask]] = {}  # by type: what is known, and the resulting mask

    def apart(self, kind: RobotType, other: RobotType) -> float:
        """Return the minimum distance of two robots in cells: the sum of their radii."""
        return self._apart[kind.name, other.name]

    def change_zone(self, change: ZoneChange) -> None:
        """Take note that a zone holds from now on, or no more: robots make no room and no detours in no-go zones."""
        self._zones = changed(self._zones, [change])
        self._standable.clear()

    def ground(self, kind: RobotType) -> Mask:
        """Return the mask of known cells on which a robot can stand; it must not be changed."""
        grid = self._motion.grid
        known = int(np.count_nonzero(grid.cells != UNKNOWN)), self._motion.changes
        if kind.name not in self._standable or self._standable[kind.name][0] != known:
            self._standable[kind.name] = known, footprint_of(zoned(grid, self._zones), kind).standable
        return self._standable[kind.name][1]

    def room(self, kind: RobotType, here: Cell, others: Iterable[tuple[RobotType, ClaimedCells]]) -> Mask:
        """Return the mask of the cells on which a robot can stand clear of these others, and of its own cell."""
        room = self.ground(kind).copy()
        for other, claim in others:
            _bar(room, claim, self.apart(kind, other))
        room[here.y, here.x] = True
        return room

    def route(self, kind: RobotType, start: Cell, goal: Cell, room: Mask | None = None) -> Route | None:
        """Return the shortest route, in a room or else anywhere on known ground."""
        return PathSearch(self.ground(kind) if room is None else room, kind.diagonal).route(start, goal)

    def refuge(self, kind: RobotType, here: Cell, room: Mask, way: Iterable[Cell], other: RobotType) -> Route | None:
        """Return the route to the nearest cell in a room that is clear of another robot's route."""
        lengths = PathSearch(room, kind.diagonal).field(here)
        free = room.copy()
        free[here.y, here.x] = False
        _bar(free, way, self.apart(kind, other))
        lengths[~free] = math.inf
        nearest = int(lengths.argmin())
        if not math.isfinite(lengths.flat[nearest]):
            return None
        return self.route(kind, here, cell_at(nearest, room.shape[1]), room)


def gap(one: ClaimedCells, other: ClaimedCells) -> float:
    """Return the distance in cells between two claims."""
    (p, q), (a, b) = one, other
    if (p.x + q.x, p.y + q.y) == (a.x + b.x, a.y + b.y) and p != q and a != b:
        return 0.0  # they swap cells, or cross: diagonals of one square are the only lines that cross
    return min(_off(p, other), _off(q, other), _off(a, one), _off(b, one))


def _off(cell: Cell, claim: ClaimedCells) -> float:
    """Return the distance of a cell from a claim."""
    a, b = claim
    x, y, dx, dy = cell.x - a.x, cell.y - a.y, b.x - a.x, b.y - a.y
    share = 0.0 if a == b else min(max((x * dx + y * dy) / (dx * dx + dy * dy), 0.0), 1.0)
    return math.hypot(x - share * dx, y - share * dy)


def _bar(mask: Mask, cells: Iterable[Cell], apart: float) -> None:
    """Remove from a mask all cells nearer than `apart` to one of these claims."""
    reach = math.ceil(apart)
    span = np.arange(-reach, reach + 1)
    near = np.hypot(span[:, None], span[None, :]) < apart
    height, width = mask.shape
    for cell in cells:
        top, left = max(0, cell.y - reach), max(0, cell.x - reach)
        bottom, right = min(height, cell.y + reach + 1), min(width, cell.x + reach + 1)
        x, y = cell.x - reach, cell.y - reach
        mask[top:bottom, left:right] &= ~near[top - y : bottom - y, left - x : right - x]
