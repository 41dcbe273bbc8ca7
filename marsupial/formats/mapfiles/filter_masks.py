"""Masks of nav2's costmap filters, keepout areas and speed limits, as terrain.

nav2 looks up the mask at a cell's position in the world, so a mask may have another size, origin or resolution than the
map; cells outside of it don't change. Only known cells without obstacle are painted.

- Keepout: cells of occupancy 100 become a terrain that robot types can't drive on unless they list it.
- Speed: nav2 reads an occupancy v as a limit of ``base + multiplier * v`` percent of the full speed. Robots here have
  one speed each, so limits become terrains by steps: a cell takes the terrain with the lowest percentage that its
  limit does not exceed. An occupancy of 0, and one whose limit is no percentage, means no limit.

References: nav2's `keepout_filter.cpp` and `speed_filter.cpp`.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from marsupial.formats.mapfiles.occupancy import OCCUPIED, Occupancy, occupancy_on
from marsupial.model.grid import OBSTACLE, UNKNOWN, CellArray, Grid

NOTHING = UNKNOWN  # the value of an overlay where the cell does not change

BASE, MULTIPLIER = 100.0, -1.0
"""The values of nav2's example of a speed filter: the mask says how many percent to take off the full speed."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class KeepoutMask:
    """The areas that robots must not enter; they become the terrain `code`."""

    occupancy: Occupancy
    code: int


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SpeedMask:
    """The areas with speed limits."""

    occupancy: Occupancy
    # by terrain code the highest limit, in percent of the full speed, of cells that become this terrain
    percents: Mapping[int, float]
    # base, multiplier: the fields of nav2's `CostmapFilterInfo`
    base: float = BASE
    multiplier: float = MULTIPLIER


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class FilterMasks:
    """The masks of a map; keepout overrides speed."""

    keepout: KeepoutMask | None = None
    speed: SpeedMask | None = None

    def overlay(self, grid: Grid) -> CellArray:
        """Return the terrain code that each cell of a map becomes, `NOTHING` where it does not change."""
        codes = np.full(grid.cells.shape, NOTHING, dtype=np.uint8)
        if self.speed is not None:
            codes = _speed_codes(self.speed)[occupancy_on(self.speed.occupancy, grid).view(np.uint8)]
        if self.keepout is not None:
            codes[occupancy_on(self.keepout.occupancy, grid) == OCCUPIED] = self.keepout.code
        return codes

    def painted(self, grid: Grid) -> Grid:
        """Return the map with the masks painted over it."""
        return replace(grid, cells=painted(grid.cells, self.overlay(grid)))


def painted(cells: CellArray, overlay: CellArray) -> CellArray:
    """Return the cells of a map with an overlay painted over those that are known and no obstacle."""
    takes = (overlay != NOTHING) & (cells != OBSTACLE) & (cells != UNKNOWN)
    return np.where(takes, overlay, cells)


def _speed_codes(mask: SpeedMask) -> CellArray:
    """Return the terrain code for each of the 256 values of an occupancy's byte."""
    # int8 occupancies index the table as uint8: byte 255 is -1.
    values = np.arange(256, dtype=np.uint8).view(np.int8).astype(np.float64)
    limits = mask.base + mask.multiplier * values
    limited = (values > 0) & (values <= OCCUPIED) & (limits > 0) & (limits <= 100)
    table = np.full(256, NOTHING, dtype=np.uint8)
    # From the highest percentage down, so that the lowest that still allows the limit is painted last.
    for code, percent in sorted(mask.percents.items(), key=lambda item: -item[1]):
        table[limited & (limits <= percent)] = code
    return table
