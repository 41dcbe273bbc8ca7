"""Read a scenario file; ``docs/scenario-format.md`` describes the format field by field.

The file is YAML or JSON, a subset of it. It is parsed into plain values, and all fields are checked
(`marsupial.formats.fields`). Only a file without any problem becomes a `Scenario`.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import yaml

from marsupial.errors import Problem, ScenarioError
from marsupial.formats.fields import Fields, Notes, read_places, shown
from marsupial.formats.files import at_home, read_text
from marsupial.formats.scenario.faults import read_faults
from marsupial.formats.scenario.map import read_cell, read_map_field, read_terrains
from marsupial.formats.scenario.team import read_team
from marsupial.formats.scenario.zones import check_zones, read_zones
from marsupial.formats.yamlvalues import YamlFault, compose_yaml, parse_yaml, with_lines
from marsupial.model import (
    OBSTACLE,
    SQRT2,
    Battery,
    Cell,
    EnergyModel,
    Grid,
    MapReading,
    RobotType,
    Role,
    Routes,
    Terrain,
)
from marsupial.model.bounds import BOUNDS, MOST, Bound
from marsupial.model.scenario import Goal, MissionLimits, PlanningTime, Scenario
from marsupial.model.sizes import MOST as MOST_SIZES
from marsupial.model.sizes import MOST_TYPES, Extent, ground_faults, radius_fault
from marsupial.wording import unknown

FORMAT, VERSION = "marsupial-scenario", 1
MOST_BYTES = 64 * 1024 * 1024


def read_scenario(path: Path | str) -> Scenario:
    """Read a scenario file. Raise `ScenarioError` with every wrong field by its path and line."""
    return read_scenario_and_map(path)[0]


def read_scenario_and_map(path: Path | str) -> tuple[Scenario, MapReading | None]:
    """Read a scenario file, see `read_scenario`; return also how its map file was interpreted, if it has one."""
    path = at_home(path)
    data, text = parse(path)
    problems: list[Problem] = []
    if not isinstance(data, Mapping):
        raise ScenarioError(f"must be a mapping of fields, got {shown(data)}", source=str(path))
    found = _read(Fields(data, "", problems), path)
    if problems or found is None:
        raise ScenarioError(with_lines(problems, text), source=str(path))
    return found


def is_scenario_file(path: Path | str) -> bool:
    """Return whether a file is meant as a scenario file, valid or not: it is JSON, or names a format, team or types."""
    path = at_home(path)
    if path.suffix.lower() not in (".yaml", ".yml"):
        return path.suffix.lower() == ".json"
    try:
        return is_scenario_text(read_text(path, ScenarioError, MOST_BYTES))
    except ScenarioError:
        return False


def is_scenario_text(text: str) -> bool:
    """Return whether the text of a YAML file is meant as a scenario file; any text will do, as only keys are read."""
    try:
        top = compose_yaml(text)
    except YamlFault:
        return False
    keys = [key for key, _ in top.value] if isinstance(top, yaml.MappingNode) else []
    names = {key.value for key in keys if isinstance(key, yaml.ScalarNode)}
    return not {"format", "team", "robot_types"}.isdisjoint(names)


def parse(path: Path) -> tuple[object, str]:
    """Return the value of a YAML or JSON file, and its text; raise a ScenarioError if it is neither."""
    text = read_text(at_home(path), ScenarioError, MOST_BYTES)
    try:
        return parse_yaml(text), text
    except YamlFault as fault:
        raise ScenarioError(str(fault), source=str(path)) from fault


def _read(top: Fields, path: Path) -> tuple[Scenario, MapReading | None] | None:
    """Read all fields; the scenario is valid only if no problem was noted."""
    if not read_version(top, FORMAT, VERSION):
        return None
    name = top.text("name", path.stem)
    terrains = read_terrains(top)
    found = read_map_field(top, terrains, path.parent)
    if found is not None:
        found = found._replace(grid=replace(found.grid, chargers=_read_chargers(top, found.grid)))
    grid = None if found is None else found.grid
    kinds = read_types(top, terrains, None if grid is None else Extent(grid.cells.size, grid.resolution_m))
    team = read_team(top, kinds, grid)
    seed = top.integer("start_seed", None, BOUNDS["seed"]) if top.has("start_seed") else None
    goal, limits = read_goal(top), read_limits(top)
    planning_time = top.choice("planning_time", list(PlanningTime), PlanningTime.INSTANT)
    interference = top.flag("interference", False)
    faults = read_faults(top, [member.name for member in team], terrains, grid)
    zones = read_zones(top)
    top.finish()
    if grid is not None and not top.problems:
        check_zones(top, zones, grid, kinds, team, goal)
    if top.problems or found is None:
        return None
    scenario = Scenario(
        name=name,
        grid=found.grid,
        robot_types=tuple(kind for kind in kinds.values() if kind is not None),
        team=team,
        goal=goal,
        limits=limits,
        planning_time=PlanningTime(planning_time),
        start_seed=seed,
        interference=interference,
        faults=faults,
        zones=zones,
    )
    return scenario, found.reading


def _read_chargers(top: Fields, grid: Grid) -> tuple[Cell, ...]:
    """Read ``chargers``, each with its point ``at_m``."""
    cells: list[Cell] = []
    for fields in top.parts("chargers", required=False):
        cell = read_cell(fields, "at_m", grid)
        fields.finish()
        if cell is not None and grid.cells[cell.y, cell.x] == OBSTACLE:
            fields.wrong("at_m", "is an obstacle")
        elif cell is not None:
            cells.append(cell)
    return tuple(cells)


def read_version(top: Fields, form: str, latest: int) -> bool:
    """Check format and version; return False for a later version, whose fields are unknown here."""
    top.choice("format", [form])
    version = top.integer("version", None, Bound(1, MOST))
    if version > latest:
        top.wrong("version", f"must be at most {latest}, got {version}: the file is for a later marsupial")
    return version <= latest


def read_types(
    top: Fields, terrains: tuple[Terrain, ...], extent: Extent | None, limits: Mapping[str, float] = MOST_SIZES
) -> dict[str, RobotType | None]:
    """Read ``robot_types`` by name; None for a type with a problem, such as one too large for the cells of the map.

    `limits` are those on `marsupial.model.sizes`.
    """
    kinds: dict[str, RobotType | None] = {}
    parts = top.parts("robot_types")
    if top.data.get("robot_types") == []:
        top.wrong("robot_types", "must not be empty")
    if len(parts) > MOST_TYPES:
        top.wrong("robot_types", f"has {len(parts)} robot types, more than the limit of {MOST_TYPES}")
    for fields in parts[:MOST_TYPES]:  # a long list would cost time and report a problem each
        before = len(top.problems)
        kind = _read_type(fields, terrains)
        if fault := None if extent is None else radius_fault(kind.radius_m, extent, limits):
            fields.wrong("radius_m", fault)
        # PDDL ignores case, so names that differ only in case count as equal.
        if kind.name and kind.name.lower() in {name.lower() for name in kinds}:
            fields.wrong("name", f"{kind.name!r} is used twice")
        elif kind.name:
            kinds[kind.name] = kind if len(top.problems) == before else None
    _check_seats(parts, kinds)
    if extent is not None:
        for fault in ground_faults([kind for kind in kinds.values() if kind is not None], extent, limits):
            top.wrong("robot_types", fault)
    return kinds


def _check_seats(parts: Sequence[Fields], kinds: Mapping[str, RobotType | None]) -> None:
    """Check that seats are for rover types; a type with a problem counts as one."""
    rovers = [name for name, kind in kinds.items() if kind is None or kind.role is Role.ROVER]
    for fields in parts[:MOST_TYPES]:
        seats = fields.data.get("seats")
        for name in seats if isinstance(seats, Mapping) else ():
            if name in kinds and name not in rovers:
                fields.wrong(f"seats.{name}", f"{name!r} is a carrier, not a rover")
            elif name not in kinds:
                fields.wrong(f"seats.{name}", unknown("robot type", str(name), rovers))


def _read_type(fields: Fields, terrains: tuple[Terrain, ...]) -> RobotType:
    name = fields.name("name")
    role = fields.choice("role", list(Role))
    kind = RobotType(
        name=name,
        role=Role(role or Role.CARRIER),
        speed_mps=fields.quantity("speed_mps"),
        sensor_range_m=fields.quantity("sensor_range_m"),
        radius_m=fields.quantity("radius_m"),
        terrains=drivable(fields.texts("terrains"), terrains, fields),
        energy=_read_energy(fields),
        diagonal=fields.quantity("diagonal", SQRT2),
        routes=Routes(fields.choice("routes", list(Routes), Routes.SHORTEST) or Routes.SHORTEST),
        battery=_read_battery(fields) if fields.has("battery") else None,
        sensor_angle_deg=fields.quantity("sensor_angle_deg") if fields.has("sensor_angle_deg") else None,
        **_read_role_fields(fields, role),
    )
    if role and kind.battery_fault is not None:
        fields.wrong("battery", kind.battery_fault)
    if kind.speed_mps > 0 and kind.routes_fault is not None:
        fields.wrong("routes", kind.routes_fault)
    fields.finish(also=() if role else ("capacity", "seats", "dock_s", "undock_s", "radio_range_m"))
    return kind


def _read_role_fields(fields: Fields, role: str) -> dict[str, Any]:
    """Read the fields that only carriers or only rovers have; none if the role has a problem."""
    if not role:
        return {}
    if role == Role.CARRIER:
        for key in ("dock_s", "undock_s", "radio_range_m"):
            fields.refuse(key, "only rovers have it")
        capacity, seats = read_places(fields, None)
        return {"capacity": capacity, "seats": seats}
    for key in ("capacity", "seats"):
        fields.refuse(key, "only carriers have it")
    times = {key: fields.quantity(f"{key}_s") for key in ("dock", "undock")}
    radio_range_m = fields.quantity("radio_range_m") if fields.has("radio_range_m") else None
    return {f"{key}_ms": round(1000 * seconds) for key, seconds in times.items()} | {"radio_range_m": radio_range_m}


def drivable(names: Sequence[str], terrains: tuple[Terrain, ...], notes: Notes) -> frozenset[int]:
    """Return the codes of the terrains that a robot type drives on."""
    codes = {terrain.name: terrain.code for terrain in terrains}
    for i, name in enumerate(names):
        if name not in codes:
            notes.wrong(f"terrains[{i}]", unknown("terrain", name, codes))
        elif codes[name] == OBSTACLE:
            notes.wrong(f"terrains[{i}]", "no robot can drive on obstacles")
    return frozenset(codes[name] for name in names if name in codes)


def _read_energy(fields: Fields) -> EnergyModel:
    energy, default = fields.part("energy", required=False), EnergyModel()
    turns = energy.numbers("turn_j", 4, default.turn_j, BOUNDS["energy_j"]) or default.turn_j
    model = EnergyModel(
        idle_w=energy.quantity("idle_w", default.idle_w),
        drive_w=energy.quantity("drive_w", default.drive_w),
        metre_j=energy.quantity("metre_j", default.metre_j),
        stop_j=energy.quantity("stop_j", default.stop_j),
        turn_j=(turns[0], turns[1], turns[2], turns[3]),
    )
    energy.finish()
    return model


def _read_battery(fields: Fields) -> Battery:
    part = fields.part("battery")
    battery = Battery(capacity_j=part.quantity("capacity_j"), charge_w=part.quantity("charge_w", 0.0))
    part.finish()
    return battery


def read_goal(top: Fields) -> Goal:
    fields, default = top.part("goal", required=False), Goal()
    goal = Goal(
        recover_rovers=fields.flag("recover_rovers", default.recover_rovers),
        return_home=fields.flag("return_home", default.return_home),
        least_ground=fields.quantity("least_ground", default.least_ground),
    )
    fields.finish()
    return goal


def read_limits(top: Fields) -> MissionLimits:
    fields = top.part("limits", required=False)
    seconds = fields.quantity("time_s", MissionLimits().time_ms / 1000)
    coverage = fields.quantity("coverage", MissionLimits().coverage)
    fields.finish()
    return MissionLimits(time_ms=max(1, round(1000 * seconds)), coverage=coverage)
