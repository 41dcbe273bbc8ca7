"""Grids of occupancy as in ROS (`nav_msgs/OccupancyGrid`): -1 unknown, 0 free to 100 occupied, with their own origin.

Messages and recordings hold occupancies, images greys that stand for them (`nav2.py`). A grid becomes a map by two
thresholds, as in nav2's map saver; or it is looked up at the cells of another map, as nav2's costmap filters do.
"""

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from marsupial.errors import MapError
from marsupial.model.bounds import BOUNDS
from marsupial.model.grid import FLOOR, OBSTACLE, UNKNOWN, CellArray, Grid

OccupancyArray = npt.NDArray[np.int8]

UNKNOWN_OCCUPANCY, OCCUPIED = -1, 100

# nav2's map saver writes a cell as free up to the first, as occupied from the second on (shares of 100).
FREE_THRESH, OCCUPIED_THRESH = 0.25, 0.65

# radians between a map and the floor; less is noise, as of a mapper that levels its map by gravity
_SMALL_TILT = 0.05


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Occupancy:
    """A grid of occupancies."""

    values: OccupancyArray  # int8, shape (height, width), row 0 the lowest: -1 unknown, 0 to 100
    # resolution_m, origin_m: as of a `Grid`
    resolution_m: float
    origin_m: tuple[float, float, float] = (0.0, 0.0, 0.0)
    # angle (radians) between the map and the floor, which is ignored, as in nav2
    tilt: float = 0.0

    def __post_init__(self) -> None:
        height, width = self.values.shape
        if 0 in (height, width):
            raise MapError(f"has no cells: it is {width} x {height}")
        if fault := BOUNDS["resolution_m"].fault(self.resolution_m):
            raise MapError(f"resolution {fault}")
        for value in self.origin_m:
            if fault := BOUNDS["coordinate_m"].fault(value):
                raise MapError(f"origin {fault}")

    def warnings(self) -> list[str]:
        """Return what is ignored of the map."""
        if self.tilt <= _SMALL_TILT:
            return []
        return [f"the map is tilted by {math.degrees(self.tilt):.0f} degrees: it is read as if it lay flat"]


@dataclass(frozen=True, slots=True)
class OccupancyUpdate:
    """A new part of a map: int8 (height, width) with its lower left cell at column `x` and row `y`."""

    x: int
    y: int
    values: OccupancyArray


def apply_update(values: OccupancyArray, update: OccupancyUpdate) -> None:
    """Write a new part into a map (height, width). Raises MapError, and changes nothing, if it lies outside the map."""
    height, width = update.values.shape
    if min(update.x, update.y) < 0 or update.x + width > values.shape[1] or update.y + height > values.shape[0]:
        raise MapError(f"an update of {width} x {height} cells at {update.x}, {update.y} lies outside the map")
    values[update.y : update.y + height, update.x : update.x + width] = update.values


def unit_rotation(x: float, y: float, z: float, w: float) -> tuple[float, float, float, float]:
    """Return a quaternion with length 1, as tf2 uses any. Raises ValueError if it is no rotation."""
    length = math.hypot(x, y, z, w)
    if not math.isfinite(length):
        raise ValueError(f"the rotation {x, y, z, w} is not finite")
    if not length:
        raise ValueError("(0, 0, 0, 0) is not a rotation: publish w = 1 where nothing is rotated")
    return x / length, y / length, z / length, w / length


def yaw_and_tilt(x: float, y: float, z: float, w: float) -> tuple[float, float]:
    """Return an orientation's yaw, as tf2 computes it, and the angle between its z axis and the vertical (radians).

    Raises ValueError if it is no rotation.
    """
    x, y, z, w = unit_rotation(x, y, z, w)
    yaw = math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))
    return yaw, math.acos(max(-1.0, min(1.0, 1 - 2 * (x * x + y * y))))


def shortest_resolution(resolution_m: float) -> float:
    """Return the shortest decimal for a resolution: messages hold it in single precision (0.05000000074505806)."""
    with np.errstate(over="ignore"):  # too large a number is infinite, which no resolution is
        return float(str(np.float32(resolution_m)))


def terrain_codes(
    values: OccupancyArray, free_thresh: float = FREE_THRESH, occupied_thresh: float = OCCUPIED_THRESH
) -> CellArray:
    """Return floor up to `free_thresh` (0 to 1), obstacle from `occupied_thresh` on, unknown between the two."""
    occupancy = np.arange(256, dtype=np.uint8).view(np.int8)
    known = (occupancy >= 0) & (occupancy <= OCCUPIED)
    free, occupied = known & (occupancy <= 100 * free_thresh), known & (occupancy >= 100 * occupied_thresh)
    table = np.select([occupied, free], [OBSTACLE, FLOOR], UNKNOWN).astype(np.uint8)
    return np.asarray(table[values.view(np.uint8)])


def occupancy_on(occupancy: Occupancy, grid: Grid) -> OccupancyArray:
    """Return the occupancy at the centre of each cell of a map, int8 (height, width); -1 outside of the occupancies."""
    same = occupancy.resolution_m == grid.resolution_m and occupancy.origin_m == grid.origin_m
    if same and occupancy.values.shape == grid.cells.shape:
        return occupancy.values
    height, width = occupancy.values.shape
    (x0, y0, yaw), (gx, gy, turned) = occupancy.origin_m, grid.origin_m
    columns = (np.arange(grid.width) + 0.5) * grid.resolution_m
    found = np.full(grid.cells.shape, UNKNOWN_OCCUPANCY, dtype=np.int8)
    for row in range(grid.height):  # row by row: whole tables of points take 32 bytes a cell
        across = (row + 0.5) * grid.resolution_m
        dx = gx + np.cos(turned) * columns - np.sin(turned) * across - x0
        dy = gy + np.sin(turned) * columns + np.cos(turned) * across - y0
        u = np.floor((np.cos(yaw) * dx + np.sin(yaw) * dy) / occupancy.resolution_m).astype(np.int64)
        v = np.floor((np.cos(yaw) * dy - np.sin(yaw) * dx) / occupancy.resolution_m).astype(np.int64)
        inside = (u >= 0) & (u < width) & (v >= 0) & (v < height)
        found[row, inside] = occupancy.values[v[inside], u[inside]]
    return found
