"""Write a scenario file: whole or not at all, and so that reading it gives the same scenario.

The map is always written as rows of characters, so that the file needs no other file.
"""

import string
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from marsupial.errors import ScenarioError
from marsupial.formats.files import replace_file
from marsupial.formats.scenario.map import SYMBOLS
from marsupial.formats.scenario.read import FORMAT, VERSION
from marsupial.formats.scenario.team import DRAWN, numbered_team
from marsupial.model import SQRT2, TERRAINS, Grid, RobotType, Role, Routes, Scenario, TeamMember

# Characters for a scenario's own terrains, one for each code from 3 to 254.
_LETTERS = string.ascii_letters + string.digits + "".join(chr(code) for code in range(0xC0, 0x180))


class _FlowLine(list[Any]):
    """A list that is written on one line."""


class _Dumper(yaml.SafeDumper):
    """Writes `_FlowLine` lists on one line and everything else as blocks."""


_Dumper.add_representer(
    _FlowLine, lambda dumper, line: dumper.represent_sequence("tag:yaml.org,2002:seq", line, flow_style=True)
)


def write_scenario(scenario: Scenario, path: Path | str) -> None:
    """Write a scenario file; if that fails with a `ScenarioError`, an older file at `path` is unchanged."""
    path = Path(path)
    try:
        replace_file(path, scenario_text(scenario).encode())
    except OSError as error:
        raise ScenarioError(f"can't be written ({error.strerror})", source=str(path)) from error


def scenario_text(scenario: Scenario) -> str:
    fields: dict[str, Any] = {"format": FORMAT, "version": VERSION, "name": scenario.name}
    if own := terrain_fields(scenario.grid):
        fields["terrains"] = own
    names = {terrain.code: terrain.name for terrain in scenario.grid.terrains}
    fields["robot_types"] = [type_fields(kind, names) for kind in scenario.robot_types]
    fields["team"] = _team_fields(scenario)
    if scenario.start_seed is not None:
        fields["start_seed"] = scenario.start_seed
    goal = scenario.goal
    fields["goal"] = {"recover_rovers": goal.recover_rovers, "return_home": goal.return_home}
    fields["limits"] = {"time_s": scenario.limits.time_ms / 1000}
    fields["planning_time"] = str(scenario.planning_time)
    if scenario.interference:
        fields["interference"] = True
    fields["map"] = _map_fields(scenario.grid)
    return yaml.dump(fields, Dumper=_Dumper, sort_keys=False, allow_unicode=True, width=1_000_000)


def terrain_fields(grid: Grid) -> list[dict[str, Any]]:
    own = (terrain for terrain in grid.terrains if terrain.code >= len(TERRAINS))
    return [{"name": one.name, "code": one.code, "blocks_sight": one.blocks_sight} for one in own]


def _map_fields(grid: Grid) -> dict[str, Any]:
    own = {_LETTERS[one["code"] - len(TERRAINS)]: one for one in terrain_fields(grid)}
    characters = np.full(256, "", dtype="<U1")
    for symbol, code in (SYMBOLS | {symbol: one["code"] for symbol, one in own.items()}).items():
        characters[code] = symbol
    # A code without a terrain class has no character: its cells would be lost in the rows.
    nameless = np.setdiff1d(grid.cells, np.flatnonzero(characters))
    if nameless.size:
        raise ScenarioError(f"terrain code {nameless[0]} of the map has no name")
    fields: dict[str, Any] = {"resolution_m": float(grid.resolution_m)}
    fields["origin_m"] = _FlowLine(map(float, grid.origin_m))
    if own:
        fields["legend"] = {symbol: one["name"] for symbol, one in own.items()}
    return fields | {"rows": ["".join(characters[row]) for row in grid.cells[::-1]]}


def type_fields(kind: RobotType, terrain_names: dict[int, str]) -> dict[str, Any]:
    fields: dict[str, Any] = {
        "name": kind.name,
        "role": str(kind.role),
        "speed_mps": kind.speed_mps,
        "sensor_range_m": kind.sensor_range_m,
        "radius_m": kind.radius_m,
        "terrains": _FlowLine(terrain_names[code] for code in sorted(kind.terrains)),
    }
    if kind.role is Role.CARRIER:
        fields["capacity"] = kind.capacity
    else:
        fields |= {"dock_s": kind.dock_ms / 1000, "undock_s": kind.undock_ms / 1000}
    energy = kind.energy
    fields["energy"] = {"idle_w": energy.idle_w, "drive_w": energy.drive_w}
    # Energy of distance, stops and turns is left out where it is 0, as it is by default.
    fields["energy"] |= {key: value for key in ("metre_j", "stop_j") if (value := getattr(energy, key))}
    fields["energy"] |= {"turn_j": _FlowLine(energy.turn_j)} if any(energy.turn_j) else {}
    if kind.diagonal != SQRT2:
        fields["diagonal"] = kind.diagonal
    return fields if kind.routes is Routes.SHORTEST else fields | {"routes": str(kind.routes)}


def _team_fields(scenario: Scenario) -> dict[str, Any] | list[dict[str, Any]]:
    """Return the short form if it describes the same team, else the list of all robots."""
    first = {role: next((k for k in scenario.robot_types if k.role is role), None) for role in Role}
    carrier, rover = first[Role.CARRIER], first[Role.ROVER]
    if carrier is not None:
        carriers = sum(member.type == carrier.name for member in scenario.team)
        rovers = (len(scenario.team) - carriers) // max(1, carriers)
        if scenario.team == numbered_team(carrier, rover, carriers, rovers):
            return {"carriers": carriers, "rovers_per_carrier": rovers}
    return [_member_fields(member, scenario.grid) for member in scenario.team]


def _member_fields(member: TeamMember, grid: Grid) -> dict[str, Any]:
    fields: dict[str, Any] = {"name": member.name, "type": member.type}
    if member.carrier is not None:
        return fields | {"carrier": member.carrier}
    return fields | {"start": DRAWN if member.start is None else _FlowLine(grid.centre_m(member.start))}
