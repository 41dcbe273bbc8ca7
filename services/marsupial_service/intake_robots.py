"""From the JSON of a map state to its robots: where they are free next and when, their homes, the meetings in use.

A running docking or undocking keeps both of its robots busy. The rover is where it will be at the end: docking it
counts as aboard, undocking it stands on the ground already.
"""

from __future__ import annotations

from collections.abc import Mapping

from marsupial.formats.fields import Fields
from marsupial.formats.scenario.team import Entry, Kinds, check_carriers, check_names, standing_fault
from marsupial.model.grid import Cell, Grid
from marsupial.model.mission import MapMeeting
from marsupial.model.robots import Role, TeamMember
from marsupial.model.situation import SituationGoal
from marsupial.model.world import RobotReport

_POSES = ("pose_m", "cell", "carrier")
_HOMES = ("home_m", "home_cell")


def read_robots(top: Fields, kinds: Kinds, grid: Grid) -> tuple[RobotReport, ...]:
    """Read ``robots``, with the time in ms from now at which each is free."""
    entries = [_read_robot(fields, kinds, grid) for fields in top.parts("robots")]
    check_names(entries)
    check_carriers(entries, kinds)
    roles = {entry.member.name: _role(kinds, entry.member.type) for entry in entries}
    free_at_ms: dict[str, int] = {}
    for entry in entries:
        _read_action(entry, roles, free_at_ms)
    return tuple(
        RobotReport(
            name=entry.member.name,
            type=entry.member.type,
            cell=entry.member.start,
            carrier=entry.member.carrier,
            free_at_ms=free_at_ms.get(entry.member.name, 0),
        )
        for entry in entries
    )


def read_homes(top: Fields, kinds: Kinds, grid: Grid, goal: SituationGoal) -> dict[str, Cell]:
    """Read where carriers have to end: all of them say so if the goal asks for their return."""
    homes: dict[str, Cell] = {}
    for fields in top.parts("robots"):
        name, kind = fields.text("name"), fields.text("type")
        given = [key for key in _HOMES if fields.has(key)]
        if _role(kinds, kind) is not Role.CARRIER:
            for key in given:
                fields.wrong(key, "only carriers have a home")
        elif len(given) > 1:
            fields.wrong("home_cell", "give home_m or home_cell, not both")
        elif given:
            cell = _read_cell(fields, given[0], kind, kinds, grid)
            homes |= {} if cell is None else {name: cell}
        elif goal.return_home:
            fields.wrong("home_m", "missing: the goal asks for carriers to return home")
    return homes


def read_meetings(top: Fields, kinds: Kinds, grid: Grid) -> tuple[MapMeeting, ...]:
    """Read ``meetings``: the meeting points in use."""
    return tuple(
        MapMeeting(
            name=fields.text("name"),
            carrier_cell=_cell_on_map(fields, "carrier_cell", grid),
            rover_cell=_cell_on_map(fields, "rover_cell", grid),
            carrier_type=_type_of_role(fields, "carrier_type", kinds, Role.CARRIER),
            rover_type=_type_of_role(fields, "rover_type", kinds, Role.ROVER),
        )
        for fields in top.parts("meetings", required=False)
    )


def _read_robot(fields: Fields, kinds: Kinds, grid: Grid) -> Entry:
    name, kind = fields.text("name"), fields.choice("type", kinds, what="robot type")
    given = [key for key in _POSES if fields.has(key)]
    if len(given) != 1:
        fields.wrong("", f"needs one of {', '.join(_POSES)}, got {' and '.join(given) or 'none'}")
    carrier = fields.text("carrier") if given == ["carrier"] else None
    cell = _read_cell(fields, given[0], kind, kinds, grid) if len(given) == 1 and carrier is None else None
    return Entry(fields, TeamMember(name=name, type=kind, start=cell, carrier=carrier))


def _read_action(entry: Entry, roles: Mapping[str, Role | None], free_at_ms: dict[str, int]) -> None:
    """Read what a robot is doing, and enter until when that keeps it and its partner busy."""
    if not entry.fields.has("action"):
        return
    action, member = entry.fields.part("action"), entry.member
    name, until_ms = action.text("name"), round(1000 * action.number("remaining_s"))
    partner = {"dock": member.carrier, "undock": action.data.get("carrier")}.get(name)
    if name != "drive" and roles[member.name] is not Role.ROVER:
        action.wrong("name", f"{member.name!r} is no rover: only rovers {name}")
    elif name == "dock" and member.carrier is None:
        action.wrong("name", "a rover that is docking has the carrier it docks on in place of a pose")
    elif name != "dock" and member.carrier is not None:
        action.wrong("name", f"a robot aboard a carrier can't {name}; a rover that is undocking has a pose")
    elif name == "undock" and roles.get(str(partner)) is not Role.CARRIER:
        action.wrong("carrier", f"there is no carrier {partner!r}")
    for robot in (member.name, partner):
        if robot is not None:
            free_at_ms[robot] = max(free_at_ms.get(robot, 0), until_ms)


def _read_cell(fields: Fields, key: str, kind: str, kinds: Kinds, grid: Grid) -> Cell | None:
    """Read a pose (``..._m`` is metres) where a robot of that type can stand."""
    numbers = fields.numbers(key, 2)
    robot_type = kinds.get(kind)
    if not numbers or robot_type is None:
        return None
    x, y = numbers
    cell = grid.cell_at_m(x, y) if key.endswith("_m") else Cell(int(x), int(y))
    if not grid.contains(cell):
        fields.wrong(key, f"[{x:g}, {y:g}] is outside the map")
    elif fault := standing_fault(grid, robot_type, cell):
        fields.wrong(key, f"a {kind} can't stand at [{x:g}, {y:g}]: {fault}")
    return cell


def _cell_on_map(fields: Fields, key: str, grid: Grid) -> Cell:
    x, y = fields.numbers(key, 2) or (0, 0)
    cell = Cell(int(x), int(y))
    if not grid.contains(cell):
        fields.wrong(key, f"[{cell.x}, {cell.y}] is outside the map")
    return cell


def _type_of_role(fields: Fields, key: str, kinds: Kinds, role: Role) -> str:
    name = fields.choice(key, kinds, what="robot type")
    if name and _role(kinds, name) is not role:
        fields.wrong(key, f"{name!r} is no {role}")
    return name


def _role(kinds: Kinds, name: str) -> Role | None:
    kind = kinds.get(name)
    return None if kind is None else kind.role
