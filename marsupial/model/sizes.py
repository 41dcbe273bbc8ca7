"""Limits on sizes that result from several inputs, each within its own bounds.

Time and memory grow with cells, not with metres: a robot of 5 m covers few cells of 1 m, but 79 million of 1 mm. Code
that accepts a map and robot types calls `ground_faults` before it computes anything. Sensor ranges need no such limit,
since at most all cells of the map are visited.
"""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

from marsupial.model.robots import RobotType, Role


@dataclass(frozen=True, slots=True)
class Size:
    """The limit of a derived size, and what the size means."""

    most: float
    meaning: str


MOST_TYPES = 60  # most robot types: the types that can explore a cell are bits of one number

SIZES: Mapping[str, Size] = {
    # 2 m on a map of 1 cm cells
    "radius_cells": Size(200, "cells in a robot's radius"),
    # 0.1 ns each: 100 s
    "footprint_cells": Size(1e12, "cells of a map times the cells under a robot, added up over the robot types"),
    # 5 to 8 bytes each; the default types on the largest map there may be have 3e8
    "layers": Size(1e9, "cells of a map times robot types and pairs of types that dock"),
}
"""The derived sizes by name. Operators of the service can set limits of the same names."""

MOST: Mapping[str, float] = {name: size.most for name, size in SIZES.items()}


class Extent(NamedTuple):
    """Number of cells of a map, and the side of a cell in metres."""

    cells: int
    resolution_m: float


def radius_fault(radius_m: float, extent: Extent, most: Mapping[str, float] = MOST) -> str | None:
    """Return what is wrong with a robot's radius on such a map, or None."""
    cells, allowed = radius_m / extent.resolution_m, most["radius_cells"]
    if cells <= allowed:
        return None
    return f"must be at most {allowed:g} cells of the map, got {cells:.4g} cells of {extent.resolution_m:g} m"


def ground_faults(kinds: Sequence[RobotType], extent: Extent, most: Mapping[str, float] = MOST) -> Iterator[str]:
    """Yield what is wrong with all robot types together on such a map."""
    # types with the same footprint share one layer of standable cells
    grounds = {(kind.radius_m, kind.terrains) for kind in kinds}
    under = [max(1.0, math.pi * (radius_m / extent.resolution_m) ** 2) for radius_m, _ in grounds]
    # no footprint has more cells than the map
    work = extent.cells * sum(min(extent.cells, one) for one in under)
    if work > most["footprint_cells"]:
        yield _too_large("footprint_cells", work, most)
    carriers = sum(kind.role is Role.CARRIER for kind in kinds)
    # one array over the map for each type, and for each pair of types that may dock
    layers = extent.cells * (len(kinds) + carriers * (len(kinds) - carriers))
    if layers > most["layers"]:
        yield _too_large("layers", layers, most)


def _too_large(name: str, size: float, most: Mapping[str, float]) -> str:
    return f"too much for this map: {SIZES[name].meaning} are {size:.3g}, more than the limit of {most[name]:.3g}"
