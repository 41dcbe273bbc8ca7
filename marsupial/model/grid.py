"""The grid map: one byte per cell, unknown or a terrain class.

Row 0 is the lowest row of the world (as in `nav_msgs/OccupancyGrid`), column 0 the leftmost. A cell is written
``(x, y)`` = (column, row), and ``cells[y, x]`` is its value. Readers of formats whose first row is the top one flip the
rows. Everything outside the grid counts as an obstacle.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from marsupial.errors import MapError
from marsupial.model.bounds import BOUNDS

OBSTACLE = 0
FLOOR = 1
ROUGH = 2
UNKNOWN = 255

CellArray = npt.NDArray[np.uint8]
Mask = npt.NDArray[np.bool_]


class Cell(NamedTuple):
    """A cell by column and row."""

    x: int
    y: int


_ORIGIN = Cell(0, 0)


@dataclass(frozen=True, slots=True, kw_only=True)
class Terrain:
    """A class of known cell."""

    code: int  # value of its cells in a grid, 0 to 254; 0 is the obstacle and always blocks sight
    name: str
    blocks_sight: bool = False  # whether a robot can't see across such a cell


TERRAINS = (
    Terrain(code=OBSTACLE, name="obstacle", blocks_sight=True),
    Terrain(code=FLOOR, name="floor"),
    Terrain(code=ROUGH, name="rough"),
)
"""The classes of every map; a scenario may add its own from code 3 on."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Zoning:
    """The zones of a map for planning (`marsupial.model.zones`), as arrays (height, width)."""

    ground: CellArray  # the known map without zones, which grows
    barred: Mask  # cells of no-go zones
    polygons_m: tuple[tuple[tuple[float, float], ...], ...]  # of the no-go zones
    inside: Mask | None  # cells to explore; None for all
    weights: npt.NDArray[np.float64] | None  # of targets; None for 1 everywhere


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Grid:
    """A grid map."""

    cells: CellArray  #: uint8, shape (height, width); terrain codes, or `UNKNOWN`. Held read-only.
    resolution_m: float  #: edge length of a cell in metres
    #: (x, y, yaw) of the lower left corner of cell (0, 0) in the map frame; metres and radians
    origin_m: tuple[float, float, float] = (0.0, 0.0, 0.0)
    terrains: tuple[Terrain, ...] = TERRAINS  #: the terrain classes that may occur
    chargers: tuple[Cell, ...] = ()  #: charging places: cells on which the batteries of standing robots charge
    zoning: Zoning | None = None  #: the zones drawn in it; None without zones
    corner: Cell = _ORIGIN  #: where cell (0, 0) lies in the first frame of a map that grows; names count from there

    def __post_init__(self) -> None:
        if self.cells.ndim != 2 or self.cells.dtype != np.uint8 or 0 in self.cells.shape:
            raise MapError(f"a grid needs a non-empty 2-d uint8 array, got {self.cells.dtype} {self.cells.shape}")
        fault = BOUNDS["resolution_m"].fault(self.resolution_m)
        if fault:
            raise MapError(f"resolution_m {fault}")
        view = self.cells.view()  # the owner of the array may still write to it: a known map grows
        view.flags.writeable = False
        object.__setattr__(self, "cells", view)

    @property
    def width(self) -> int:
        """Number of columns."""
        return int(self.cells.shape[1])

    @property
    def height(self) -> int:
        """Number of rows."""
        return int(self.cells.shape[0])

    @property
    def cell_area_m2(self) -> float:
        """Area of one cell in square metres."""
        return self.resolution_m * self.resolution_m

    def name_of(self, kind: str, *cells: Cell) -> str:
        """Return the name of a place of this kind (`t`, `m`, `charge`) at these cells, the same in all frames."""
        return "_".join([kind, *(f"{x + self.corner.x}_{y + self.corner.y}" for x, y in cells)])

    def centre_m(self, cell: Cell) -> tuple[float, float]:
        """Return the centre of `cell` in the map frame, in metres."""
        return self.point_m(cell.x + 0.5, cell.y + 0.5)

    def point_m(self, x: float, y: float) -> tuple[float, float]:
        """Return the point in the map frame, in metres, at (x, y) cells from the lower left corner."""
        x0, y0, yaw = self.origin_m
        dx, dy = x * self.resolution_m, y * self.resolution_m
        cos, sin = math.cos(yaw), math.sin(yaw)
        return float(x0 + cos * dx - sin * dy), float(y0 + sin * dx + cos * dy)

    def cell_at_m(self, x_m: float, y_m: float) -> Cell:
        """Return the cell that contains a point of the map frame; it may lie outside the grid."""
        x, y = self.from_point_m(x_m, y_m)
        return Cell(int(np.floor(x)), int(np.floor(y)))

    def from_point_m(self, x_m: float, y_m: float) -> tuple[float, float]:
        """Return a point of the map frame in cells from the lower left corner: the inverse of `point_m`."""
        x0, y0, yaw = self.origin_m
        cos, sin = math.cos(yaw), math.sin(yaw)
        dx, dy = x_m - x0, y_m - y0
        return float((cos * dx + sin * dy) / self.resolution_m), float((-sin * dx + cos * dy) / self.resolution_m)

    def contains(self, cell: Cell) -> bool:
        """Return whether `cell` lies in the grid."""
        return 0 <= cell.x < self.width and 0 <= cell.y < self.height

    def solid(self) -> Grid:
        """Return the map with obstacles in place of unknown cells, as the simulator needs it."""
        unknown = self.cells == UNKNOWN
        return replace(self, cells=np.where(unknown, np.uint8(OBSTACLE), self.cells)) if unknown.any() else self

    def opaque_codes(self) -> CellArray:
        """Return a uint8 table of 256: 1 for codes that block sight (unknown included), else 0."""
        # codes without a terrain are opaque, like unknown cells
        table = np.ones(256, dtype=np.uint8)
        for terrain in self.terrains:
            table[terrain.code] = terrain.blocks_sight
        return table


# Maps are misread more often than they are broken: a grey that meant unknown becomes free, and exploration ends before
# it began. So readers also return their interpretation of every symbol, and warnings about doubtful symbols.
@dataclass(frozen=True, slots=True, kw_only=True)
class LegendEntry:
    """One symbol of a map file (``grey 205``, ``'@'``): the terrain code it became, in how many cells."""

    symbol: str
    code: int
    cells: int


class CroppedFrame(NamedTuple):
    """The frame of a map file of which only a part was kept, and the cell of it that became cell (0, 0)."""

    width: int
    height: int
    left: int
    bottom: int


@dataclass(frozen=True, slots=True, kw_only=True)
class MapReading:
    """A map that was read from a file, and how the reader interpreted each symbol."""

    grid: Grid
    format: str  # in words
    legend: tuple[LegendEntry, ...] = ()  # the interpretation of every symbol in the file, ordered by symbol
    warnings: tuple[str, ...] = ()  # interpretations that look wrong, with the symbols and numbers of cells
    # whether the format itself closes the map at its edge, so that free space there is no gap in a wall
    walled: bool = False
    frame: CroppedFrame | None = None  # None if the map was read whole


def code_table(codes: Iterable[int]) -> Mask:
    """Return a boolean table of 256: true for these terrain codes."""
    table = np.zeros(256, dtype=np.bool_)
    table[sorted(codes)] = True
    return table


def ground_in(cells: CellArray) -> Mask:
    """Return the mask (height, width) of known cells without obstacle."""
    return (cells != OBSTACLE) & (cells != UNKNOWN)


def beside_unknown(cells: CellArray) -> Mask:
    """Return the mask (height, width) of the cells above, below or beside which one is unknown."""
    unknown = np.pad(cells == UNKNOWN, 1)
    return unknown[:-2, 1:-1] | unknown[2:, 1:-1] | unknown[1:-1, :-2] | unknown[1:-1, 2:]
