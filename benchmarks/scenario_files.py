"""Scenarios as files: reading one gives the same scenario. The product only reads them; tests and fuzzers write them.

The map is always written as rows of characters, so that the file needs no other file.
"""

import string
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from marsupial.errors import ScenarioError
from marsupial.formats.scenario.map import SYMBOLS
from marsupial.formats.scenario.read import FORMAT, VERSION
from marsupial.formats.scenario.team import DRAWN
from marsupial.formats.scenario.write import terrain_fields, type_fields
from marsupial.model import TERRAINS, Fault, FaultKind, Grid, Scenario, TeamMember
from marsupial.model.faults import FROM_START

# Characters for a scenario's own terrains, one for each code from 3 to 254.
_LETTERS = string.ascii_letters + string.digits + "".join(chr(code) for code in range(0xC0, 0x180))


def write_scenario(scenario: Scenario, path: Path | str) -> None:
    """Write a scenario file."""
    Path(path).write_text(scenario_text(scenario), encoding="utf-8")


def scenario_text(scenario: Scenario) -> str:
    """Return the content of a scenario file."""
    names = {terrain.code: terrain.name for terrain in scenario.grid.terrains}
    fields: dict[str, Any] = {
        "format": FORMAT,
        "version": VERSION,
        "name": scenario.name,
        "terrains": terrain_fields(scenario.grid),
        "robot_types": [type_fields(kind, names) for kind in scenario.robot_types],
        "team": [_member_fields(member, scenario.grid) for member in scenario.team],
        "goal": {"recover_rovers": scenario.goal.recover_rovers, "return_home": scenario.goal.return_home},
        "limits": {"time_s": scenario.limits.time_ms / 1000, "coverage": scenario.limits.coverage},
        "planning_time": str(scenario.planning_time),
        "interference": scenario.interference,
        "map": _map_fields(scenario.grid),
    }
    if scenario.faults:
        fields["faults"] = [_fault_fields(fault, scenario.grid, names) for fault in scenario.faults]
    if scenario.start_seed is not None:
        fields["start_seed"] = scenario.start_seed
    return yaml.safe_dump(fields, sort_keys=False, allow_unicode=True, width=1_000_000)


def _fault_fields(fault: Fault, grid: Grid, names: dict[int, str]) -> dict[str, Any]:
    fields: dict[str, Any] = {"fault": str(fault.kind)}
    plain = {"robot": fault.robot, "rate_per_h": fault.rate_per_h, "role": fault.role and str(fault.role)}
    fields |= {key: value for key, value in plain.items() if value is not None}
    if not fault.reported:
        fields["reported"] = False
    if fault.at_ms is not None:
        fields["at_s"] = fault.at_ms / 1000
    if fault.seen is not None:
        fields["seen_m"] = list(grid.centre_m(fault.seen))
    if fault.rate_per_h is not None or fault.kind in FROM_START:
        fields["seed"] = fault.seed
    if fault.area is not None:
        low, high = map(grid.centre_m, fault.area)
        fields |= {"area_m": [*low, *high], "terrain": names[fault.terrain]}
    further = {FaultKind.SLOWS: ("speed_share", fault.share), FaultKind.MISSED_CELLS: ("share", fault.share)}
    further |= {FaultKind.POSITION_NOISE: ("share", fault.share), FaultKind.STUCK: ("for_s", fault.for_ms / 1000)}
    return fields | dict([further[fault.kind]] if fault.kind in further else [])


def _map_fields(grid: Grid) -> dict[str, Any]:
    own = {_LETTERS[one["code"] - len(TERRAINS)]: one for one in terrain_fields(grid)}
    characters = np.full(256, "", dtype="<U1")
    for symbol, code in (SYMBOLS | {symbol: one["code"] for symbol, one in own.items()}).items():
        characters[code] = symbol
    # A code without a terrain class has no character: its cells would be lost in the rows.
    nameless = np.setdiff1d(grid.cells, np.flatnonzero(characters))
    if nameless.size:
        raise ScenarioError(f"terrain code {nameless[0]} of the map has no name")
    fields: dict[str, Any] = {"resolution_m": float(grid.resolution_m), "origin_m": list(map(float, grid.origin_m))}
    if own:
        fields["legend"] = {symbol: one["name"] for symbol, one in own.items()}
    return fields | {"rows": ["".join(characters[row]) for row in grid.cells[::-1]]}


def _member_fields(member: TeamMember, grid: Grid) -> dict[str, Any]:
    fields: dict[str, Any] = {"name": member.name, "type": member.type}
    if member.carrier is not None:
        return fields | {"carrier": member.carrier}
    return fields | {"start": DRAWN if member.start is None else list(grid.centre_m(member.start))}
