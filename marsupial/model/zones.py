"""Zones: polygons by which an operator says where robots must not go, and where they should explore.

Zones hold from a time on and may end; the mission loop learns of them through `News`, and plans on a map in which they
are drawn (`zoned`). The map itself, and the log of what robots saw, stay as they are.
"""

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from enum import StrEnum

import numpy as np
import numpy.typing as npt

from marsupial.model.bounds import BOUNDS
from marsupial.model.grid import OBSTACLE, Grid, Mask, Zoning

MOST_ZONES = 100  # most zones that may hold at a time
MOST_CORNERS = 1000  # most corners of a polygon


class ZoneKind(StrEnum):
    """What a zone means."""

    NO_GO = "no_go"  # no robot may enter; robots inside may leave
    PRIORITY = "priority"  # targets are worth more, by `Zone.weight`
    EXPLORE = "explore"  # only the zones of this kind are explored; without any, the whole map is


@dataclass(frozen=True, slots=True, kw_only=True)
class Zone:
    """The cells whose centres lie within a polygon; where its edges cross, by the even-odd rule."""

    kind: ZoneKind
    polygon_m: tuple[tuple[float, float], ...]  # its corners in the map frame, in metres
    weight: float = 1.0  # by which targets in a priority zone are worth more, at least 1; the greatest counts


@dataclass(frozen=True, slots=True, kw_only=True)
class ZoneChange:
    """A zone that holds from now on, in place of one of the same name; None: it holds no more."""

    name: str
    zone: Zone | None


@dataclass(frozen=True, slots=True, kw_only=True)
class DatedZone:
    """A zone that holds for a part of a mission."""

    name: str
    zone: Zone
    from_ms: int = 0
    until_ms: int | None = None  # None: until the mission ends


Zones = Mapping[str, Zone]
"""The zones that hold, by name."""


def changes_of(dated: Iterable[DatedZone]) -> list[tuple[int, ZoneChange]]:
    """Return when which zones change, in order; at one moment zones end before others begin."""
    changes = [(one.until_ms, False, ZoneChange(name=one.name, zone=None)) for one in dated if one.until_ms is not None]
    changes += [(one.from_ms, True, ZoneChange(name=one.name, zone=one.zone)) for one in dated]
    return [(at_ms, change) for at_ms, _, change in sorted(changes, key=lambda one: one[:2])]


def changed(zones: Zones, changes: Iterable[ZoneChange]) -> Zones:
    """Return the zones that hold after some changes."""
    after = dict(zones)
    for change in changes:
        after.pop(change.name, None)
        if change.zone is not None:
            after[change.name] = change.zone
    return after


def at_start(dated: Iterable[DatedZone]) -> Zones:
    """Return the zones that hold when a mission starts."""
    return {one.name: one.zone for one in dated if one.from_ms == 0}


def always_closed(dated: Iterable[DatedZone]) -> Zones:
    """Return the no-go zones that hold for the whole mission."""
    zones = at_start(one for one in dated if one.until_ms is None)
    return {name: zone for name, zone in zones.items() if zone.kind is ZoneKind.NO_GO}


def zone_faults(dated: DatedZone) -> Iterator[tuple[str, str]]:
    """Yield the key and fault of each wrong field of a zone."""
    zone = dated.zone
    if not 3 <= len(zone.polygon_m) <= MOST_CORNERS:
        yield "polygon_m", f"must have 3 to {MOST_CORNERS} corners, has {len(zone.polygon_m)}"
    for i, corner in enumerate(zone.polygon_m):
        for metres in corner:
            if fault := BOUNDS["coordinate_m"].fault(metres):
                yield f"polygon_m[{i}]", fault
    if fault := BOUNDS["zone_weight"].fault(zone.weight):
        yield "weight", fault
    elif zone.kind is not ZoneKind.PRIORITY and zone.weight != 1:
        yield "weight", f"only zones '{ZoneKind.PRIORITY}' have it"
    if dated.until_ms is not None and dated.until_ms <= dated.from_ms:
        yield "until_s", "must be after from_s"


def zoned(grid: Grid, zones: Zones) -> Grid:
    """Return the map for planning: no-go zones are obstacles, and the grid's `zoning` has the rest."""
    if not zones:
        return grid
    polygons_m = tuple(zone.polygon_m for zone in zones.values() if zone.kind is ZoneKind.NO_GO)
    barred = union(grid, polygons_m)
    weights = None
    for zone in zones.values():
        if zone.kind is ZoneKind.PRIORITY:
            weights = np.ones(grid.cells.shape) if weights is None else weights
            np.maximum(weights, np.where(covered(grid, zone.polygon_m), zone.weight, 1.0), out=weights)
    areas_m = [zone.polygon_m for zone in zones.values() if zone.kind is ZoneKind.EXPLORE]
    inside = union(grid, areas_m) if areas_m else None
    zoning = Zoning(ground=grid.cells, barred=barred, polygons_m=polygons_m, inside=inside, weights=weights)
    return replace(grid, cells=np.where(barred, np.uint8(OBSTACLE), grid.cells), zoning=zoning)


def unzoned(grid: Grid) -> Grid:
    """Return a map without the zones drawn in it."""
    return grid if grid.zoning is None else replace(grid, cells=grid.zoning.ground, zoning=None)


def counting(area: Mask, grid: Grid) -> Mask:
    """Return the part of an area that counts as to be explored on a zoned map: all of it without zones."""
    zoning = grid.zoning
    if zoning is None:
        return area
    counts = area & ~zoning.barred
    return counts if zoning.inside is None else counts & zoning.inside


def covered(grid: Grid, polygon_m: Sequence[tuple[float, float]]) -> Mask:
    """Return the cells (height, width) whose centres lie within a polygon."""
    corners = np.array([grid.from_point_m(*point) for point in polygon_m]) - 0.5  # centres at whole numbers
    (x, y), (next_x, next_y) = corners.T, np.roll(corners, -1, axis=0).T
    mask = np.zeros(grid.cells.shape, dtype=np.bool_)
    for row in range(max(0, _ceil(y.min(), grid.height)), _ceil(y.max(), grid.height)):
        crossed = (y <= row) != (next_y <= row)
        dx, dy = (next_x - x)[crossed], (next_y - y)[crossed]
        at = np.sort(x[crossed] + (row - y[crossed]) / dy * dx)
        for left, right in at.reshape(-1, 2):
            mask[row, _ceil(left, grid.width) : _ceil(right, grid.width)] = True
    return mask


def _ceil(value: npt.ArrayLike, most: int) -> int:
    """Return a coordinate rounded up, between 0 and `most`."""
    return math.ceil(min(max(float(np.asarray(value)), 0.0), most))


def union(grid: Grid, polygons_m: Iterable[Sequence[tuple[float, float]]]) -> Mask:
    """Return the cells (height, width) in any of some polygons."""
    mask = np.zeros(grid.cells.shape, dtype=np.bool_)
    for polygon_m in polygons_m:
        mask |= covered(grid, polygon_m)
    return mask
