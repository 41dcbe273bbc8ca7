"""How briefs and inputs are stored: as JSON without class names, so that renaming a class breaks no stored mission.

A brief is two lines: the first line of the mission's log (`marsupial.formats.loglines`), and the remaining fields. An
input is one object. Empty fields of a report are left out, and a robot is a list, as robots in reports take most of
the space:

    {"n":7,"t_ms":900,"revealed":[["rover1",[812,3,1]]],"robots":[["rover1",[12,7],1500,3.25,900]],"finished":[4]}
    {"control":"pause"}
    {"name":"lab","zone":{"name":"lab","kind":"no_go","polygon_m":[[0,0],[4,0],[4,3]]}}

Cells are runs (`marsupial.model.runs`). The version of the tables (`marsupial_service.store.tables`) also covers these
texts. A process that takes over a mission must produce the same events as its predecessor, so both must start from
bit-identical briefs. Therefore every process, even the first, reads its brief from the stored text.
"""

import json
from dataclasses import astuple
from typing import Any

import numpy as np
from pydantic_core import from_json, to_json

from marsupial.formats.loglines import LogDecoder, LogEncoder
from marsupial.formats.scenario.zones import zone_fields, zone_in
from marsupial.model.grid import UNKNOWN, Cell, Grid
from marsupial.model.mission import MissionStarted
from marsupial.model.missionframe import MissionFrame
from marsupial.model.planning import Budget
from marsupial.model.runs import drawn, known_runs
from marsupial.model.scenario import MissionLimits, PlanningTime
from marsupial.model.zones import DatedZone, ZoneChange
from marsupial_service.entries.documents import line
from marsupial_service.missions.values import Control, Input, MissionBrief, MissionReport, RobotSimulation, RobotUpdate

# fields of a report that are stored unchanged unless empty
_PAIRS = ("failed", "declined", "lost", "out_of_contact")
_OMITTED_IF_EMPTY = ("revealed", "finished", *_PAIRS, "expected", "returned", "in_contact", "robot")


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
    (started,) = LogDecoder().events(first)
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
    if isinstance(data, Control):
        return to_json({"control": data})
    if isinstance(data, ZoneChange):
        zone = None if data.zone is None else zone_fields(DatedZone(name=data.name, zone=data.zone))
        return to_json({"name": data.name, "zone": zone})
    fields: dict[str, object] = {"n": data.n, "t_ms": data.t_ms}
    fields |= {name: value for name in _OMITTED_IF_EMPTY if (value := getattr(data, name))}
    if data.robots:
        fields["robots"] = [_robot_fields(one) for one in data.robots]
    if data.frame is not None:
        fields["frame"] = astuple(data.frame)
    if data.map is not None:
        fields["map"] = (data.map.shape, known_runs(data.map))
    return to_json(fields)


def _robot_fields(update: RobotUpdate) -> tuple[object, ...]:
    """Return the update of a robot as a list, without speed and charge if not given: most reports have none."""
    given = (update.speed_share is not None) + (update.charge is not None) * 2
    more = (update.speed_share, update.charge)[:given]
    return (update.name, update.cell, update.free_at_ms, update.distance_m, update.driving_ms, *more)


def decode_input(text: bytes) -> Input:
    fields = from_json(text)
    if "control" in fields:
        return Control(fields["control"])
    if "zone" in fields:
        zone = fields["zone"]
        return ZoneChange(name=fields["name"], zone=None if zone is None else zone_in(zone).zone)
    frame, cells = fields.get("frame"), fields.get("map")
    return MissionReport(
        n=fields["n"],
        t_ms=fields["t_ms"],
        revealed=tuple((robot, tuple(runs)) for robot, runs in fields.get("revealed", ())),
        map=None if cells is None else drawn(cells[1], tuple(cells[0])),
        robots=tuple(
            RobotUpdate(
                name=name,
                cell=None if cell is None else Cell._make(cell),
                free_at_ms=free_at_ms,
                distance_m=distance_m,
                driving_ms=driving_ms,
                speed_share=more[0] if more else None,
                charge=more[1] if len(more) > 1 else None,
            )
            for name, cell, free_at_ms, distance_m, driving_ms, *more in fields.get("robots", ())
        ),
        finished=tuple(fields.get("finished", ())),
        **{name: tuple(map(tuple, fields.get(name, ()))) for name in _PAIRS},
        expected=tuple(fields.get("expected", ())),
        returned=tuple(fields.get("returned", ())),
        in_contact=tuple(fields.get("in_contact", ())),
        robot=fields.get("robot"),
        frame=None if frame is None else MissionFrame(*frame),
    )
