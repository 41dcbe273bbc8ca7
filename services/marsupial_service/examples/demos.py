"""Requests for /v1/jobs to try the service with, and the bodies that the OpenAPI document gives as examples."""

import gzip
import json
from collections.abc import Callable, Mapping
from copy import deepcopy
from dataclasses import dataclass
from functools import partial
from importlib.resources import files
from typing import Any, Literal

import numpy as np

from marsupial.formats.situation import situation_to_json
from marsupial.model.robots import Role
from marsupial.model.situation import UNREACHABLE, PlanningType, RobotState, Situation, TargetInfo

BUDGET_S = 2.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Demo:
    """A request; `kind` is the field that holds what is asked."""

    kind: Literal["situation", "map_state"]
    summary: str
    load: Callable[[], dict[str, Any]]

    def request(self) -> dict[str, Any]:
        """Return the body of a request."""
        return {"planner": "auto", "budget": {"seconds": BUDGET_S}, self.kind: self.load()}


def _map_state(name: str) -> dict[str, Any]:
    data = (files("marsupial.bench.suite") / "moments" / f"{name}.json.gz").read_bytes()
    situation: dict[str, Any] = json.loads(gzip.decompress(data))
    return situation


def tiny() -> Situation:
    """Return: a carrier with a rover aboard, a door 1 s away, and a target behind it that only the rover reaches."""
    carrier = np.array([[0, UNREACHABLE, 1000], [UNREACHABLE] * 3, [1000, UNREACHABLE, 0]])
    rover = np.array([[UNREACHABLE] * 3, [UNREACHABLE, 0, 1000], [UNREACHABLE, 1000, 0]])
    return Situation(
        types=(
            PlanningType(name="carrier", role=Role.CARRIER, capacity=1),
            PlanningType(name="rover", role=Role.ROVER, dock_ms=1000, undock_ms=1000),
        ),
        robots=(RobotState(name="c", type="carrier", place="start"), RobotState(name="r", type="rover", carrier="c")),
        targets=(TargetInfo(name="target", explorers=frozenset({"rover"})),),
        meetings=("door",),
        travel_ms={"carrier": carrier, "rover": rover},
    )


DEMOS: Mapping[str, Demo] = {
    "tiny": Demo(
        kind="situation",
        summary="one carrier, one rover, one target behind a door",
        load=lambda: json.loads(situation_to_json(tiny())),
    ),
    "office-2x2": Demo(
        kind="situation",
        summary="2 carriers with 2 rovers each and 8 targets in an office",
        load=partial(_map_state, "mission-office-2x2-8"),
    ),
    "office-6x3": Demo(
        kind="situation",
        summary="6 carriers with 3 rovers each and 18 targets in an office",
        load=partial(_map_state, "mission-office-6x3-18"),
    ),
    "yard": Demo(
        kind="map_state",
        summary="a yard with rough ground and mud that only rovers cross",
        load=lambda: json.loads((files("marsupial_service.examples") / "yard.json").read_bytes()),
    ),
}

_CARRIER = {
    "name": "carrier",
    "role": "carrier",
    "speed_mps": 1.0,
    "sensor_range_m": 3.0,
    "radius_m": 0.2,
    "terrains": ["floor"],
    "capacity": 1,
}


_MISSION = {
    "name": "closet",
    "frame": {"width": 8, "height": 6, "resolution_m": 0.5},
    "robot_types": [_CARRIER],
    "team": [{"name": "mother", "type": "carrier", "cell": [2, 2]}],
    "strategy": "temporal",
    "planner": "greedy",
    "budget": {"steps": 1},
}

_SIMULATION = {
    "scenario": "lobby",
    "carriers": 1,
    "rovers": 1,
    "planner": "greedy",
    "budget": {"steps": 1},
    "speed": 100,
}

EXAMPLES: Mapping[str, Callable[[], dict[str, Any]]] = {
    "/v1/jobs": lambda: {**DEMOS["tiny"].request(), "budget": {"seconds": 0.2}},
    "/v1/analysis": lambda: {"map_state": DEMOS["yard"].load()},
    "/v1/validations": lambda: {"situation": DEMOS["tiny"].load(), "plan": {"actions": []}},
    "/v1/missions": lambda: deepcopy(_MISSION),
    "/v1/simulations": lambda: deepcopy(_SIMULATION),
    "/v1/missions/{mission}/reports": lambda: {
        "n": 1,
        "t_ms": 0,
        "revealed": [{"robot": "mother", "runs": [9, 4, 1, 17, 4, 1]}],
    },
}
"""The body of a small request for each route that takes one, made anew for each caller."""
