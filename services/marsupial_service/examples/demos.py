"""Requests for /v1/jobs to try the service with, and the bodies that the OpenAPI document gives as examples."""

import gzip
import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from importlib.resources import files
from typing import Any, Literal, cast

BUDGET_S = 2.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Demo:
    """A request; `kind` is the field that holds what is asked."""

    kind: Literal["situation", "map_state"]
    summary: str
    load: Callable[[], dict[str, Any]]

    def request(self) -> dict[str, Any]:
        return {"planner": "auto", "budget": {"seconds": BUDGET_S}, self.kind: self.load()}


def _example(name: str) -> dict[str, Any]:
    return cast(dict[str, Any], json.loads((files("marsupial_service.examples") / f"{name}.json").read_bytes()))


def _moment(name: str) -> dict[str, Any]:
    data = (files("marsupial.bench.suite") / "moments" / f"{name}.json.gz").read_bytes()
    return cast(dict[str, Any], json.loads(gzip.decompress(data)))


DEMOS: Mapping[str, Demo] = {
    "tiny": Demo(
        kind="situation",
        summary="one carrier, one rover, one target behind a door",
        load=partial(_example, "tiny"),
    ),
    "office-2x2": Demo(
        kind="situation",
        summary="2 carriers with 2 rovers each and 8 targets in an office",
        load=partial(_moment, "mission-office-2x2-8"),
    ),
    "office-6x3": Demo(
        kind="situation",
        summary="6 carriers with 3 rovers each and 18 targets in an office",
        load=partial(_moment, "mission-office-6x3-18"),
    ),
    "yard": Demo(
        kind="map_state",
        summary="a yard with rough ground and mud that only rovers cross",
        load=partial(_example, "yard"),
    ),
}

EXAMPLES: Mapping[str, Callable[[], dict[str, Any]]] = {
    "/v1/jobs": lambda: {**DEMOS["tiny"].request(), "budget": {"seconds": 0.2}},
    "/v1/analysis": lambda: {"map_state": DEMOS["yard"].load()},
    "/v1/validations": lambda: {"situation": DEMOS["tiny"].load(), "plan": {"actions": []}},
    "/v1/missions": partial(_example, "mission"),
    "/v1/simulations": partial(_example, "simulation"),
    "/v1/missions/{mission}/reports": lambda: {
        "n": 1,
        "t_ms": 0,
        "revealed": [{"robot": "mother", "runs": [9, 4, 1, 17, 4, 1]}],
    },
}
"""The body of a small request for each route that takes one, made anew for each caller."""
