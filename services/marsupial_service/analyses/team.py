"""Convert the bodies of robots to a team: robot types, where and when robots will be free, their homes.

A docking or undocking in progress keeps both robots busy. The rover counts as being where it will be at the end: aboard
when docking, on the ground when undocking.
"""

from collections.abc import Mapping, Sequence

from marsupial.formats.fields import Fields, Notes
from marsupial.formats.scenario.read import read_types
from marsupial.formats.scenario.team import MemberEntry, check_carriers, check_names, start_fault
from marsupial.model.grid import OBSTACLE, Cell, Grid, Terrain
from marsupial.model.mission import MapMeeting
from marsupial.model.robots import RobotType, Role, TeamMember
from marsupial.model.situation import SituationGoal
from marsupial.model.sizes import Extent
from marsupial.model.world import RobotReport
from marsupial.wording import unknown
from marsupial_service.schemas.mapstates import (
    ChargerBody,
    DockBody,
    DriveBody,
    PlacedBody,
    RobotBody,
    UndockBody,
)
from marsupial_service.schemas.missions import RobotNoteBody
from marsupial_service.settings import ServiceLimits

# pose of a map without an origin
ORIGIN = (0.0, 0.0, 0.0)

Types = Mapping[str, RobotType]
Posed = PlacedBody | RobotNoteBody


def types_of(
    fields: Fields, terrains: tuple[Terrain, ...], extent: Extent | None, limits: ServiceLimits
) -> dict[str, RobotType]:
    """Return ``robot_types`` by name, without those that have problems, which are noted."""
    kinds = read_types(fields, terrains, extent, limits.sizes)
    return {name: kind for name, kind in kinds.items() if kind is not None}


def entries_of(
    bodies: Sequence[PlacedBody], types: Types, grid: Grid, notes: Notes, *, standing: bool = False
) -> list[MemberEntry]:
    """Return robots with their places on the map; if `standing`, check that they can stand there."""
    entries = []
    for i, body in enumerate(bodies):
        part, kind = notes.below(f"[{i}]"), types.get(body.type)
        if kind is None:
            part.wrong("type", unknown("robot type", body.type, types))
        cell = cell_of(body, grid, part, kind if standing else None)
        entries.append(MemberEntry(part, TeamMember(name=body.name, type=body.type, start=cell, carrier=body.carrier)))
    check_names(entries)
    check_carriers(entries, types)
    return entries


def cell_of(body: Posed, grid: Grid, notes: Notes, kind: RobotType | None = None) -> Cell | None:
    """Return where a robot is: its cell, or that of its pose; None if it has neither, or (noted) off the map."""
    if body.pose_m is not None:
        return _on_map("pose_m", body.pose_m, grid, notes, kind)
    return None if body.cell is None else _on_map("cell", body.cell, grid, notes, kind)


def _on_map(
    key: str, point: tuple[float, float], grid: Grid, notes: Notes, kind: RobotType | None = None
) -> Cell | None:
    """Return the cell that a field gives (as such or in metres), on which a robot of that kind, if any, can stand."""
    if fault := start_fault(grid, kind, point):
        notes.wrong(key, fault)
    cell = point if isinstance(point, Cell) else grid.cell_at_m(*point)
    return cell if grid.contains(cell) else None


def chargers_of(bodies: Sequence[ChargerBody], grid: Grid, notes: Notes) -> tuple[Cell, ...]:
    """Return ``chargers``, without those that have problems, which are noted."""
    cells: list[Cell] = []
    for i, body in enumerate(bodies):
        key, point = ("cell", body.cell) if body.at_m is None else ("at_m", body.at_m)
        assert point is not None
        part = notes.below(f"chargers[{i}]")
        cell = _on_map(key, point, grid, part)
        if cell is not None and grid.cells[cell.y, cell.x] == OBSTACLE:
            part.wrong(key, "is an obstacle")
        elif cell is not None:
            cells.append(cell)
    return tuple(cells)


def check_charge(charge: float | None, kind: RobotType | None, notes: Notes) -> None:
    """Note a charge of a robot that has no battery."""
    if charge is not None and kind is not None and kind.battery is None:
        notes.wrong("charge", f"a {kind.name} has no battery")


def robots_of(bodies: Sequence[RobotBody], types: Types, grid: Grid, notes: Notes) -> tuple[RobotReport, ...]:
    """Return ``robots``, with the time in ms from now at which each is free."""
    entries = entries_of(bodies, types, grid, notes.below("robots"), standing=True)
    roles = {body.name: types[body.type].role for body in bodies if body.type in types}
    free_at_ms: dict[str, int] = {}
    for body, entry in zip(bodies, entries, strict=True):
        _read_action(body, roles, free_at_ms, entry.notes.below("action"))
        check_charge(body.charge, types.get(body.type), entry.notes)
    return tuple(
        RobotReport(
            name=entry.member.name,
            type=entry.member.type,
            cell=entry.member.start,
            carrier=entry.member.carrier,
            free_at_ms=free_at_ms.get(entry.member.name, 0),
            charge=body.charge,
        )
        for body, entry in zip(bodies, entries, strict=True)
    )


def _read_action(body: RobotBody, roles: Mapping[str, Role], free_at_ms: dict[str, int], notes: Notes) -> None:
    """Enter when a robot and its partner will be free again, given the robot's current action."""
    action = body.action
    if action is None:
        return
    busy = [body.name]
    if not isinstance(action, DriveBody) and roles.get(body.name) is not Role.ROVER:
        notes.wrong("name", f"{body.name!r} is not a rover; only rovers can {action.name}")
    elif not isinstance(action, DockBody) and body.carrier is not None:
        notes.wrong("name", f"a robot aboard a carrier can't {action.name}; an undocking rover needs a pose")
    elif isinstance(action, DockBody) and body.carrier is None:
        notes.wrong("name", "a docking rover needs a carrier instead of a pose")
    elif isinstance(action, DockBody) and body.carrier is not None:
        busy.append(body.carrier)
    elif isinstance(action, UndockBody) and roles.get(action.carrier) is not Role.CARRIER:
        carriers = [name for name, role in roles.items() if role is Role.CARRIER]
        notes.wrong("carrier", unknown("carrier", action.carrier, carriers))
    elif isinstance(action, UndockBody):
        busy.append(action.carrier)
    for robot in busy:
        free_at_ms[robot] = max(free_at_ms.get(robot, 0), round(1000 * action.remaining_s))


def homes_of(
    bodies: Sequence[RobotBody], types: Types, grid: Grid, goal: SituationGoal, notes: Notes
) -> dict[str, Cell]:
    """Return where carriers have to end: all of them say so if the goal asks for their return."""
    homes: dict[str, Cell] = {}
    for i, body in enumerate(bodies):
        part, kind = notes.below(f"robots[{i}]"), types.get(body.type)
        given = [key for key in ("home_m", "home_cell") if getattr(body, key) is not None]
        if kind is None or kind.role is not Role.CARRIER:
            for key in given:
                part.wrong(key, "only carriers have a home")
        elif len(given) > 1:
            part.wrong("home_cell", "give home_m or home_cell, not both")
        elif given:
            cell = _on_map(given[0], getattr(body, given[0]), grid, part, kind)
            homes |= {} if cell is None else {body.name: cell}
        elif goal.return_home:
            part.wrong("home_m", "missing; the goal return_home needs it")
    return homes


def check_meetings(meetings: Sequence[MapMeeting], types: Types, grid: Grid, notes: Notes) -> None:
    """Note errors for meeting points in use that are off the map, or for types that can't meet."""
    for i, meeting in enumerate(meetings):
        part = notes.below(f"meetings[{i}]")
        for role in Role:
            _on_map(f"{role}_cell", getattr(meeting, f"{role}_cell"), grid, part)
            name = getattr(meeting, f"{role}_type")
            if name not in types:
                part.wrong(f"{role}_type", unknown("robot type", name, types))
            elif types[name].role is not role:
                part.wrong(f"{role}_type", f"{name!r} is not a {role}")
