"""What the team can get to on the map known so far, per robot type.

Carriers reach what is connected to them. Rovers reach what is connected to them or to a place where a carrier can set
them down: a cell close enough to a carrier's reach to dock. The territory keeps the footprints of all types up to date
as cells are revealed and answers for the team's current poses.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from marsupial.arrays import Ints
from marsupial.maps.footprint import Footprint, known_parts
from marsupial.maps.window import Window
from marsupial.model.feed import Feed
from marsupial.model.grid import Cell, Grid, Mask
from marsupial.model.robots import RobotType, Role


def dock_range_cells(carrier: RobotType, rover: RobotType, resolution_m: float) -> float:
    """Return how far apart, in cells, the centres of the two may be to dock: bodies touching, give or take a cell."""
    return (carrier.radius_m + rover.radius_m) / resolution_m + math.sqrt(2) + 1e-9


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Docking:
    """Where a rover type may stand to dock with a carrier type.

    `cells` is a mask (height, width) of rover cells; `carrier_at` returns for some of them (n,) the carrier's cell of
    each, both by row-major index.
    """

    cells: Mask
    carrier_at: Callable[[Ints], Ints]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Reach:
    """What each robot type can reach (masks by type name), and where pairs (carrier type, rover type) can dock.

    `fresh` holds, by type name, the cells (row-major) that are new in it, or there again.
    """

    by_type: Mapping[str, Mask]
    fresh: Mapping[str, Ints]
    docking: Mapping[tuple[str, str], Docking]


class Territory:
    """Footprints of all robot types on one growing map.

    Parameters
    ----------
    grid
        The known map; its cells may be revealed (by their owner) after this is made: call `reveal` then.

    Attributes
    ----------
    revision
        Goes up whenever something is revealed.
    revealed, cleared
        Hand on the cells (row-major indices) that are revealed, and those of them that one can see through.
    """

    def __init__(self, grid: Grid, kinds: Sequence[RobotType]) -> None:
        self.grid = grid
        self.kinds = {kind.name: kind for kind in kinds}
        self.see_through: Mask = np.zeros((grid.height, grid.width), dtype=np.bool_)
        self._prints: dict[tuple[float, frozenset[int]], Footprint] = {}
        self.footprints = {kind.name: self._footprint(kind) for kind in kinds}
        self.revision = 0
        self.revealed, self.cleared = Feed(), Feed()
        self._opaque = grid.opaque_codes()
        self._lowest, self._highest = Cell(grid.width, grid.height), Cell(-1, -1)
        for cells in known_parts(grid):
            self.reveal(cells)

    def reveal(self, indices: Ints) -> None:
        """Take in cells (row-major indices) that were unknown until now."""
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
        """Return the footprint of a type, which is one for all types with the same ground."""
        ground = kind.radius_m, kind.terrains
        if ground not in self._prints:
            self._prints[ground] = Footprint(self.see_through.shape, kind, self.grid.resolution_m)
        return self._prints[ground]

    @property
    def known(self) -> Window:
        """The window that holds every known cell and its neighbours; empty as long as nothing is known."""
        if self._highest.x < 0:
            return Window(0, 0, 0, 0)
        return Window.around(self._lowest, self._highest, 1, (self.grid.height, self.grid.width))

    def of_role(self, role: Role) -> tuple[RobotType, ...]:
        """Return the robot types of a role."""
        return tuple(kind for kind in self.kinds.values() if kind.role is role)
