"""Which sizes follow from numbers that are each in bounds, and how large they may get, in files and requests alike.

Work and memory go with cells, not with metres: a robot of 5 m is nothing on a map of 1 m cells and 79 million cells on
one of 1 mm. Whoever takes in a map and robot types asks `ground_faults` before anything is worked out. How far a robot
sees needs no such bound: no more is looked at than the map has cells.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

from marsupial.model.robots import RobotType, Role


@dataclass(frozen=True, slots=True)
class Size:
    """The most that a derived size may be, and what it is."""

    most: float
    meaning: str


MOST_TYPES = 60
"""Robot types: which of them can explore what is kept in the bits of a number."""

SIZES: Mapping[str, Size] = {
    # 2 m on a map of 1 cm cells
    "radius_cells": Size(200, "cells in a robot's radius"),
    # 0.1 ns each: 100 s
    "footprint_cells": Size(1e12, "cells of a map times the cells under a robot, added up over the robot types"),
    # 5 to 8 bytes each; the default types on the largest map there may be have 3e8
    "layers": Size(1e9, "cells of a map times robot types and pairs of types that dock"),
}
"""The derived sizes by name. The service has limits of the same names, which its operator can set."""

MOST: Mapping[str, float] = {name: size.most for name, size in SIZES.items()}


class Extent(NamedTuple):
    """How many cells a map has, and how long the side of one is in metres."""

    cells: int
    resolution_m: float


def radius_fault(radius_m: float, extent: Extent, most: Mapping[str, float] = MOST) -> str | None:
    """Say what is wrong with a robot's radius on such a map."""
    cells, allowed = radius_m / extent.resolution_m, most["radius_cells"]
    if cells <= allowed:
        return None
    return f"must be at most {allowed:g} cells of the map, got {cells:.4g} cells of {extent.resolution_m:g} m"


def ground_faults(kinds: Sequence[RobotType], extent: Extent, most: Mapping[str, float] = MOST) -> Iterator[str]:
    """Yield what is wrong with all robot types together on such a map."""
    grounds = {(kind.radius_m, kind.terrains) for kind in kinds}
    under = [max(1.0, math.pi * (radius_m / extent.resolution_m) ** 2) for radius_m, _ in grounds]
    work = extent.cells * sum(min(extent.cells, one) for one in under)
    if work > most["footprint_cells"]:
        yield _too_large("footprint_cells", work, most)
    carriers = sum(kind.role is Role.CARRIER for kind in kinds)
    layers = extent.cells * (len(kinds) + carriers * (len(kinds) - carriers))
    if layers > most["layers"]:
        yield _too_large("layers", layers, most)


def _too_large(name: str, size: float, most: Mapping[str, float]) -> str:
    return f"too much for this map: {SIZES[name].meaning} are {size:.3g}, more than the limit of {most[name]:.3g}"
