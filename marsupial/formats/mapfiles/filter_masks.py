"""Masks of nav2's costmap filters, read beside a map: keepout areas and speed limits, as terrain.

nav2 looks masks up by place, so a mask may have another size, origin or resolution than the map; where it says
nothing, nothing changes. Only known cells that are no obstacle are painted.

- Keepout: cells of occupancy 100 become a terrain, which is no ground for the robot types that do not list it.
- Speed: nav2 reads an occupancy v as a limit of ``base + multiplier * v`` percent of the full speed. Robots here have
  one speed each, so limits become terrains by steps: a cell takes the terrain with the lowest percentage that its
  limit does not exceed. What is said of 0, or leads to no percentage, is no limit.

References: nav2's `keepout_filter.cpp` and `speed_filter.cpp`.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from marsupial.formats.mapfiles.occupancy import OCCUPIED, Occupancy, below
from marsupial.model.grid import OBSTACLE, UNKNOWN, CellArray, Grid

NOTHING = UNKNOWN
"""In an overlay: the cell stays what it is."""

BASE, MULTIPLIER = 100.0, -1.0
"""As nav2's example of a speed filter has them: the mask's values are what is taken off the full speed."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class KeepoutMask:
    """Where robots are not to go; `code` is the terrain it becomes."""

    occupancy: Occupancy
    code: int


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SpeedMask:
    """Where robots are to go slower.

    Parameters
    ----------
    percents
        For each terrain code the highest limit, in percent of the full speed, at which a cell becomes it.
    base, multiplier
        Of nav2's `CostmapFilterInfo`.
    """

    occupancy: Occupancy
    percents: Mapping[int, float]
    base: float = BASE
    multiplier: float = MULTIPLIER


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class FilterMasks:
    """The masks beside a map; keepout counts for more than speed."""

    keepout: KeepoutMask | None = None
    speed: SpeedMask | None = None

    def overlay(self, grid: Grid) -> CellArray:
        """Return the terrain code that each cell of a map becomes, `NOTHING` where it stays as it is."""
        codes = np.full(grid.cells.shape, NOTHING, dtype=np.uint8)
        if self.speed is not None:
            codes = _speed_codes(self.speed)[below(self.speed.occupancy, grid).view(np.uint8)]
        if self.keepout is not None:
            codes[below(self.keepout.occupancy, grid) == OCCUPIED] = self.keepout.code
        return codes

    def painted(self, grid: Grid) -> Grid:
        """Return the map with its masks painted in."""
        return replace(grid, cells=painted(grid.cells, self.overlay(grid)))


def painted(cells: CellArray, overlay: CellArray) -> CellArray:
    """Return the cells of a map, those that are known and no obstacle with what an overlay makes of them."""
    takes = (overlay != NOTHING) & (cells != OBSTACLE) & (cells != UNKNOWN)
    return np.where(takes, overlay, cells)


def _speed_codes(mask: SpeedMask) -> CellArray:
    """Return the terrain code for each of the 256 bytes of an occupancy."""
    values = np.arange(256, dtype=np.uint8).view(np.int8).astype(np.float64)
    limits = mask.base + mask.multiplier * values
    limited = (values > 0) & (values <= OCCUPIED) & (limits > 0) & (limits <= 100)
    table = np.full(256, NOTHING, dtype=np.uint8)
    for code, percent in sorted(mask.percents.items(), key=lambda item: -item[1]):
        table[limited & (limits <= percent)] = code
    return table
