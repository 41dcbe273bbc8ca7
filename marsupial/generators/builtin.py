"""The built-in scenarios: fixed maps with the team of the paper's experiments, and maps of a kind drawn by a seed.

A built-in map never changes: its generator, size and seed are constants here; the mission's seed draws only the starts.
``office-7`` is the map that the office's generator draws by seed 7. In the same way ``comb-7`` is a map of the kind
``comb`` of `FOOTPRINT_MAPS`, with the default robots of a bare map.
Carriers are twice as fast as rovers and see twice as far, as in the paper's section IV-C.

References: Wurm et al. 2010, section IV-C (see `marsupial.papers.wurm2010`).
"""

import re
from collections.abc import Mapping
from dataclasses import dataclass, field, replace

from marsupial.errors import Problem, ScenarioError
from marsupial.generators import GENERATORS
from marsupial.generators.footprint import FOOTPRINT_MAPS, footprint_map
from marsupial.model import FLOOR, ROUGH, Goal, Grid, RobotType, Scenario, TeamMember
from marsupial.model.bounds import BOUNDS, team_fault
from marsupial.model.robots import default_types, uniform_team
from marsupial.model.sizes import MOST, Extent, ground_faults, radius_fault

DEFAULT_CARRIERS, DEFAULT_ROVERS = 2, 2
RESOLUTION_M = 0.25
CARRIER_RADIUS_M, ROVER_RADIUS_M = 0.3, 0.1
ROUGH_ONLY = frozenset({ROUGH})
EVERYWHERE = frozenset({FLOOR, ROUGH})


@dataclass(frozen=True, slots=True, kw_only=True)
class BuiltIn:
    """A built-in scenario: a generated map and the terrains that its rovers can drive on."""

    summary: str
    width_m: float
    height_m: float
    seed: int = 1
    rover_terrains: frozenset[int] = EVERYWHERE
    options: Mapping[str, float] = field(default_factory=dict)  # the generator's options


SCENARIOS: dict[str, BuiltIn] = {
    "office": BuiltIn(
        summary="the paper's office: two corridors, rooms, half of them for rovers only",
        width_m=60.0, height_m=36.0, seed=3, rover_terrains=ROUGH_ONLY,
    ),
    "maze": BuiltIn(
        summary="the paper's maze: a centre for rovers only with several meeting points",
        width_m=50.0, height_m=50.0, rover_terrains=ROUGH_ONLY,
    ),
    "rooms": BuiltIn(
        summary="rooms without corridors, some behind doors too narrow for carriers", width_m=40.0, height_m=30.0
    ),
    "random": BuiltIn(
        summary="open ground strewn with boxes, gaps too narrow for carriers",
        width_m=40.0, height_m=40.0, options={"share": 0.25},
    ),
    "cave": BuiltIn(summary="winding halls with patches of rough ground for rovers", width_m=50.0, height_m=40.0),
    "lobby": BuiltIn(
        summary="a hall with four rooms, three of them for rovers only: for quick tries",
        width_m=14.0, height_m=11.0, seed=3, rover_terrains=ROUGH_ONLY,
    ),
}  # fmt: skip
"""By the name of their generator."""


def is_builtin(name: str) -> bool:
    return name in SCENARIOS or _drawn(name) is not None


def _drawn(name: str) -> tuple[str, int] | None:
    """Return the kind and the seed of a map with a name like ``office-7``; None if it is no such name."""
    kind, _, seed = name.rpartition("-")
    if not re.fullmatch(r"\d{1,9}", seed, re.ASCII) or (kind not in SCENARIOS and kind not in FOOTPRINT_MAPS):
        return None
    return kind, int(seed)


def builtin_scenario(name: str, carriers: int = DEFAULT_CARRIERS, rovers: int = DEFAULT_ROVERS) -> Scenario:
    """Return the built-in scenario `name`, or that of a drawn map, with a team of `carriers`, each with `rovers`."""
    if not is_builtin(name):
        raise ScenarioError(f"unknown scenario {name!r}; built in: {', '.join(SCENARIOS)}")
    check_team_size(carriers, rovers)
    kind, seed = _drawn(name) or (name, SCENARIOS[name].seed)
    if kind in FOOTPRINT_MAPS:
        return bare_map_scenario(name, footprint_map(kind, seed), carriers, rovers)
    entry = SCENARIOS[kind]
    size = {"width_m": entry.width_m, "height_m": entry.height_m, "resolution_m": RESOLUTION_M}
    grid = GENERATORS[kind].make(**size, seed=seed, **entry.options)
    carrier, rover = default_types(max(1, rovers))
    carrier = replace(carrier, radius_m=CARRIER_RADIUS_M)
    rover = replace(rover, radius_m=ROVER_RADIUS_M, terrains=entry.rover_terrains)
    return Scenario(name=name, grid=grid, robot_types=(carrier, rover), team=uniform_team(carriers, rovers))


def bare_map_scenario(
    name: str,
    grid: Grid,
    carriers: int = DEFAULT_CARRIERS,
    rovers: int = DEFAULT_ROVERS,
    most: Mapping[str, float] = MOST,
) -> Scenario:
    """Return the default robot types and team on a map without a scenario file, within the limits `most`."""
    check_team_size(carriers, rovers)
    kinds = default_types(max(1, rovers))
    extent = Extent(grid.cells.size, grid.resolution_m)
    faults = [fault for kind in kinds if (fault := radius_fault(kind.radius_m, extent, most))]
    faults += ground_faults(kinds, extent, most)
    if faults:
        raise ScenarioError([Problem("resolution_m", f"the default robots are too large: {faults[0]}")])
    return Scenario(name=name, grid=grid, robot_types=kinds, team=uniform_team(carriers, rovers))


def explorers(name: str, grid: Grid, kind: RobotType, robots: int) -> Scenario:
    """Return the scenario of that many robots of one type on a map, their starts drawn by the mission's seed."""
    team = tuple(TeamMember(name=f"{kind.name}{i}", type=kind.name) for i in range(1, robots + 1))
    return Scenario(name=name, grid=grid, robot_types=(kind,), team=team, goal=Goal(recover_rovers=False))


def check_team_size(carriers: int, rovers: int) -> None:
    """Raise a `ScenarioError` unless these numbers of carriers and of rovers per carrier are within bounds."""
    faults = {"carriers": BOUNDS["carriers"].fault(carriers), "rovers": BOUNDS["rovers_per_carrier"].fault(rovers)}
    if not any(faults.values()):
        faults["carriers"] = team_fault(carriers * (1 + rovers))
    if problems := [Problem(field, fault) for field, fault in faults.items() if fault is not None]:
        raise ScenarioError(problems)
