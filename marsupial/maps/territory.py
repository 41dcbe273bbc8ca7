"""What the team can get to on the map known so far, per robot type.

Carriers reach what is connected to them. Rovers reach what is connected to them or to a place where a carrier can set
them down: a cell close enough to a carrier's reach to dock. The territory keeps the footprints of all types up to date
as cells are revealed and answers for the team's current poses.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from marsupial.arrays import Ints32
from marsupial.maps.footprint import Footprint
from marsupial.maps.window import Window
from marsupial.model.grid import UNKNOWN, Cell, Grid, Mask
from marsupial.model.robots import RobotType, Role


def dock_range_cells(carrier: RobotType, rover: RobotType, resolution_m: float) -> float:
    """Return how far apart, in cells, the centres of the two may be to dock: bodies touching, give or take a cell."""
    return (carrier.radius_m + rover.radius_m) / resolution_m + math.sqrt(2) + 1e-9


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Docking:
    """Where a rover type may stand to dock with a carrier type.

    `cells` is a mask (height, width) of rover cells; `carrier_at` the row-major index of the carrier's cell for each,
    -1 elsewhere.
    """

    cells: Mask
    carrier_at: Ints32


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Reach:
    """What each robot type can reach (masks by type name), and where pairs (carrier type, rover type) can dock.

    `fresh` holds, by type name, the cells (row-major) that are new in it, or there again.
    """

    by_type: Mapping[str, Mask]
    fresh: Mapping[str, npt.NDArray[np.int64]]
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
    revealed
        Per revision the cells (row-major indices) that were revealed.
    opened
        Per revision the cells (row-major indices) where a type can stand from then on, by type; under the empty name
        those that one can see through.
    """

    def __init__(self, grid: Grid, kinds: Sequence[RobotType]) -> None:
        self.grid = grid
        self.kinds = {kind.name: kind for kind in kinds}
        self.see_through: Mask = np.zeros((grid.height, grid.width), dtype=np.bool_)
        self._prints: dict[tuple[float, frozenset[int]], Footprint] = {}
        self.footprints = {kind.name: self._footprint(kind) for kind in kinds}
        self.revision = 0
        self.revealed: list[npt.NDArray[np.int64]] = []
        self.opened: list[Mapping[str, Ints32]] = []
        self._opaque = grid.opaque_codes()
        self._lowest, self._highest = Cell(grid.width, grid.height), Cell(-1, -1)
        self.reveal(np.flatnonzero(grid.cells != UNKNOWN))

    def reveal(self, indices: npt.NDArray[np.int64]) -> None:
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
        opened = {name: footprint.opened[-1] for name, footprint in self.footprints.items()}
        self.revealed.append(indices)
        self.opened.append({"": clear.astype(np.int32)} | opened)

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
