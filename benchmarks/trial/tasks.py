"""Requests to the tested servers, and the client's check of their plans."""

from __future__ import annotations

import json
from collections.abc import Mapping
from functools import cache
from typing import Any

from benchmarks.floors import Floor
from marsupial.bench.suite.catalogue import INSTANCES
from marsupial.formats.situation import situation_from_json, situation_in, situation_to_json
from marsupial.model.objective import MAKESPAN, Value
from marsupial.model.situation import Situation
from marsupial.planning.checker import check
from marsupial_service.entries.documents import plan_of
from marsupial_service.examples.demos import DEMOS

LARGEST = ("rooms-6x3-20", "two-doors-6x3-20", "homes-6x3-20", "in-flight-6x3-20")
"""The paper's largest team with 20 targets, on four kinds of floor."""


def body(situation: Situation, planner: str, seconds: float) -> bytes:
    """Return the body of a request with a situation."""
    fields = {"planner": planner, "budget": {"seconds": seconds}}
    return _body({**fields, "situation": json.loads(situation_to_json(situation))})


def tiny() -> Situation:
    """Return the smallest demo."""
    return situation_in(DEMOS["tiny"].load())


def suite_body(name: str, planner: str, seconds: float) -> bytes:
    """Return the body of a request with an instance of the planner suite."""
    return body(suite_situation(name), planner, seconds)


@cache
def suite_situation(name: str) -> Situation:
    """Return an instance of the planner suite."""
    return INSTANCES[name].situation()


@cache
def small_floor(seed: int) -> Situation:
    """Return a small situation that is different for each seed, and whose plans get better for some time."""
    return Floor(seed=seed, carriers=2, rovers=2, targets=8, rooms=4).situation()


@cache
def short_jobs() -> tuple[bytes, ...]:
    """Return bodies of short requests: one plan, many plans, a proof, an analysis of a map."""
    yard = {**DEMOS["yard"].request(), "budget": {"seconds": 0.2}}
    return (
        body(tiny(), "greedy", 5.0),
        body(small_floor(1), "anytime", 0.2),
        body(small_floor(2), "anytime", 0.2),
        body(tiny(), "exact", 0.2),
        _body(yard),
    )


def _body(fields: Mapping[str, Any]) -> bytes:
    return json.dumps(fields).encode()


def scored(situation: Situation, actions: Any) -> Value | None:
    """Return the score of a plan in the service's JSON, or None if the checker refuses it."""
    plan = plan_of(actions)
    return MAKESPAN.value(situation, plan) if check(situation, plan).valid else None


def read_situation(document: object) -> Situation:
    """Return the situation in a document of the service."""
    return situation_from_json(json.dumps(document))
