"""Bodies that the OpenAPI document gives as examples; each is taken as it is."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from marsupial_service.examples.demos import DEMOS

_CARRIER = {
    "name": "carrier",
    "role": "carrier",
    "speed_mps": 1.0,
    "sensor_range_m": 3.0,
    "radius_m": 0.2,
    "terrains": ["floor"],
    "capacity": 1,
}


def job() -> dict[str, Any]:
    """Return the request for a small job."""
    return {**DEMOS["tiny"].request(), "budget": {"seconds": 0.2}}


def analysis() -> dict[str, Any]:
    """Return the request for the analysis of a small map."""
    return {"map_state": DEMOS["yard"].request()["map_state"]}


def validation() -> dict[str, Any]:
    """Return the request to validate a plan that does nothing."""
    return {"situation": DEMOS["tiny"].request()["situation"], "plan": {"actions": []}}


def mission() -> dict[str, Any]:
    """Return the request for a mission of one carrier on a small map, of which nothing is known."""
    return {
        "name": "closet",
        "frame": {"width": 8, "height": 6, "resolution_m": 0.5},
        "robot_types": [_CARRIER],
        "team": [{"name": "mother", "type": "carrier", "cell": [2, 2]}],
        "strategy": "temporal",
        "planner": "greedy",
        "budget": {"steps": 1},
    }


def report() -> dict[str, Any]:
    """Return the first report of such a mission: what is seen at the start."""
    return {"n": 1, "t_ms": 0, "revealed": [{"robot": "mother", "runs": [9, 4, 1, 17, 4, 1]}]}


def simulation() -> dict[str, Any]:
    """Return the request for a mission in the smallest scenario, a hundred times as fast as it would be."""
    return {"scenario": "lobby", "carriers": 1, "rovers": 1, "planner": "greedy", "budget": {"steps": 1}, "speed": 100}


EXAMPLES: Mapping[str, Callable[[], dict[str, Any]]] = {
    "/v1/jobs": job,
    "/v1/analysis": analysis,
    "/v1/validations": validation,
    "/v1/missions": mission,
    "/v1/simulations": simulation,
    "/v1/missions/{mission}/reports": report,
}
