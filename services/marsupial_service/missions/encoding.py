"""How briefs and inputs are stored: as JSON without class names, so that renaming a class breaks no stored mission.

A brief is two lines: the first line of the mission's log (`marsupial.formats.loglines`), and the remaining fields. An
input is what pydantic makes of `values.Input`, without fields that have their default:

    {"n":7,"t_ms":900,"revealed":[{"robot":"r1","runs":[812,3,1]}],"robots":[{"name":"r1","cell":[12,7]}]}
    "pause"
    {"name":"lab","zone":{"kind":"no_go","polygon_m":[[0.0,0.0],[4.0,0.0],[4.0,3.0]]}}

Cells are runs (`marsupial.model.runs`). The version of the tables (`marsupial_service.store.tables`) also covers these
texts. A process that takes over a mission must produce the same events as its predecessor, so both must start from
bit-identical briefs. Therefore every process, even the first, reads its brief from the stored text.
"""

import json
from typing import Any

import numpy as np
from pydantic import TypeAdapter

from marsupial.formats.loglines import LogDecoder, LogEncoder
from marsupial.formats.scenario.zones import zone_fields, zone_in
from marsupial.model.grid import UNKNOWN, Grid
from marsupial.model.mission import MissionStarted
from marsupial.model.planning import Budget
from marsupial.model.runs import drawn, known_runs
from marsupial.model.scenario import MissionLimits, PlanningTime
from marsupial_service.entries.documents import line
from marsupial_service.missions.values import Input, MissionBrief, RobotSimulation

_INPUTS: TypeAdapter[Input] = TypeAdapter(Input)


def encode_brief(brief: MissionBrief) -> bytes:
    area = None if brief.reachable is None else np.where(brief.reachable, np.uint8(1), np.uint8(UNKNOWN))
    simulation = brief.simulation and {
        "truth": known_runs(brief.simulation.truth),
        "speed": brief.simulation.speed,
        "warnings": brief.simulation.warnings,
        **({"faults": brief.simulation.faults} if brief.simulation.faults else {}),
    }
    more: dict[str, Any] = {
        "seconds": brief.budget.seconds,
        "steps": brief.budget.steps,
        "known": known_runs(brief.grid.cells),
        "time_ms": brief.limits.time_ms,
        "planning_time": brief.planning_time,
        "area": None if area is None else known_runs(area),
        "simulation": simulation,
    }
    if brief.limits.coverage < 1:
        more["coverage"] = brief.limits.coverage
    if brief.map_may_grow:
        more["map_may_grow"] = True
    if brief.zones:
        more["zones"] = list(map(zone_fields, brief.zones))
    return f"{LogEncoder().line(brief.started)}\n{line(more)}".encode()


def decode_brief(text: bytes) -> MissionBrief:
    first, more_text = text.decode().split("\n")
    started = LogDecoder().event(first)
    assert isinstance(started, MissionStarted)
    more: dict[str, Any] = json.loads(more_text)
    shape, simulation = (started.height, started.width), more["simulation"]
    return MissionBrief(
        name=started.scenario,
        strategy=started.strategy,
        planner=started.planner,
        budget=Budget(seconds=more["seconds"], steps=more["steps"]),
        seed=started.seed,
        grid=Grid(
            cells=drawn(more["known"], shape),
            resolution_m=started.resolution_m,
            origin_m=started.origin_m,
            terrains=started.terrains,
            chargers=started.chargers,
        ),
        kinds=started.types,
        robots=started.robots,
        goal=started.goal,
        limits=MissionLimits(time_ms=more["time_ms"], coverage=more.get("coverage", 1.0)),
        planning_time=PlanningTime(more["planning_time"]),
        reachable=None if more["area"] is None else drawn(more["area"], shape) != UNKNOWN,
        simulation=simulation
        and RobotSimulation(
            truth=drawn(simulation["truth"], shape),
            speed=simulation["speed"],
            warnings=tuple(simulation["warnings"]),
            faults=tuple(simulation.get("faults", ())),
        ),
        zones=tuple(map(zone_in, more.get("zones", ()))),
        map_may_grow=more.get("map_may_grow", False),
    )


def encode_input(data: Input) -> bytes:
    return _INPUTS.dump_json(data, exclude_defaults=True)


def decode_input(text: bytes) -> Input:
    return _INPUTS.validate_json(text)
