"""What needs no job: analyses of maps, and verdicts on plans."""

from __future__ import annotations

import asyncio
from collections.abc import Mapping
from typing import Any

from fastapi import APIRouter, Response

from marsupial.errors import InputError
from marsupial.planning.checker import check
from marsupial_service.analysis import INCLUDE
from marsupial_service.answers import json_answer, verdict_document
from marsupial_service.entries.records import TooMany
from marsupial_service.intake import read_plan, read_situation, refusing
from marsupial_service.intake_map import read_map_state
from marsupial_service.openapi import errors
from marsupial_service.routes.parameters import Json, Service
from marsupial_service.routing import PlanRoute
from marsupial_service.schemas import answers
from marsupial_service.schemas.requests import AnalysisBody, ValidationBody
from marsupial_service.settings import Limits
from marsupial_service.supervised import value_of

router = APIRouter(prefix="/v1", route_class=PlanRoute, tags=["analysis"])


@router.post("/analysis", response_model=answers.Analysis, responses=errors("too-many", body=True))
async def analyse(state: Service, sent: Json, body: AnalysisBody) -> Response:
    """Find targets, meeting points, reach and costs on a map, as GeoJSON in metres of the map frame."""
    limits = state.settings.limits
    task = await asyncio.to_thread(read_map_state, sent, limits)
    if state.analyses.locked():
        raise TooMany(f"at most {limits.analyses} at a time")
    async with state.analyses:
        found = await value_of(
            "marsupial_service.analysis:analyse",
            (task, frozenset(sent.get("include", INCLUDE))),
            seconds=limits.analysis_s,
            memory_bytes=limits.memory_bytes,
        )
    if isinstance(found, InputError):
        with refusing("/map_state", sent["map_state"]):
            raise found
    return json_answer(found)


@router.post("/validations", response_model=answers.Verdict, responses=errors(body=True))
async def validate(state: Service, sent: Json, body: ValidationBody) -> Response:
    """Say whether a plan can be carried out and reaches the goal, or what is wrong with it first."""
    return json_answer(await asyncio.to_thread(_verdict, sent, state.settings.limits))


def _verdict(sent: Mapping[str, Any], limits: Limits) -> dict[str, Any]:
    situation = read_situation(sent, limits)
    plan = read_plan(sent, situation)
    return verdict_document(check(situation, plan), len(plan.actions))
