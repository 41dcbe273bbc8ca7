"""Where to look for ground to set rovers down on, once no frontier is left.

Robots sense the ground beside them, so they explore all ground connected to their positions. They may miss ground that
a rover reaches only when a carrier sets it down: the docking range can exceed the contact range, and even the sensor
range. While unknown cells of such ground are visible from a reachable cell, a robot drives there and looks. So the
explored area does not depend on what robots happen to see on their way. Ground on which a rover could hardly move, such
as the unseen corner of a room, is not worth the drive, nor is less than what makes a frontier a target.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np

from marsupial.arrays import Flags, Ints
from marsupial.maps.discs import least_cells
from marsupial.maps.footprint import Contact, Footprint, covered
from marsupial.maps.reach import groups, parts
from marsupial.maps.sight import Sight, hopeful_codes
from marsupial.maps.targets import Frontier, cell_at
from marsupial.maps.territory import Territory, dock_range_cells
from marsupial.maps.window import Window
from marsupial.model import UNKNOWN, Cell, FrameShift, Mask, Role
from marsupial.model.seats import most_aboard
from marsupial.paths.nearest import Nearest

GAP_CELLS = 2.0 + 1e-6  # how far from a rover's body a cell between it and the carrier it docks with may be


@dataclass(slots=True)
class Looks:
    """Where robots were sent to look, and cells that stayed unknown because sensors show less than they could."""

    # offered, made: (robot type, cell (row-major) to look from); the pairs whose look has been made since
    offered: set[tuple[str, int]] = field(default_factory=set)
    made: set[tuple[str, int]] = field(default_factory=set)
    in_vain: set[int] = field(default_factory=set)  # cells (row-major) that stayed unknown after a look

    def make(self, kind: str, stand: int) -> None:
        """Note that a robot of a type has explored from a cell (row-major)."""
        if (kind, stand) in self.offered:
            self.offered.remove((kind, stand))
            self.made.add((kind, stand))

    def moved(self, shift: FrameShift) -> Looks:
        """Return the looks re-indexed for a larger frame."""
        return Looks(
            offered={(name, shift.index(stand)) for name, stand in self.offered},
            made={(name, shift.index(stand)) for name, stand in self.made},
            in_vain=set(map(shift.index, self.in_vain)),
        )


class Landings:
    """Finds where to look for ground to set rovers down on, on one growing map; `looks` are kept up to date."""

    def __init__(self, territory: Territory, looks: Looks, least_ground: float = 0.0) -> None:
        self._territory, self._looks = territory, looks
        self._grid = grid = territory.grid
        self._least = least_cells(territory.kinds.values(), grid.resolution_m, least_ground)
        self._sight = Sight(grid.cells, hopeful_codes(grid))
        self._contact = {name: Contact(kind, grid.resolution_m) for name, kind in territory.kinds.items()}
        self._ranges = {name: kind.sensor_range_m / grid.resolution_m for name, kind in territory.kinds.items()}
        self._bodies = {name: kind.radius_m / grid.resolution_m for name, kind in territory.kinds.items()}
        self._wanted: Flags = np.zeros(grid.cells.size, dtype=np.bool_)
        self._found: tuple[object, Mapping[str, Frontier]] | None = None

    def frontiers(self, reach: Mapping[str, Mask], rovers: Collection[str]) -> Mapping[str, Frontier]:
        """Return the looks of each type as its frontier, given the reach of all types and the rover types."""
        counts = {name: int(np.count_nonzero(cells)) for name, cells in reach.items()}
        now = self._territory.revision, frozenset(rovers), counts
        if self._found is None or self._found[0] != now or self._looks.made:
            prints = self._territory.footprints
            zoning = self._grid.zoning
            inside = True if zoning is None or zoning.inside is None else zoning.inside
            landings = {
                name: roomy(prints[name].possible & ~reach[name] & inside, prints[name], self._least[name])
                for name in rovers
            }
            self._found = now, self.towards(landings, reach)
        return self._found[1]

    def towards(self, landings: Mapping[str, Mask], reach: Mapping[str, Mask]) -> Mapping[str, Frontier]:
        """Return the result of `frontiers` for rovers with possible `landings` (height, width), by type."""
        width = self._grid.width
        found: dict[str, set[int]] = {name: set() for name in self._territory.kinds}
        unknown = self._not_in_vain(self._unknown_of(landings, reach))
        self._wanted[unknown] = True
        carriers_first = sorted(found, key=lambda name: (self._territory.kinds[name].role, name))
        for group in groups(unknown, self._grid.cells.shape):
            for name in carriers_first:
                stand = self._stand(name, reach[name], group)
                if stand is not None:
                    found[name].add(stand.y * width + stand.x)
                    break
        self._wanted[unknown] = False
        self._looks.offered |= {(name, stand) for name, stands in found.items() for stand in stands}
        stands = {name: np.array(sorted(cells), dtype=np.int64) for name, cells in found.items()}
        return {name: Frontier(cells=cells, viewpoints=cells) for name, cells in stands.items()}

    def _unknown_of(self, landings: Mapping[str, Mask], reach: Mapping[str, Mask]) -> Ints:
        """Return the unknown cells, ascending, that decide whether a rover can be set down on `landings`."""
        unknown = self._grid.cells == UNKNOWN
        found = np.zeros_like(unknown)
        for carrier in self._territory.of_role(Role.CARRIER):
            for name, possible in landings.items():
                if most_aboard(carrier, name) and possible.any() and reach[carrier.name].any():
                    limit = dock_range_cells(carrier, self._territory.kinds[name], self._grid.resolution_m)
                    body = self._bodies[name]
                    around = _around(possible, int(limit + body + GAP_CELLS) + 1)
                    passable = (self._territory.see_through | unknown) & around
                    near = _within(limit, reach[carrier.name] & around, passable)
                    places = np.flatnonzero(near & possible)
                    found |= covered(places, body, found.shape)
                    found |= near & covered(places, body + GAP_CELLS, found.shape)
        return np.flatnonzero(found & unknown)

    def _not_in_vain(self, unknown: Ints) -> Ints:
        """Update `in_vain` with the latest looks; return the cells that are not in it."""
        for name, stand in self._looks.made:
            cell = cell_at(stand, self._grid.width)
            seen = np.union1d(self._sight.visible(cell, self._ranges[name]), self._touched(name, cell))
            self._looks.in_vain.update(np.intersect1d(unknown, seen).tolist())
        self._looks.made.clear()
        return np.setdiff1d(unknown, np.array(sorted(self._looks.in_vain), dtype=np.int64))

    def _stand(self, name: str, reach: Mask, group: Ints) -> Cell | None:
        """Return the nearest reachable cell from which a type sees wanted cells, or else touches one."""
        shape, width = reach.shape, self._grid.width
        y, x = np.divmod(group, width)

        def nearest(far_cells: float) -> Iterator[Ints]:
            """Yield the cells in rings, each by distance: most often one of the first sees something."""
            around = _box(group, int(far_cells) + 1, shape)
            cells = around.on_map(np.flatnonzero(reach[around.cut]), width)
            apart = np.hypot(cells // width - y.mean(), cells % width - x.mean())
            for inner, outer in pairwise((-1.0, far_cells / 8, far_cells / 4, far_cells / 2, math.inf)):
                ring = np.flatnonzero((apart > inner) & (apart <= outer))
                yield cells[ring[np.argsort(apart[ring], kind="stable")]]

        window = _box(group, 0, shape)
        for stands in nearest(self._ranges[name]):
            seeing = self._sight.first_to_see(stands, self._wanted, window, self._ranges[name])
            if seeing is not None:
                return seeing
        beside = (cell_at(index, width) for ring in nearest(self._bodies[name] + 1) for index in ring.tolist())
        return next((cell for cell in beside if self._wanted[self._touched(name, cell)].any()), None)

    def _touched(self, name: str, cell: Cell) -> Ints:
        return self._contact[name].touched(self._grid.cells, cell)


def roomy(ground: Mask, footprint: Footprint, least: int = 0) -> Mask:
    """Return the connected parts of a rover's ground (height, width) with more cells than its footprint and `least`."""
    labels, _ = parts(ground)
    sizes = np.bincount(labels.ravel())
    sizes[0] = 0
    return np.asarray((sizes > max(len(footprint.offsets), least))[labels])


def _around(ground: Mask, margin: int) -> Mask:
    """Return the cells (height, width) with ground in the square of side 2 * margin + 1 round them."""
    height, width = ground.shape
    sums = np.zeros((height + 1, width + 1), dtype=np.int32)  # of all ground below and to the left
    np.cumsum(ground, axis=0, dtype=np.int32, out=sums[1:, 1:])
    np.cumsum(sums[1:, 1:], axis=1, out=sums[1:, 1:])
    low_y, high_y = np.clip(np.arange(height) - margin, 0, None), np.clip(np.arange(height) + margin + 1, None, height)
    low_x, high_x = np.clip(np.arange(width) - margin, 0, None), np.clip(np.arange(width) + margin + 1, None, width)
    rows = sums[high_y] - sums[low_y]
    return np.asarray(rows[:, high_x] > rows[:, low_x])


def _box(group: Ints, margin: int, shape: tuple[int, int]) -> Window:
    """Return the box round some cells (row-major), with a margin in cells."""
    y, x = np.divmod(group, shape[1])
    return Window.around(Cell(int(x.min()), int(y.min())), Cell(int(x.max()), int(y.max())), margin, shape)


def _within(limit: float, area: Mask, passable: Mask) -> Mask:
    """Return the area and all cells (height, width) within `limit` cells of it over passable ground."""
    padded = np.pad(area, 1)
    inner = area.copy()
    for dy in range(3):
        for dx in range(3):
            inner &= padded[dy : dy + area.shape[0], dx : dx + area.shape[1]]
    near = area.copy()
    near.ravel()[Nearest(passable, limit).add(np.flatnonzero(area & ~inner))] = True
    return near
