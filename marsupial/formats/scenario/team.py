"""The field ``team`` of a scenario file: numbers of equal carriers and rovers, or a list of all robots.

A rover aboard names its carrier. Every other robot has a start in metres of the map frame, or the word ``drawn``, and
then a seed draws the start. Names that differ only in case count as equal, as in PDDL.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from marsupial.errors import Problem, ScenarioError
from marsupial.formats.fields import Fields, Notes
from marsupial.generators.builtin import check_team_size
from marsupial.maps.discs import fits
from marsupial.model import UNKNOWN, Cell, Grid, RobotType, Role, Scenario, TeamMember
from marsupial.model.bounds import team_fault
from marsupial.model.robots import uniform_team
from marsupial.model.seats import most_aboard, overload
from marsupial.wording import unknown

DRAWN = "drawn"

Kinds = Mapping[str, RobotType | None]
"""Robot types by name; None for one whose fields have problems: no further problems are noted about it."""


@dataclass(frozen=True, slots=True)
class MemberEntry:
    """One robot of the list, with the notes on its fields."""

    notes: Notes
    member: TeamMember


def standing_fault(grid: Grid, kind: RobotType, cell: Cell) -> str | None:
    """Return why a robot of this type can't stand on a cell of the map, or None."""

    if fits(grid, kind, cell):
        return None
    code = int(grid.cells[cell.y, cell.x])
    if code in kind.terrains:
        return f"its radius of {kind.radius_m:g} m does not fit there"
    names = {terrain.code: terrain.name for terrain in grid.terrains} | {UNKNOWN: "unknown"}
    return f"the cell is {names[code]}"


def read_team(top: Fields, kinds: Kinds, grid: Grid | None) -> tuple[TeamMember, ...]:
    """Read ``team`` in either form; check starts if the map could be read."""
    given = top.data.get("team", [])
    if isinstance(given, Mapping):
        return _read_numbers(top.part("team"), kinds)
    kind_fault = "must be a list of robots, or a mapping with 'carriers' and 'rovers_per_carrier'"
    # The length is checked before any of the robots.
    if fault := team_fault(len(given)) if isinstance(given, list) else kind_fault:
        top.has("team")
        top.wrong("team", fault)
        return ()
    entries = [_read_member(fields, kinds, grid) for fields in top.parts("team")]
    check_names(entries)
    check_carriers(entries, kinds)
    if "team" in top.data and _all_known(kinds) and not any(_role(e, kinds) is Role.CARRIER for e in entries):
        top.wrong("team", "needs at least one carrier")
    return tuple(entry.member for entry in entries)


def numbered_team(carrier: RobotType, rover: RobotType | None, carriers: int, rovers: int) -> tuple[TeamMember, ...]:
    """Return `carriers` carriers of these types with `rovers` rovers aboard each; starts are drawn later."""
    rover_type = "" if rover is None else rover.name
    team = uniform_team(carriers, rovers)
    return tuple(replace(m, type=carrier.name if m.carrier is None else rover_type) for m in team)


def with_team(scenario: Scenario, carriers: int | None, rovers: int | None) -> Scenario:
    """Return the scenario with other numbers of carriers, and of rovers per carrier; None keeps a number.

    The new team has the types of the first carrier, whose number of rovers is kept, and the first rover that fits on
    it; all starts are drawn.
    """
    if carriers is None and rovers is None:
        return scenario
    of_role = {role: [m for m in scenario.team if scenario.type_of(m).role is role] for role in Role}
    first = of_role[Role.CARRIER][0]
    carriers = len(of_role[Role.CARRIER]) if carriers is None else carriers
    rovers = sum(m.carrier == first.name for m in scenario.team) if rovers is None else rovers
    check_team_size(carriers, rovers)
    carrier = scenario.type_of(first)
    types = [*map(scenario.type_of, of_role[Role.ROVER]), *(k for k in scenario.robot_types if k.role is Role.ROVER)]
    rover = next((kind for kind in types if most_aboard(carrier, kind.name)), types[0] if types else None)
    if problem := _size_problem(carrier, rover, rovers):
        raise ScenarioError([Problem("rovers", problem)])
    team = numbered_team(carrier, rover, carriers, rovers)
    strangers = [i for i, fault in enumerate(scenario.faults) if fault.robot not in (None, *(m.name for m in team))]
    if strangers:
        raise ScenarioError([Problem(f"faults[{i}].robot", "is not in the team of other numbers") for i in strangers])
    return replace(scenario, team=team)


def _size_problem(carrier: RobotType, rover: RobotType | None, rovers: int) -> str | None:
    if rovers and rover is None:
        return "there is no robot type with role rover"
    if rovers > carrier.capacity:
        return f"{rovers} for each carrier, but type {carrier.name!r} has capacity {carrier.capacity}"
    fault = None if rover is None else overload(carrier, [rover.name] * rovers)
    return None if fault is None else f"each carrier {fault}"


def _read_numbers(fields: Fields, kinds: Kinds) -> tuple[TeamMember, ...]:
    """Read the short form: ``carriers``, ``rovers_per_carrier``, and which types if there are several."""
    before = len(fields.problems)
    carriers, rovers = fields.count("carriers"), fields.count("rovers_per_carrier")
    carrier = _type_for(fields, Role.CARRIER, kinds, required=True)
    rover = _type_for(fields, Role.ROVER, kinds, required=rovers > 0, carrier=carrier)
    fields.finish()
    if len(fields.problems) > before or carrier is None or (rovers and rover is None):
        return ()
    if fault := team_fault(carriers * (1 + rovers)):
        fields.wrong("carriers", fault)
        return ()
    if problem := _size_problem(carrier, rover, rovers):
        fields.wrong("rovers_per_carrier", problem)
    return numbered_team(carrier, rover, carriers, rovers)


def _type_for(
    fields: Fields, role: Role, kinds: Kinds, *, required: bool, carrier: RobotType | None = None
) -> RobotType | None:
    """Read ``carrier_type`` or ``rover_type``; if it is absent, return the first type of that role that fits."""
    key = f"{role}_type"
    fitting = {name: kind for name, kind in kinds.items() if kind is not None and kind.role is role}
    if fields.has(key):
        name = _read_type_name(fields, key, kinds)
        kind = kinds.get(name)
        if kind is not None and kind.role is not role:
            fields.wrong(key, f"{name!r} is a {kind.role}, not a {role}")
        return kind
    if not _all_known(kinds):
        return None
    if required and not fitting:
        fields.wrong("", f"needs a robot type with role {role}")
    first = next((kind for kind in fitting.values() if carrier is None or most_aboard(carrier, kind.name)), None)
    return first or next(iter(fitting.values()), None)


def _all_known(kinds: Kinds) -> bool:
    """Return whether all robot types could be read, so that a missing one is the team's problem."""
    return bool(kinds) and None not in kinds.values()


def _read_type_name(fields: Fields, key: str, kinds: Kinds) -> str:
    return fields.choice(key, kinds, what="robot type") if kinds else fields.text(key)


def _read_member(fields: Fields, kinds: Kinds, grid: Grid | None) -> MemberEntry:
    name = fields.name("name")
    type_name = _read_type_name(fields, "type", kinds)
    carrier = fields.name("carrier") if fields.has("carrier") else None
    start = _read_start(fields, kinds.get(type_name), grid)
    fields.finish()
    return MemberEntry(fields, TeamMember(name=name, type=type_name, start=start, carrier=carrier))


def _read_start(fields: Fields, kind: RobotType | None, grid: Grid | None) -> Cell | None:
    """Read the start of a robot: a point in metres, ``drawn``, or absent for a rover aboard."""
    if fields.has("carrier"):
        fields.refuse("start", "give 'start' or 'carrier', not both")
        return None
    if not fields.has("start"):
        fields.wrong("start", f"missing: needs [x, y] in metres, '{DRAWN}', or a 'carrier'")
        return None
    if fields.data["start"] == DRAWN:
        return None
    point = fields.numbers("start", 2)
    if not point or grid is None:
        return None
    cell = grid.cell_at_m(*point)
    if fault := start_fault(grid, kind, point):
        fields.wrong("start", fault)
    return cell


def start_fault(grid: Grid, kind: RobotType | None, point: Sequence[float]) -> str | None:
    """Return why a robot of a type (None: any) can't start at a point, a cell or in metres, or None."""
    cell = point if isinstance(point, Cell) else grid.cell_at_m(point[0], point[1])
    where = f"[{point[0]:g}, {point[1]:g}]"
    if not grid.contains(cell):
        return f"{where} is outside the map"
    if kind is not None and (fault := standing_fault(grid, kind, cell)):
        return f"a {kind.name} can't stand at {where}: {fault}"
    return None


PLACE_PREFIXES = ("s_", "t_", "m_", "h_", "charge_")
"""How the names of starts, targets, meeting points, homes and charging places begin (`marsupial.maps.survey`)."""


def check_names(entries: list[MemberEntry]) -> None:
    """Check that no name is used twice or looks like the name of a place."""
    seen: set[str] = set()
    for entry in entries:
        name = entry.member.name.lower()
        if name and name in seen:
            entry.notes.wrong("name", f"{entry.member.name!r} is used twice")
        if name.startswith(PLACE_PREFIXES):
            rule = "names must not begin with 's_', 't_', 'm_', 'h_' or 'charge_'"
            entry.notes.wrong("name", f"{entry.member.name!r} looks like a place: {rule}")
        seen.add(name)


def _role(entry: MemberEntry, kinds: Kinds) -> Role | None:
    kind = kinds.get(entry.member.type)
    return None if kind is None else kind.role


def check_carriers(entries: list[MemberEntry], kinds: Kinds) -> None:
    """Check that only carriers carry, only rovers are carried, and each carrier has places for its rovers."""
    by_name = {entry.member.name: entry for entry in entries if entry.member.name}
    load: dict[str, list[str]] = {}
    for entry in entries:
        carrier = entry.member.carrier
        if not carrier:
            continue
        if _role(entry, kinds) is Role.CARRIER:
            entry.notes.wrong("carrier", f"{entry.member.name!r} is a carrier and can't be carried")
        elif carrier not in by_name:
            entry.notes.wrong("carrier", unknown("carrier", carrier, by_name))
        elif _role(by_name[carrier], kinds) is Role.ROVER:
            entry.notes.wrong("carrier", f"{carrier!r} is a rover and can't carry")
        else:
            load.setdefault(carrier, []).append(entry.member.type)
            kind = kinds.get(by_name[carrier].member.type)
            if (
                kind is not None
                and entry.member.type in kinds
                and not most_aboard(kind, entry.member.type)
                and kind.seats
            ):
                entry.notes.wrong("carrier", f"type {entry.member.type!r} does not fit on type {kind.name!r}")
                load[carrier].pop()
    for name, rovers in load.items():
        kind = kinds.get(by_name[name].member.type)
        if kind is not None and (fault := overload(kind, rovers)):
            by_name[name].notes.wrong("", fault)
