"""How briefs and inputs are stored: as JSON without class names, so that renaming a class breaks no stored mission.

A brief is two lines: the first line of the mission's log (`marsupial.formats.loglines`), and what pydantic makes of the
remaining fields. An input is what pydantic makes of `values.Input`, without fields that have their default:

    {"n":7,"t_ms":900,"revealed":[{"robot":"r1","runs":[812,3,1]}],"robots":[{"name":"r1","cell":[12,7]}]}
    "pause"
    {"name":"lab","zone":{"kind":"no_go","polygon_m":[[0.0,0.0],[4.0,0.0],[4.0,3.0]]}}

Cells are runs (`marsupial.model.runs`). The version of the tables (`marsupial_service.store.tables`) also covers these
texts. A process that takes over a mission must produce the same events as its predecessor, so both must start from
bit-identical briefs. Therefore every process, even the first, reads its brief from the stored text.
"""

from dataclasses import dataclass

import numpy as np
from pydantic import TypeAdapter

from marsupial.formats.loglines import LogDecoder, LogEncoder
from marsupial.model.grid import UNKNOWN, Grid
from marsupial.model.mission import MissionStarted
from marsupial.model.planning import Budget
from marsupial.model.runs import Runs, drawn, known_runs
from marsupial.model.scenario import MissionLimits, PlanningTime
from marsupial.model.zones import DatedZone
from marsupial_service.missions.values import Input, MissionBrief, RobotSimulation


@dataclass(frozen=True, slots=True, kw_only=True)
class _RestOfBrief:
    """What the first line of the log does not say."""

    budget: Budget
    known: Runs
    limits: MissionLimits
    planning_time: PlanningTime
    area: Runs | None
    simulation: RobotSimulation | None
    zones: tuple[DatedZone, ...]
    map_may_grow: bool


_INPUTS: TypeAdapter[Input] = TypeAdapter(Input)
_RESTS = TypeAdapter(_RestOfBrief)


def encode_brief(brief: MissionBrief) -> bytes:
    area = None if brief.reachable is None else np.where(brief.reachable, np.uint8(1), np.uint8(UNKNOWN))
    rest = _RestOfBrief(
        budget=brief.budget,
        known=known_runs(brief.grid.cells),
        limits=brief.limits,
        planning_time=brief.planning_time,
        area=None if area is None else known_runs(area),
        simulation=brief.simulation,
        zones=brief.zones,
        map_may_grow=brief.map_may_grow,
    )
    return f"{LogEncoder().line(brief.started)}\n".encode() + _RESTS.dump_json(rest)


def decode_brief(text: bytes) -> MissionBrief:
    first, more = text.split(b"\n")
    started = LogDecoder().event(first.decode())
    assert isinstance(started, MissionStarted)
    rest = _RESTS.validate_json(more)
    shape = (started.height, started.width)
    return MissionBrief(
        name=started.scenario,
        strategy=started.strategy,
        planner=started.planner,
        budget=rest.budget,
        seed=started.seed,
        grid=Grid(
            cells=drawn(rest.known, shape),
            resolution_m=started.resolution_m,
            origin_m=started.origin_m,
            terrains=started.terrains,
            chargers=started.chargers,
        ),
        kinds=started.types,
        robots=started.robots,
        goal=started.goal,
        limits=rest.limits,
        planning_time=rest.planning_time,
        reachable=None if rest.area is None else drawn(rest.area, shape) != UNKNOWN,
        simulation=rest.simulation,
        zones=rest.zones,
        map_may_grow=rest.map_may_grow,
    )


def encode_input(data: Input) -> bytes:
    return _INPUTS.dump_json(data, exclude_defaults=True)


def decode_input(text: bytes) -> Input:
    return _INPUTS.validate_json(text)
