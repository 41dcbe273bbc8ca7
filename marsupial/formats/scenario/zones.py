"""The field ``zones`` of a scenario file: polygons where robots must not go, or should explore, and when they hold."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from marsupial.formats.fields import Fields, list_faults
from marsupial.formats.scenario.team import Kinds
from marsupial.maps.discs import disc
from marsupial.model import Cell, DatedZone, Goal, Grid, RobotType, Role, TeamMember, Zone, ZoneKind
from marsupial.model.zones import MOST_ZONES, covered, zone_faults

Starts = Iterable[tuple[str, RobotType, Cell | None]]
"""The name, type and first cell of each robot; None for one that is carried or whose start is drawn."""


def read_zones(top: Fields) -> tuple[DatedZone, ...]:
    """Read ``zones``; none if the field is absent."""
    parts = top.parts("zones", required=False)
    if len(parts) > MOST_ZONES:
        top.wrong("zones", f"has {len(parts)} zones, more than the limit of {MOST_ZONES}")
        return ()
    zones = tuple(map(_read_zone, parts))
    for path, fault in name_faults(zones):
        top.wrong(f"zones{path}", fault)
    return zones


def check_zones(
    top: Fields, zones: Iterable[DatedZone], grid: Grid, kinds: Kinds, team: Iterable[TeamMember], goal: Goal
) -> None:
    """Note zones off the map, and those that catch a robot at its start or keep it from its home."""
    starts = [(member.name, kind, member.start) for member in team if (kind := kinds.get(member.type)) is not None]
    for i, dated in enumerate(zones):
        fault = conflict(dated, grid, goal, starts)
        if not covered(grid, dated.zone.polygon_m).any():
            fault = "contains the centre of no cell of the map"
        if fault is not None:
            top.wrong(f"zones[{i}].polygon_m", fault)


def _read_zone(fields: Fields) -> DatedZone:
    kind = ZoneKind(fields.choice("kind", list(ZoneKind)) or ZoneKind.NO_GO)
    weight = fields.number("weight") if kind is ZoneKind.PRIORITY else 1.0
    if kind is not ZoneKind.PRIORITY:
        fields.refuse("weight", f"only zones '{ZoneKind.PRIORITY}' have it")
    before = len(fields.problems)
    dated = DatedZone(
        name=fields.name("name"),
        zone=Zone(kind=kind, polygon_m=_read_polygon(fields), weight=weight),
        from_ms=round(1000 * fields.quantity("from_s", 0.0)),
        until_ms=round(1000 * fields.quantity("until_s")) if fields.has("until_s") else None,
    )
    for key, fault in zone_faults(dated) if len(fields.problems) == before else ():
        fields.wrong(key, fault)
    fields.finish()
    return dated


def _read_polygon(fields: Fields) -> tuple[tuple[float, float], ...]:
    corners = fields.items("polygon_m", "a list of corners [x, y]")
    for i, corner in enumerate(corners):
        faults = list(list_faults(corner, 2))
        for where, fault in faults:
            fields.wrong(f"polygon_m[{i}]{where}", fault)
        if faults:
            return ()
    return tuple((float(x), float(y)) for x, y in corners)


def name_faults(zones: Sequence[DatedZone]) -> Iterator[tuple[str, str]]:
    """Yield the path and fault of each name that is used twice."""
    names = [dated.name for dated in zones]
    for i, name in enumerate(names):
        if name and name in names[:i]:
            yield f"[{i}].name", f"{name!r} is used twice"


def conflict(dated: DatedZone, grid: Grid, goal: Goal, starts: Starts) -> str | None:
    """Return which robot a no-go zone would catch at its start, or keep from its home; None if none."""
    if dated.zone.kind is not ZoneKind.NO_GO:
        return None
    begins, lasts = dated.from_ms == 0, dated.until_ms is None and goal.return_home

    mask = covered(grid, dated.zone.polygon_m)
    for name, kind, cell in starts:
        home = lasts and kind.role is Role.CARRIER
        if cell is None or not (begins or home):
            continue
        x, y = (np.array(cell) + disc(kind.radius_m / grid.resolution_m)).T
        inside = (x >= 0) & (y >= 0) & (x < grid.width) & (y < grid.height)
        if mask[y[inside], x[inside]].any():
            return f"{name} starts there" if begins else f"{name} has to return there: it is its home"
    return None


def zone_fields(dated: DatedZone) -> dict[str, Any]:
    """Return a zone as scenario files have it."""
    fields: dict[str, Any] = {
        "name": dated.name,
        "kind": str(dated.zone.kind),
        "polygon_m": [list(point) for point in dated.zone.polygon_m],
    }
    if dated.zone.kind is ZoneKind.PRIORITY:
        fields["weight"] = dated.zone.weight
    if dated.from_ms:
        fields["from_s"] = dated.from_ms / 1000
    return fields if dated.until_ms is None else fields | {"until_s": dated.until_ms / 1000}


def zone_in(fields: Mapping[str, Any]) -> DatedZone:
    """Return the zone with these valid fields, as `zone_fields` returns them."""
    polygon_m = tuple((float(x), float(y)) for x, y in fields["polygon_m"])
    until_s = fields.get("until_s")
    return DatedZone(
        name=fields["name"],
        zone=Zone(kind=ZoneKind(fields["kind"]), polygon_m=polygon_m, weight=float(fields.get("weight", 1.0))),
        from_ms=round(1000 * fields.get("from_s", 0.0)),
        until_ms=None if until_s is None else round(1000 * until_s),
    )
