"""Situations as JSON: everything a planner needs at one moment, to store, send and plan for again.

::

    {
      "format": "marsupial situation", "version": 1,
      "types":    [{"name", "role": "carrier" or "rover", "capacity", "dock_ms", "undock_ms",
                    "battery": {"capacity_j", "stand_w", "drive_w", "charge_w"}, "seats", "seats_as"}],
      "robots":   [{"name", "type", "place" or "carrier", "free_at_ms", "home", "charge_j"}],
      "targets":  [{"name", "explorers": [type names], "reveal_m2", "priority"}],
      "meetings": [names], "homes": [names], "chargers": [names],
      "goal":     {"recover_rovers", "return_home"},
      "places":   [names: rows and columns of the tables: starts in robot order, targets, meetings, homes, chargers],
      "travel_ms": {type name: [row per place it leaves from: [ms per place it goes to, or null: no path]]}
    }

Times are integer milliseconds, at most 10^12; areas are square metres. Numbers that are 0, flags that are false,
``homes``, ``home``, ``places`` and a ``priority`` of 1 may be left out; so may ``chargers``, ``battery`` (no limit) and
``charge_j`` (full). A carrier type with ``seats`` ``{rover type: number}`` takes at most that many rovers of each type,
and none of other types; without a ``capacity`` it takes as many as there are seats. Rovers of a type with ``seats_as``
take the seats of that other type. Reading reports every problem with its path, like ``robots[1].type: ...``.
"""

import json
import re
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from typing import Any

import numpy as np

from marsupial.errors import Problem, SituationError
from marsupial.formats.fields import Fields, is_whole, read_places, shown
from marsupial.formats.jsonvalues import JsonFault, load_json
from marsupial.model import (
    UNREACHABLE,
    PlanningBattery,
    PlanningType,
    RobotState,
    Situation,
    SituationGoal,
    TargetInfo,
    TravelTable,
)
from marsupial.model.bounds import BOUNDS, LONGEST_MS, LONGEST_TEXT
from marsupial.model.robots import Role
from marsupial.wording import suggestion

FORMAT, VERSION = "marsupial situation", 1

_DURATION = BOUNDS["duration_ms"]
_SURROGATE = re.compile("[\ud800-\udfff]")


def situation_to_json(situation: Situation) -> str:
    """Return `situation` as JSON text, with one row of a travel table per line."""
    try:
        # Besides the types of JSON there are sets of names, and numpy's integers.
        head = json.dumps(
            _head(situation),
            indent=2,
            ensure_ascii=False,
            allow_nan=False,
            default=lambda value: sorted(value) if isinstance(value, frozenset) else int(value),
        )
    except ValueError as error:
        raise SituationError([Problem("targets", f"reveal_m2 must be a finite number ({error})")]) from None
    tables = []
    for kind in situation.types:
        table = situation.travel_ms[kind.name].tolist()
        rows = ([None if ms == UNREACHABLE else ms for ms in row] for row in table)
        lines = ",\n".join(f"      {json.dumps(row)}" for row in rows)
        tables.append(f"    {json.dumps(kind.name, ensure_ascii=False)}: [\n{lines}\n    ]")
    joined = ",\n".join(tables)
    return f'{head[:-2]},\n  "travel_ms": {{\n{joined}\n  }}\n}}\n'


def situation_from_json(text: str) -> Situation:
    """Return the situation that JSON text describes; a `SituationError` has every problem with its path."""
    if not text.strip():
        raise SituationError("is empty")
    try:
        data = load_json(text)
    except JsonFault as fault:
        raise SituationError(str(fault)) from None
    except (ValueError, RecursionError) as error:
        raise SituationError(f"is not JSON: {error}") from None
    return situation_in(data)


def situation_in(data: object, path: str = "") -> Situation:
    """Return the situation that parsed JSON describes; the path of each problem in a `SituationError` is below `path`.

    This is the only reader of situations: the service uses it for the bodies of requests.
    """
    if not isinstance(data, Mapping):
        raise SituationError([Problem(path, f"must be a mapping of fields, got {shown(data)}")])
    fields = Fields(data, path, [])
    parts = _read(fields)
    fields.check(SituationError)
    try:
        return Situation(**parts)
    except SituationError as error:
        fields.take(error)
        raise SituationError(fields.problems) from None


def _head(situation: Situation) -> dict[str, Any]:
    """Return all fields except the travel tables, which `json` would write with one number per line."""
    return {
        "format": FORMAT,
        "version": VERSION,
        "types": [_type_fields(kind) for kind in situation.types],
        "robots": [_given(robot) for robot in situation.robots],
        "targets": [_target_fields(target) for target in situation.targets],
        "meetings": situation.meetings,
        "homes": situation.homes,
        **({"chargers": situation.chargers} if situation.chargers else {}),
        "goal": asdict(situation.goal),
        "places": situation.places,
    }


def _given(value: PlanningType | RobotState) -> dict[str, Any]:
    return {key: one for key, one in asdict(value).items() if one is not None}


def _type_fields(kind: PlanningType) -> dict[str, Any]:
    fields = _given(kind) | {"seats": dict(kind.seats)}
    return {key: value for key, value in fields.items() if value or key not in ("seats", "seats_as")}


def _target_fields(target: TargetInfo) -> dict[str, Any]:
    fields = asdict(target) | {"reveal_m2": float(target.reveal_m2)}
    if fields["priority"] == 1:
        del fields["priority"]
    return fields


def _read(fields: Fields) -> dict[str, Any]:
    """Return the arguments of `Situation`; they are valid only if no problem was noted."""
    if fields.text("format", FORMAT) != FORMAT:
        fields.wrong("format", f"must be {FORMAT!r}")
    if fields.integer("version", VERSION) != VERSION:
        fields.wrong("version", f"must be {VERSION}")
    types = tuple(_type(part) for part in fields.parts("types"))
    robots = tuple(_robot(part) for part in fields.parts("robots"))
    targets = tuple(_target(part) for part in fields.parts("targets"))
    meetings, homes = _names(fields, "meetings"), _names(fields, "homes", required=False)
    goal = _goal(fields.part("goal", required=False))
    starts = [robot.place for robot in robots if robot.place is not None]
    chargers = _names(fields, "chargers", required=False)
    places = [*starts, *(target.name for target in targets), *meetings, *homes, *chargers]
    if fields.has("places") and fields.data["places"] != places:
        fields.wrong("places", f"must be {places}: starts in robot order, targets, meetings, homes, chargers")
    travel_ms = _travel_tables(fields.part("travel_ms"), [kind.name for kind in types if kind.name], len(places))
    fields.finish()
    return {
        "types": types,
        "robots": robots,
        "targets": targets,
        "meetings": meetings,
        "homes": homes,
        "chargers": chargers,
        "goal": goal,
        "travel_ms": travel_ms,
    }


def _type(fields: Fields) -> PlanningType:
    role = fields.choice("role", [role.value for role in Role])
    capacity, seats = read_places(fields, 0)
    kind = PlanningType(
        name=_name(fields, "name"),
        role=Role(role) if role else Role.ROVER,
        capacity=capacity,
        dock_ms=fields.count("dock_ms", 0),
        undock_ms=fields.count("undock_ms", 0),
        battery=_battery(fields.part("battery")) if fields.has("battery") else None,
        seats=seats,
        seats_as=fields.text("seats_as", "") if fields.has("seats_as") else "",
    )
    fields.finish()
    return kind


def _battery(fields: Fields) -> PlanningBattery:
    powers = {key: fields.quantity(key, 0.0) for key in ("stand_w", "drive_w", "charge_w")}
    battery = PlanningBattery(capacity_j=fields.quantity("capacity_j"), **powers)
    fields.finish()
    return battery


def _robot(fields: Fields) -> RobotState:
    if fields.has("place") == fields.has("carrier"):
        fields.wrong("", "must have either a place or a carrier")
    robot = RobotState(
        name=_name(fields, "name"),
        type=fields.text("type"),
        place=_name(fields, "place", "") or None,
        carrier=fields.text("carrier", "") or None,
        free_at_ms=fields.count("free_at_ms", 0),
        home=fields.text("home", "") or None,
        charge_j=fields.quantity("charge_j") if fields.has("charge_j") else None,
    )
    fields.finish()
    return robot


def _target(fields: Fields) -> TargetInfo:
    target = TargetInfo(
        name=_name(fields, "name"),
        explorers=frozenset(_names(fields, "explorers")),
        reveal_m2=fields.quantity("reveal_m2", 0.0),
        priority=fields.quantity("priority", 1.0),
    )
    fields.finish()
    return target


def _goal(fields: Fields) -> SituationGoal:
    goal = SituationGoal(
        recover_rovers=fields.flag("recover_rovers", False), return_home=fields.flag("return_home", False)
    )
    fields.finish()
    return goal


def _name(fields: Fields, key: str, default: str | None = None) -> str:
    """Read a name: any text that UTF-8 can hold."""
    name = fields.text(key, default)
    if name and (fault := _name_fault(name)):
        fields.wrong(key, fault)
    return name


def _name_fault(value: object) -> str | None:
    """Return why a value is no name (blank, too long, half of a surrogate pair in it), or None."""
    if not isinstance(value, str) or not value.strip() or _SURROGATE.search(value):
        return f"must be a name, got {shown(value)}"
    return f"must have at most {LONGEST_TEXT} characters, has {len(value)}" if len(value) > LONGEST_TEXT else None


def _names(fields: Fields, key: str, *, required: bool = True) -> tuple[str, ...]:
    value = fields.items(key, "a list of names", required=required)
    for i, item in enumerate(value):
        if fault := _name_fault(item):
            fields.wrong(f"{key}[{i}]", fault)
    return tuple(item for item in value if isinstance(item, str))


def _travel_tables(fields: Fields, types: Sequence[str], size: int) -> dict[str, TravelTable]:
    """Read the travel tables of `size` places, one for each robot type."""
    for kind in fields.data:
        if kind not in types:
            fields.wrong(str(kind), f"unknown field{suggestion(str(kind), types)}")
    tables = {}
    for kind in types:
        rows = fields.items(kind, f"a list of {size} rows, one per place", least=size)
        if len(rows) > size:
            fields.wrong(kind, f"must be a list of {size} rows, one per place")
        elif len(rows) == size:
            tables[kind] = np.array([_times(fields, f"{kind}[{i}]", row, size) for i, row in enumerate(rows)], np.int64)
            tables[kind] = tables[kind].reshape(size, size)
    return tables


def _times(fields: Fields, key: str, row: object, size: int) -> list[int]:
    if not isinstance(row, list) or len(row) != size:
        fields.wrong(key, f"must be a list of {size} times, one per place")
        return [UNREACHABLE] * size
    given = [ms for ms in row if ms is not None]
    # without a loop in Python: there may be millions of times
    if set(map(type, given)) <= {int} and min(given, default=0) >= 0 and max(given, default=0) <= LONGEST_MS:
        return [UNREACHABLE if ms is None else ms for ms in row]
    i = next(i for i, ms in enumerate(row) if ms is not None and (not is_whole(ms) or _DURATION.fault(ms)))
    fields.wrong(f"{key}[{i}]", f"must be whole milliseconds, 0 or more, or null for no path, got {shown(row[i])}")
    return [UNREACHABLE] * size
