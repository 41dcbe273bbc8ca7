"""Sensors: which cells a robot sees from a cell. `FieldOfView` is the exact one; callers may pass their own.

A sensor sees all around; `ahead` keeps what is within the sensor angle of a robot that drives.
"""

from typing import Protocol

import numpy as np
import numpy.typing as npt

from marsupial.errors import UsageError
from marsupial.maps.sight import Sight
from marsupial.model import UNKNOWN, Cell, CellArray, Grid, RobotType


class Sensor(Protocol):
    """Determines the cells that robots see."""

    def visible(self, truth: Grid, kind: RobotType, cell: Cell) -> npt.NDArray[np.int64]:
        """Return the cells that a robot of this type sees from `cell`, as row-major indices (y * width + x).

        `truth` is the true map, the same object throughout a mission. For missions to be reproducible, the result may
        depend on the arguments only. In addition, a robot always knows the cells that its body would touch one cell
        further on (`marsupial.maps.footprint`).
        """


class FieldOfView:
    """The exact field of view: all cells in line of sight within sensor range."""

    def __init__(self) -> None:
        self._truth: Grid | None = None

    def visible(
        self, truth: Grid, kind: RobotType, cell: Cell, known: CellArray | None = None
    ) -> npt.NDArray[np.int64]:
        """Return the cells in view; with `known`, a known map, only those that are unknown there."""
        if truth is not self._truth:
            self._truth, self._sight = truth, Sight(truth.cells, truth.opaque_codes())
        range_cells = kind.sensor_range_m / truth.resolution_m
        if known is None:
            return self._sight.visible(cell, range_cells)
        return self._sight.visible(cell, range_cells, known.ravel(), UNKNOWN)


class Checked:
    """Checks the indices that a caller's sensor returns, as compiled code writes to them unchecked."""

    def __init__(self, sensor: Sensor) -> None:
        self._sensor = sensor

    def visible(self, truth: Grid, kind: RobotType, cell: Cell, known: object = None) -> npt.NDArray[np.int64]:
        seen = np.ascontiguousarray(self._sensor.visible(truth, kind, cell))
        if seen.ndim != 1 or (seen.size and seen.dtype.kind not in "iu"):
            raise UsageError(f"a sensor must give a list of cells' indices, got {seen.dtype} of shape {seen.shape}")
        if seen.size and not 0 <= seen.min() <= seen.max() < truth.cells.size:
            raise UsageError(f"a sensor must give indices from 0 to {truth.cells.size - 1}, got one outside")
        return seen.astype(np.int64)


def ahead(
    seen: npt.NDArray[np.int64], truth: Grid, cell: Cell, heading: int, angle_deg: float
) -> npt.NDArray[np.int64]:
    """Return the seen cells with their centres within an angle around a heading (0 to 7, from +x), and the own cell."""
    y, x = np.divmod(seen, truth.width)
    turn = np.degrees(np.arctan2(y - cell.y, x - cell.x)) - 45.0 * heading
    off = np.abs((turn + 180.0) % 360.0 - 180.0)
    return seen[(off <= angle_deg / 2 + 1e-9) | ((x == cell.x) & (y == cell.y))]
