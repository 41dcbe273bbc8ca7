"""One map of several: those of robots that map alone, laid over each other by the transforms between their frames.

    /carrier1/map in the frame carrier1/map  --tf-->  map frame      a cell of the whole is an obstacle if one map says
    /rover1/map   in the frame rover1/map    --tf-->  map frame      so, free if one does and none says otherwise

The whole has the resolution of the first map, and its cells begin at multiples of it in the map frame. So it grows by
whole cells, however its parts move against each other. A part is laid down when it comes, by the transform of then.
"""

import math
from collections.abc import Collection
from dataclasses import dataclass, replace

import numpy as np

from marsupial.errors import MapError
from marsupial.formats.mapfiles.images import MAX_CELLS
from marsupial.formats.mapfiles.occupancy import Occupancy, OccupancyArray, OccupancyUpdate, apply_update
from marsupial_ros.transforms import Frames, Transform

AT_ONCE = 1 << 20  # about this many cells are laid at once: all would fill gigabytes
UNSEEN = -1  # occupancy of unknown cells, which is below all others


@dataclass(frozen=True, slots=True)
class _Part:
    """A map in its own frame, and as laid over the whole: values (height, width) from column `x` and row `y` on."""

    own: Occupancy
    frame: str
    x: int
    y: int
    values: OccupancyArray
    made_s: float


class MapMerger:
    """Merges the maps of some topics into one in the map `frame`; `frames` are all that are known."""

    def __init__(self, frame: str, frames: Collection[Frames]) -> None:
        self._frame, self._frames = frame, frames
        self._resolution_m: float | None = None
        self._parts: dict[str, _Part] = {}

    @property
    def made_s(self) -> float:
        """When the oldest of the maps was made."""
        return min(part.made_s for part in self._parts.values())

    def take(self, topic: str, frame: str, occupancy: Occupancy, made_s: float) -> Occupancy:
        """Take a topic's map in its frame; return the whole. Raises MapError if it can't be laid over the others."""
        resolution_m = self._resolution_m or occupancy.resolution_m
        x, y, values = _laid(occupancy, self._transform(frame), resolution_m)
        parts = self._parts | {topic: _Part(occupancy, frame, x, y, values, made_s)}
        whole = _whole(parts.values(), resolution_m)
        self._resolution_m, self._parts = resolution_m, parts  # only now: what does not fit must not stay
        return whole

    def update(self, topic: str, update: OccupancyUpdate, made_s: float) -> Occupancy | None:
        """Take a new part of a topic's map; return the whole, None before its map."""
        if (part := self._parts.get(topic)) is None:
            return None
        values = part.own.values.copy()
        apply_update(values, update)
        return self.take(topic, part.frame, replace(part.own, values=values), made_s)

    def _transform(self, frame: str) -> Transform:
        for frames in self._frames:
            if (found := frames.find(frame, self._frame)) is not None:
                return found[0]
        raise MapError(f"there is no transform from its frame {frame!r} to {self._frame!r} yet")


def _whole(parts: Collection[_Part], resolution_m: float) -> Occupancy:
    """Return the map that holds all parts, with the greatest occupancy of each cell."""
    left, low = min(part.x for part in parts), min(part.y for part in parts)
    width = max(part.x + part.values.shape[1] for part in parts) - left
    height = max(part.y + part.values.shape[0] for part in parts) - low
    _check_size(width, height)
    whole = np.full((height, width), UNSEEN, dtype=np.int8)
    for part in parts:
        rows, columns = part.values.shape
        under = whole[part.y - low : part.y - low + rows, part.x - left : part.x - left + columns]
        np.maximum(under, part.values, out=under)
    origin_m = left * resolution_m, low * resolution_m, 0.0
    return Occupancy(values=whole, resolution_m=resolution_m, origin_m=origin_m)


def _laid(occupancy: Occupancy, transform: Transform, resolution_m: float) -> tuple[int, int, OccupancyArray]:
    """Return the first column and row of a map in the whole, and its values there: those at the cells' centres."""
    height, width = occupancy.values.shape
    x, y, yaw = occupancy.origin_m
    corner = transform.of(Transform((x, y, 0.0), (0.0, 0.0, math.sin(yaw / 2), math.cos(yaw / 2))))
    at = np.array(corner.point)
    along = np.array([math.cos(corner.yaw), math.sin(corner.yaw)])  # the direction of its rows
    across = np.array([-along[1], along[0]])
    sides = np.array([[0, 0], [width, 0], [0, height], [width, height]]) * occupancy.resolution_m
    corners = at + sides @ np.stack([along, across])
    low, high = np.floor(corners.min(axis=0) / resolution_m + 1e-6), np.ceil(corners.max(axis=0) / resolution_m - 1e-6)
    columns, rows = (int(count) for count in high - low)
    _check_size(columns, rows)
    laid = np.full((rows, columns), UNSEEN, dtype=np.int8)
    dx = (low[0] + np.arange(columns) + 0.5) * resolution_m - at[0]
    at_once = max(1, AT_ONCE // columns)
    for first in range(0, rows, at_once):
        cut = slice(first, min(rows, first + at_once))
        dy = ((low[1] + np.arange(cut.start, cut.stop) + 0.5) * resolution_m - at[1])[:, None]
        column = np.floor((dx * along[0] + dy * along[1]) / occupancy.resolution_m).astype(np.int64)
        row = np.floor((dx * across[0] + dy * across[1]) / occupancy.resolution_m).astype(np.int64)
        inside = (column >= 0) & (column < width) & (row >= 0) & (row < height)
        laid[cut][inside] = occupancy.values[row[inside], column[inside]]
    return int(low[0]), int(low[1]), laid


def _check_size(width: int, height: int) -> None:
    if width * height > MAX_CELLS:
        raise MapError(f"with it the map would have {width * height} cells, more than the limit of {MAX_CELLS}")
