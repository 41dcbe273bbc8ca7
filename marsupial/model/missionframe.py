"""The frame of a mission's map, which grows to contain every reported frame.

A frame is given in whole cells of the lattice that the mission was created with, so that every cell of one frame is a
cell of any larger frame. An origin off that lattice is moved to the nearest cell.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

from marsupial.model.frames import FrameShift
from marsupial.model.grid import UNKNOWN, Cell, CellArray, Grid

# radians by which the yaw of a frame may differ from the mission's: poses are not more precise
_SAME_YAW = 1e-6


@dataclass(frozen=True, slots=True)
class MissionFrame:
    """A frame: its size, and the column and row of its lower left cell relative to the first frame's."""

    x: int
    y: int
    width: int
    height: int

    @classmethod
    def of(cls, grid: Grid) -> MissionFrame:
        """Return the first frame of a mission, that of its map."""
        return cls(0, 0, grid.width, grid.height)

    @property
    def size(self) -> int:
        return self.width * self.height

    def grown(self, other: MissionFrame) -> MissionFrame:
        """Return the smallest frame that contains both."""
        x, y = min(self.x, other.x), min(self.y, other.y)
        right = max(self.x + self.width, other.x + other.width)
        return MissionFrame(x, y, right - x, max(self.y + self.height, other.y + other.height) - y)

    def grown_by(self, shift: Cell, width: int, height: int) -> MissionFrame:
        """Return the larger frame of this size with that many more columns on the left, and rows below."""
        return MissionFrame(self.x - shift.x, self.y - shift.y, width, height)

    def widened(self, by: int) -> MissionFrame:
        """Return the frame with this many more cells on each side."""
        return MissionFrame(self.x - by, self.y - by, self.width + 2 * by, self.height + 2 * by)

    def shift_to(self, larger: MissionFrame) -> FrameShift:
        """Return the shift of this frame's cells into a larger frame."""
        return FrameShift(Cell(self.x - larger.x, self.y - larger.y), self.width, larger.width, larger.height)

    def grid(self, grid: Grid, cells: CellArray) -> Grid:
        """Return the map with these cells (height, width) in this frame; `grid` is the mission's initial map."""
        chargers = tuple(map(MissionFrame.of(grid).shift_to(self).cell, grid.chargers))
        corner = Cell(self.x, self.y)
        return replace(grid, cells=cells, origin_m=self.origin_m(grid), chargers=chargers, corner=corner)

    def origin_m(self, grid: Grid) -> tuple[float, float, float]:
        """Return the pose of its lower left corner; `grid` is the mission's initial map."""
        return grid.origin_m if self.x == self.y == 0 else (*grid.point_m(self.x, self.y), grid.origin_m[2])


def frame_at(grid: Grid, width: int, height: int, origin_m: tuple[float, float, float] | None) -> MissionFrame | None:
    """Return the frame of that size with its lower left corner at a pose; None if rotated against the mission's."""
    if origin_m is None:
        return MissionFrame(0, 0, width, height)
    if abs(math.remainder(origin_m[2] - grid.origin_m[2], math.tau)) > _SAME_YAW:
        return None
    # the corner plus half a cell lies in the cell with the nearest corner
    cos, sin = math.cos(grid.origin_m[2]), math.sin(grid.origin_m[2])
    half = 0.5 * grid.resolution_m
    x, y = origin_m[0] + half * (cos - sin), origin_m[1] + half * (sin + cos)
    lowest = grid.cell_at_m(x, y)
    return MissionFrame(lowest.x, lowest.y, width, height)


def embedded(cells: CellArray, before: MissionFrame, now: MissionFrame) -> CellArray:
    """Return the cells (height, width) of a frame within a larger one, unknown around them."""
    return cells if before == now else before.shift_to(now).laid_out(cells, UNKNOWN)
