"""The known map with the footprints of all robot types, and the values that describe a team's reach.

Carriers reach what is connected to their positions. Rovers reach what is connected to theirs, or to a cell where a
carrier can set them down: close enough to the carrier's reach to dock.
"""

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from marsupial.arrays import Floats, Ints
from marsupial.maps.footprint import Footprint, known_parts
from marsupial.maps.window import Window
from marsupial.model import Cell, Grid, Mask, RobotType, Role
from marsupial.model.feed import Feed
from marsupial.paths.fields import PathSearch


def dock_range_cells(carrier: RobotType, rover: RobotType, resolution_m: float) -> float:
    """Return the docking range in cells between the centres of two robots: bodies touching, to within a cell."""
    return (carrier.radius_m + rover.radius_m) / resolution_m + math.sqrt(2) + 1e-9


def contact_range_cells(rover: RobotType, kinds: Iterable[RobotType], resolution_m: float) -> float:
    """Return how far in cells a rover type's radio reaches; rovers that are near enough to dock are in contact."""
    if rover.radio_range_m is None:
        return math.inf
    docking = (dock_range_cells(kind, rover, resolution_m) for kind in kinds if kind.role is Role.CARRIER)
    return max(rover.radio_range_m / resolution_m + 1e-9, *docking)


def ways_from(cell: Cell, limit: float, see_through: Mask) -> tuple[Window, Floats]:
    """Return a window, and in it the lengths in cells of see-through paths from a cell, inf beyond a limit."""
    window = Window.around(cell, cell, int(limit) + 1, see_through.shape)
    here = Cell(cell.x - window.left, cell.y - window.bottom)
    return window, PathSearch(see_through[window.cut]).field(here, limit=limit)


def within_range(one: Cell, other: Cell, limit: float, see_through: Mask) -> bool:
    """Return whether a see-through path of at most `limit` cells joins two cells: robots do not dock through walls."""
    if math.dist(one, other) > limit:
        return False
    window, lengths = ways_from(one, limit, see_through)
    return bool(np.isfinite(lengths[other.y - window.bottom, other.x - window.left]))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Docking:
    """Where a rover type may stand to dock with a carrier type."""

    cells: Mask  # (height, width): cells of the rover
    carrier_at: Callable[[Ints], Ints]  # returns the carrier's cell for each of n, by row-major index


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Reach:
    """What each robot type can reach (masks by type name), and where pairs (carrier type, rover type) can dock."""

    by_type: Mapping[str, Mask]
    fresh: Mapping[str, Ints]  # by type, the cells (row-major) added since the previous reach
    docking: Mapping[tuple[str, str], Docking]


class Territory:
    """Footprints of all robot types on one growing map; its owner calls `reveal` for new cells."""

    def __init__(self, grid: Grid, kinds: Sequence[RobotType]) -> None:
        self.grid = grid
        self.kinds = {kind.name: kind for kind in kinds}
        self.see_through: Mask = np.zeros((grid.height, grid.width), dtype=np.bool_)
        self._prints: dict[tuple[float, frozenset[int]], Footprint] = {}
        self.footprints = {kind.name: self._footprint(kind) for kind in kinds}
        self.revision = 0  # increases with every reveal
        self.revealed, self.cleared = Feed(), Feed()  # cells (row-major): all, and the see-through ones
        self._opaque = grid.opaque_codes()
        self._lowest, self._highest = Cell(grid.width, grid.height), Cell(-1, -1)
        for cells in known_parts(grid):
            self.reveal(cells)

    def reveal(self, indices: Ints) -> None:
        """Update everything for cells (row-major indices) that were unknown until now."""
        if not len(indices):
            return
        self.revision += 1
        clear = indices[self._opaque[self.grid.cells.ravel()[indices]] == 0]
        self.see_through.ravel()[clear] = True
        x = indices % self.grid.width
        bottom, top = int(indices.min()) // self.grid.width, int(indices.max()) // self.grid.width
        self._lowest = Cell(min(self._lowest.x, int(x.min())), min(self._lowest.y, bottom))
        self._highest = Cell(max(self._highest.x, int(x.max())), max(self._highest.y, top))
        for footprint in self._prints.values():
            footprint.reveal(indices, self.grid.cells)
        self.revealed.add(indices)
        self.cleared.add(clear)

    def _footprint(self, kind: RobotType) -> Footprint:
        """Return the footprint of a type, shared by types of the same radius and terrains."""
        ground = kind.radius_m, kind.terrains
        if ground not in self._prints:
            self._prints[ground] = Footprint(self.see_through.shape, kind, self.grid.resolution_m)
        return self._prints[ground]

    @property
    def known(self) -> Window:
        """The window of all known cells and their neighbours; empty while nothing is known."""
        if self._highest.x < 0:
            return Window(0, 0, 0, 0)
        return Window.around(self._lowest, self._highest, 1, (self.grid.height, self.grid.width))

    def of_role(self, role: Role) -> tuple[RobotType, ...]:
        return tuple(kind for kind in self.kinds.values() if kind.role is role)
