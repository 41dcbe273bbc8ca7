"""Requests for /v1/jobs to try the service with."""

from __future__ import annotations

import gzip
import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass
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


def _moment(name: str) -> Callable[[], dict[str, Any]]:
    def load() -> dict[str, Any]:
        data = (files("marsupial.bench.suite") / "moments" / f"{name}.json.gz").read_bytes()
        situation: dict[str, Any] = json.loads(gzip.decompress(data))
        return situation

    return load


def _tiny() -> dict[str, Any]:
    situation: dict[str, Any] = json.loads(situation_to_json(tiny()))
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
        robots=(
            RobotState(name="c", type="carrier", place="start"),
            RobotState(name="r", type="rover", carrier="c"),
        ),
        targets=(TargetInfo(name="target", explorers=frozenset({"rover"})),),
        meetings=("door",),
        travel_ms={"carrier": carrier, "rover": rover},
    )


def _yard() -> dict[str, Any]:
    state: dict[str, Any] = json.loads((files("marsupial_service.examples") / "yard.json").read_bytes())
    return state


DEMOS: Mapping[str, Demo] = {
    "tiny": Demo(kind="situation", summary="one carrier, one rover, one target behind a door", load=_tiny),
    "office-2x2": Demo(
        kind="situation",
        summary="2 carriers with 2 rovers each and 8 targets in an office",
        load=_moment("mission-office-2x2-8"),
    ),
    "office-6x3": Demo(
        kind="situation",
        summary="6 carriers with 3 rovers each and 18 targets in an office",
        load=_moment("mission-office-6x3-18"),
    ),
    "yard": Demo(kind="map_state", summary="a yard with rough ground and mud that only rovers cross", load=_yard),
}
