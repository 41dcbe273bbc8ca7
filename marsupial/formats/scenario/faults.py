"""The field ``faults`` of a scenario file: what goes wrong, to which robot or area, and when."""

from collections.abc import Sequence

from marsupial.formats.fields import Fields
from marsupial.formats.scenario.map import read_cell, terrain_code
from marsupial.model import Cell, Grid, Role, Terrain
from marsupial.model.faults import FROM_START, OF_A_ROBOT, Fault, FaultKind
from marsupial.wording import unknown

MOST_FAULTS = 1000

# faults of a robot that is named: a series of one at random would mean little
_NAMED = frozenset({FaultKind.RETURNS, FaultKind.JOINS})
_WHEN = ("at_s", "rate_per_h", "seen_m")


def read_faults(top: Fields, team: Sequence[str], terrains: Sequence[Terrain], grid: Grid | None) -> tuple[Fault, ...]:
    """Read ``faults``; none if the field is absent. `team` has the names of the robots."""
    parts = top.parts("faults", required=False)
    if len(parts) > MOST_FAULTS:
        top.wrong("faults", f"has {len(parts)} faults, more than the limit of {MOST_FAULTS}")
        return ()
    return tuple(_read_fault(fields, team, terrains, grid) for fields in parts)


def _read_fault(fields: Fields, team: Sequence[str], terrains: Sequence[Terrain], grid: Grid | None) -> Fault:
    kind = FaultKind(fields.choice("fault", list(FaultKind)) or FaultKind.LOST)
    series = "rate_per_h" in fields.data
    fault = Fault(
        kind=kind,
        robot=_read_robot(fields, kind, team, series),
        role=_read_role(fields) if series and kind in OF_A_ROBOT and "robot" not in fields.data else None,
        at_ms=round(1000 * fields.quantity("at_s")) if fields.has("at_s") else None,
        rate_per_h=fields.quantity("rate_per_h") if fields.has("rate_per_h") else None,
        seen=read_cell(fields, "seen_m", grid) if fields.has("seen_m") else None,
        seed=fields.count("seed", 1) if series or kind in FROM_START else 1,
        share=_read_share(fields, kind),
        reported=fields.flag("reported", True) if kind is FaultKind.SLOWS else True,
        for_ms=round(1000 * fields.quantity("for_s")) if kind is FaultKind.STUCK else 0,
        area=_read_area(fields, grid) if kind is FaultKind.GROUND else None,
        terrain=_read_terrain(fields, terrains) if kind is FaultKind.GROUND else 0,
    )
    given = [key for key in _WHEN if key in fields.data]
    if kind in FROM_START:
        for key in given:
            fields.refuse(key, f"'{kind}' lasts from the start of a mission")
    elif len(given) != 1:
        fields.wrong("", f"needs one of {', '.join(_WHEN)}, got {' and '.join(given) or 'none'}")
    fields.finish()
    return fault


def _read_robot(fields: Fields, kind: FaultKind, team: Sequence[str], series: bool) -> str | None:
    if kind not in OF_A_ROBOT and kind is not FaultKind.POSITION_NOISE:
        fields.refuse("robot", f"a fault '{kind}' is no robot's")
        return None
    if not fields.has("robot"):
        if kind in OF_A_ROBOT and (kind in _NAMED or not series):
            fields.wrong("robot", "missing: only a random series (rate_per_h) draws its robots")
        return None
    name = fields.name("robot")
    if name and team and name not in team:
        fields.wrong("robot", unknown("robot", name, team))
    return name or None


def _read_role(fields: Fields) -> Role | None:
    if not fields.has("role"):
        return None
    role = fields.choice("role", list(Role))
    return Role(role) if role else None


def _read_share(fields: Fields, kind: FaultKind) -> float:
    if kind is FaultKind.SLOWS:
        return round(fields.quantity("speed_share"), 2)
    return fields.quantity("share") if kind in FROM_START else 1.0


def _read_area(fields: Fields, grid: Grid | None) -> tuple[Cell, Cell] | None:
    """Read two opposite corners in metres; return the corner cells of the part on the map."""
    corners = fields.numbers("area_m", 4)
    if not corners or grid is None:
        return None
    ends = (grid.cell_at_m(*corners[:2]), grid.cell_at_m(*corners[2:]))
    xs, ys = sorted(cell.x for cell in ends), sorted(cell.y for cell in ends)
    low = Cell(max(0, xs[0]), max(0, ys[0]))
    high = Cell(min(grid.width - 1, xs[1]), min(grid.height - 1, ys[1]))
    if low.x > high.x or low.y > high.y:
        fields.wrong("area_m", "is outside the map")
        return None
    return low, high


def _read_terrain(fields: Fields, terrains: Sequence[Terrain]) -> int:
    return terrain_code(fields, "terrain", fields.text("terrain"), terrains) or 0
