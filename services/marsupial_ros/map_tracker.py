"""The map from ROS, the map as reported, and the difference to report next.

A map does not say which robot saw what, so a changed cell counts as seen by the nearest robot.
"""

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
import numpy.typing as npt

from marsupial.errors import MapError
from marsupial.formats.mapfiles.images import MAX_CELLS
from marsupial.formats.mapfiles.masks import FilterMasks, painted
from marsupial.formats.mapfiles.occupancy import Occupancy, OccupancyUpdate, apply_update, terrain_codes
from marsupial.maps.discs import standable
from marsupial.model.grid import OBSTACLE, UNKNOWN, Cell, CellArray, Grid, Terrain
from marsupial.model.missionframe import MissionFrame, embedded, frame_at
from marsupial.model.robots import RobotType
from marsupial.model.runs import cells_in, runs_of
from marsupial_client.mission_documents import KnownMap, ReportFrame, Revealed
from marsupial_ros.transforms import Point

# relative tolerance of resolutions: messages hold them in single precision, and some publishers calculate them
_SAME_RESOLUTION = 1e-6


class MapTracker:
    """The map of a mission, with `masks` painted onto it; thresholds are occupancies from 0 to 1, as in nav2 maps.

    It is `fresh` if it has changed since the last call of `changes`, and was made at `made_s`. It `repeats` if there
    was more than one: a map that somebody has saved is published once.
    """

    def __init__(
        self, terrains: tuple[Terrain, ...], masks: FilterMasks, free_thresh: float, occupied_thresh: float
    ) -> None:
        self._terrains = terrains
        self._masks = masks
        self._thresholds = free_thresh, occupied_thresh
        self._occupancy: Occupancy | None = None
        self._refused = False
        self._grid: Grid | None = None
        self._overlay: CellArray | None = None
        self._first: Grid | None = None
        self._frame: MissionFrame | None = None
        self._reported: CellArray = np.empty((0, 0), dtype=np.uint8)
        self.fresh = False
        self.made_s = -math.inf
        self.repeats = False

    @property
    def grid(self) -> Grid | None:
        """The last map from ROS, with its masks; None before the first."""
        occupancy = self._occupancy
        if self._grid is None and occupancy is not None:
            cells = terrain_codes(occupancy.values, *self._thresholds)
            grid = Grid(
                cells=cells, resolution_m=occupancy.resolution_m, origin_m=occupancy.origin_m, terrains=self._terrains
            )
            if self._overlay is None:
                self._overlay = self._masks.overlay(grid)
            self._grid = replace(grid, cells=painted(cells, self._overlay))
        return self._grid

    def take(self, occupancy: Occupancy) -> None:
        """Store a whole map. Raises MapError if it doesn't fit the mission; then it and its updates are ignored."""
        self._refused = True  # until it has passed the check
        self._check(occupancy)
        self._refused = False
        before = self._occupancy
        if before is None or _frame_of(before) != _frame_of(occupancy):
            self._overlay = None
        self._occupancy, self._grid, self.fresh = occupancy, None, True

    def update(self, update: OccupancyUpdate) -> None:
        """Store a new part of the map. Raises MapError if it lies outside the map."""
        if self._occupancy is None or self._refused:  # the map that the update belongs to is not here
            return
        values = self._occupancy.values.copy()
        apply_update(values, update)
        self._occupancy, self._grid, self.fresh = replace(self._occupancy, values=values), None, True

    def date(self, made_s: float) -> None:
        """Note when the map, or its new part, was made."""
        self.repeats = self.repeats or self.made_s > -math.inf
        self.made_s = max(made_s, self.made_s)

    def begin(self) -> Grid:
        """Begin the mission with the current frame of the map and nothing reported; return the map."""
        assert self.grid is not None
        self._first, self._frame = self.grid, MissionFrame.of(self.grid)
        self._reported = np.full_like(self._first.cells, UNKNOWN)
        return self._first

    def expect(self, first: Mapping[str, Any]) -> None:
        """Prepare to resume a mission whose first frame was `first`: refuse maps that don't fit it."""
        x, y, yaw = first["origin_m"]
        self._first = Grid(
            cells=np.full((first["height"], first["width"]), UNKNOWN, dtype=np.uint8),
            resolution_m=first["resolution_m"],
            origin_m=(x, y, yaw),
            terrains=self._terrains,
        )
        self._frame = MissionFrame.of(self._first)

    def resume(self, known: KnownMap) -> None:
        """Continue the mission, begun or expected, with its known map: what differs is to be reported."""
        assert self._first is not None
        x, y, yaw = known["origin_m"]
        frame = frame_at(self._first, known["width"], known["height"], (x, y, yaw))
        assert frame is not None  # frames of a mission are not turned against each other
        self._frame = frame
        flat = np.full(known["width"] * known["height"], UNKNOWN, dtype=np.uint8)
        cells_known, codes = cells_in(tuple(known["runs"]))
        flat[cells_known] = codes
        self._reported, self.fresh = flat.reshape(known["height"], known["width"]), True

    def changes(self, robots: Mapping[str, Point]) -> tuple[ReportFrame | None, list[Revealed]]:
        """Return the cells that have changed since they were reported, and the grown frame; mark them as reported.

        `robots` are the places of the robots on the ground, in metres of the map frame.
        """
        grid = self.grid
        assert grid is not None
        assert self._first is not None
        assert self._frame is not None
        self.fresh = False
        frame = frame_at(self._first, grid.width, grid.height, grid.origin_m)
        assert frame is not None  # `take` has checked it
        # the frame never shrinks: cells beyond the edges of a smaller map are unknown again
        whole = self._frame.grown(frame)
        known = whole.grid(self._first, embedded(grid.cells, frame, whole))
        changed = np.flatnonzero(embedded(self._reported, self._frame, whole) != known.cells)
        grows = whole != self._frame
        self._frame, self._reported = whole, known.cells
        if not len(changed) and not grows:
            return None, []
        x, y, yaw = known.origin_m
        size: ReportFrame = {"width": known.width, "height": known.height, "origin_m": [x, y, yaw]}
        return size, _revealed(known, changed, robots)

    def contains(self, point: Point) -> bool:
        """Return whether the last map contains a point, in metres."""
        return self.grid is not None and self.grid.contains(self.grid.cell_at_m(*point))

    def point_m(self, cell: Cell) -> Point:
        """Return the centre of a cell of the mission's frame, in metres."""
        assert self._first is not None
        assert self._frame is not None
        x, y = self._first.point_m(cell.x + self._frame.x + 0.5, cell.y + self._frame.y + 0.5)
        return x, y

    def in_frame(self, point: Point) -> bool:
        """Return whether the mission's frame, which never shrinks, contains a point."""
        if self._first is None or self._frame is None:
            return False
        cell, frame = self._first.cell_at_m(*point), self._frame
        return frame.grown(MissionFrame(cell.x, cell.y, 1, 1)) == frame

    def open_near(self, point: Point, within_m: float) -> bool:
        """Return whether the last map has ground beside unknown cells, or on its edge, around a point."""
        if self.grid is None:
            return False
        whole = replace(self.grid, cells=np.pad(self.grid.cells, 1, constant_values=UNKNOWN))
        step = self.grid.resolution_m
        part, _ = _around(whole, (point[0] + step, point[1] + step), within_m)
        if part is None:
            return False
        unknown = part.cells == UNKNOWN
        ground = ~unknown & (part.cells != OBSTACLE)
        along = (ground[:, 1:] & unknown[:, :-1]).any() or (ground[:, :-1] & unknown[:, 1:]).any()
        return bool(along or (ground[1:] & unknown[:-1]).any() or (ground[:-1] & unknown[1:]).any())

    def standing(self, kind: RobotType, point: Point, within_m: float) -> Point | None:
        """Return where a robot of a type can stand: at a point or nearest to it; None if beyond `within_m`."""
        # robots rarely stand exactly on free cells: localisation is off by a cell or two, walls are drawn too thick
        if self.grid is None:
            return None
        part, corner = _around(self.grid, point, within_m + kind.radius_m)
        if part is None:
            return None
        rows, columns = np.nonzero(standable(part, kind))
        if not len(rows):
            return None
        at = self.grid.from_point_m(*point)
        dx, dy = columns + corner[0] + 0.5 - at[0], rows + corner[1] + 0.5 - at[1]
        if ((abs(dx) <= 0.5) & (abs(dy) <= 0.5)).any():
            return point
        best = int(np.argmin(dx * dx + dy * dy))
        if math.hypot(dx[best], dy[best]) * self.grid.resolution_m > within_m:
            return None
        return self.grid.point_m(float(columns[best] + corner[0] + 0.5), float(rows[best] + corner[1] + 0.5))

    def _check(self, occupancy: Occupancy) -> None:
        height, width = occupancy.values.shape
        if width * height > MAX_CELLS:
            raise MapError(f"has {width * height} cells, more than the limit of {MAX_CELLS}")
        first = self._first
        if first is None or self._frame is None:
            return
        if not math.isclose(occupancy.resolution_m, first.resolution_m, rel_tol=_SAME_RESOLUTION):
            was = f"{first.resolution_m:g} m, now {occupancy.resolution_m:g} m"
            raise MapError(f"the resolution of the map has changed: it was {was}")
        frame = frame_at(first, width, height, occupancy.origin_m)
        if frame is None:
            was = f"{first.origin_m[2]:g} rad, now {occupancy.origin_m[2]:g} rad"
            raise MapError(f"the map has been rotated: the yaw of its origin was {was}")
        if (size := self._frame.grown(frame).size) > MAX_CELLS:
            at = f"its origin ({occupancy.origin_m[0]:g}, {occupancy.origin_m[1]:g}) m"
            raise MapError(f"with {at} the mission's map would have {size} cells, more than the limit of {MAX_CELLS}")


def _frame_of(occupancy: Occupancy) -> tuple[object, ...]:
    return occupancy.values.shape, occupancy.resolution_m, occupancy.origin_m


def _revealed(grid: Grid, changed: npt.NDArray[np.int64], robots: Mapping[str, Point]) -> list[Revealed]:
    """Assign each changed cell (row-major index) to the nearest robot."""
    names = list(robots)
    x, y = changed % grid.width + 0.5, changed // grid.width + 0.5
    places = [grid.from_point_m(*robots[name]) for name in names]
    nearest = np.argmin([(x - px) ** 2 + (y - py) ** 2 for px, py in places], axis=0)
    flat = grid.cells.reshape(-1)
    return [
        {"robot": name, "runs": list(runs_of(changed[nearest == i], flat))}
        for i, name in enumerate(names)
        if (nearest == i).any()
    ]


def _around(grid: Grid, point: Point, within_m: float) -> tuple[Grid | None, tuple[int, int]]:
    """Return the part of a map around a point (None if that is far outside), and the lower left cell of the part."""
    x, y = grid.from_point_m(*point)
    reach = within_m / grid.resolution_m + 2
    left, low = max(0, math.floor(x - reach)), max(0, math.floor(y - reach))
    part = grid.cells[low : max(0, math.ceil(y + reach)), left : max(0, math.ceil(x + reach))]
    return (replace(grid, cells=np.ascontiguousarray(part)) if part.size else None), (left, low)
