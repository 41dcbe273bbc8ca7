"""What robots see: the exact field of view, or what a sensor of the caller's own says."""

from __future__ import annotations

from typing import Protocol

import numpy as np
import numpy.typing as npt

from marsupial.errors import UsageError
from marsupial.maps.sight import Sight
from marsupial.model.grid import Cell, Grid
from marsupial.model.robots import RobotType


class Sensor(Protocol):
    """What robots see from where they are."""

    def visible(self, truth: Grid, kind: RobotType, cell: Cell) -> npt.NDArray[np.int64]:
        """Return the cells that a robot of this type sees from `cell`, as row-major indices (y * width + x).

        `truth` is the real map, the same object throughout a mission. What comes back may depend on nothing else if
        missions are to be the same again. Whatever it is, a robot knows the cells that its body would touch one cell
        further on (`marsupial.maps.contact`).
        """


class FieldOfView:
    """The exact field of view: all cells in line of sight within the type's range."""

    def __init__(self) -> None:
        self._truth: Grid | None = None

    def visible(self, truth: Grid, kind: RobotType, cell: Cell) -> npt.NDArray[np.int64]:
        """Return the cells in line of sight; a view that the next call overwrites."""
        if truth is not self._truth:
            self._truth, self._sight = truth, Sight(truth.cells, truth.opaque_codes())
        return self._sight.visible(cell, kind.sensor_range_m / truth.resolution_m)


class Checked:
    """Holds a caller's sensor to the map: compiled code writes wherever it is told to."""

    def __init__(self, sensor: Sensor) -> None:
        self._sensor = sensor

    def visible(self, truth: Grid, kind: RobotType, cell: Cell) -> npt.NDArray[np.int64]:
        """Return what it sees, once that is all on the map."""
        seen = np.ascontiguousarray(self._sensor.visible(truth, kind, cell))
        if seen.ndim != 1 or (seen.size and seen.dtype.kind not in "iu"):
            raise UsageError(f"a sensor must give a list of cells' indices, got {seen.dtype} of shape {seen.shape}")
        if seen.size and not 0 <= seen.min() <= seen.max() < truth.cells.size:
            raise UsageError(f"a sensor must give indices from 0 to {truth.cells.size - 1}, got one outside")
        return seen.astype(np.int64)
