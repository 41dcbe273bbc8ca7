"""Masks that paint terrain over a map: images of terrain classes, and nav2's keepout areas and speed limits.

Only known cells without obstacle are painted; walls and unknown cells don't change.

- Terrain: the grey of an image of the map's size gives the class of each cell, except at transparent pixels.
- Keepout: cells of occupancy 100 become a terrain that robot types can't drive on unless they list it.
- Speed: nav2 reads an occupancy v as a limit of ``base + multiplier * v`` percent of the full speed. Robots here have
  one speed each, so limits become terrains by steps: a cell takes the terrain with the lowest percentage that its
  limit does not exceed. An occupancy of 0, and one whose limit is not a percentage, means no limit.

nav2 looks up its masks at a cell's position in the world, so these may have another size, origin or resolution than
the map; cells outside of them don't change.

References: nav2's `keepout_filter.cpp` and `speed_filter.cpp`.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from marsupial.errors import MapError, Problem
from marsupial.formats.files import raise_any
from marsupial.formats.mapfiles.cropping import cut
from marsupial.formats.mapfiles.images import GreyImage, read_grey
from marsupial.formats.mapfiles.occupancy import OCCUPIED, Occupancy, occupancy_on
from marsupial.model.grid import UNKNOWN, CellArray, CroppedFrame, Grid, ground_in
from marsupial.wording import counted

NOTHING = UNKNOWN  # the value of an overlay where the cell does not change

# The values of nav2's example of a speed filter: the mask says how many percent to take off the full speed.
BASE, MULTIPLIER = 100.0, -1.0


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
    return np.where((overlay != NOTHING) & ground_in(cells), overlay, cells)


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


def read_mask(grid: Grid, mask_path: Path | str, codes: Mapping[int, int], frame: CroppedFrame | None = None) -> Grid:
    """Return the grid with the terrain classes of a mask image in a file; see `apply_mask`."""
    source = str(mask_path)
    _check_codes(codes, grid, source)
    mask = read_grey(Path(mask_path), field="mask", source=source)
    return apply_mask(grid, mask, codes, frame, source=source)


def apply_mask(
    grid: Grid, mask: GreyImage, codes: Mapping[int, int], frame: CroppedFrame | None = None, *, source: str = ""
) -> Grid:
    """Return the grid with the terrain classes of a mask image, which has the size of the map's file.

    `codes`: terrain codes of the grid by grey (0 to 255); every grey on a known cell without obstacle needs one.
    `frame`: that of the file, if the grid is only a part of it.
    """
    _check_codes(codes, grid, source)
    height, width = mask.grey.shape
    wanted = (grid.width, grid.height) if frame is None else (frame.width, frame.height)
    if (width, height) != wanted:
        text = f"must be that of the map, {wanted[0]} x {wanted[1]}, got {width} x {height}"
        raise MapError([Problem("size", text)], source=source)
    greys = cut(np.flipud(mask.grey), frame, grid.cells.shape)
    takes = ground_in(grid.cells)
    if mask.opaque is not None:
        takes &= cut(np.flipud(mask.opaque), frame, grid.cells.shape)
    counts = np.bincount(greys[takes], minlength=256)
    unlisted = [int(g) for g in np.flatnonzero(counts) if int(g) not in codes]
    raise_any([Problem(f"grey {g}", f"has no terrain code ({counted(counts[g], 'cell')})") for g in unlisted], source)
    table = np.zeros(256, dtype=np.uint8)
    table[list(codes)] = list(codes.values())
    return replace(grid, cells=np.where(takes, table[greys], grid.cells))


def _check_codes(codes: Mapping[int, int], grid: Grid, source: str) -> None:
    known = {terrain.code for terrain in grid.terrains}
    problems = [Problem(f"grey {g}", "must be from 0 to 255") for g in codes if not 0 <= g <= 255]
    strange = {g: code for g, code in codes.items() if code not in known}
    text = "terrain code {} is none of the map's classes {}"
    problems += [Problem(f"grey {g}", text.format(code, sorted(known))) for g, code in strange.items()]
    if problems:
        raise MapError(problems, source=source)
