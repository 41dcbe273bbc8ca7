"""What needs no job: analyses of maps, and verdicts on plans."""

from __future__ import annotations

import asyncio

from fastapi import APIRouter, Response

from marsupial.errors import InputError
from marsupial.formats.fields import Notes
from marsupial.planning.checker import check
from marsupial_service.analyses import analysis
from marsupial_service.analyses.supervised import value_of
from marsupial_service.entries.records import TooMany
from marsupial_service.http.answers import json_answer
from marsupial_service.http.openapi import errors
from marsupial_service.http.routing import PlanRoute
from marsupial_service.intake.maps import map_state_of
from marsupial_service.intake.situations import reading_of, situation_of
from marsupial_service.operations.settings import ServiceLimits
from marsupial_service.routes.parameters import Service
from marsupial_service.schemas import answers
from marsupial_service.schemas.requests import AnalysisBody, ValidationBody

router = APIRouter(prefix="/v1", route_class=PlanRoute, tags=["analysis"])


@router.post("/analysis", response_model=answers.AnalysisAnswer, responses=errors("too-many", body=True))
async def analyse(state: Service, body: AnalysisBody) -> Response:
    """Find targets, meeting points, reach and costs on a map, as GeoJSON in metres of the map frame."""
    limits = state.settings.limits
    task = await asyncio.to_thread(map_state_of, body.map_state, limits)
    if state.analyses.locked():
        raise TooMany(f"at most {limits.analyses} at a time")
    async with state.analyses:
        found = await value_of(
            analysis.analyse,
            (task, analysis.INCLUDE if body.include is None else frozenset(body.include)),
            seconds=limits.analysis_s,
            memory_bytes=limits.memory_bytes,
        )
    if isinstance(found, InputError):
        notes = Notes("map_state")
        notes.take(found)
        notes.check(InputError)
    assert isinstance(found, answers.AnalysisAnswer)
    return json_answer(found)


@router.post("/validations", response_model=answers.VerdictAnswer, responses=errors(body=True))
async def validate(state: Service, body: ValidationBody) -> Response:
    """Say whether a plan can be carried out and reaches the goal, or what is wrong with it first."""
    return json_answer(await asyncio.to_thread(_verdict, body, state.settings.limits))


def _verdict(body: ValidationBody, limits: ServiceLimits) -> answers.VerdictAnswer:
    situation = situation_of(body.situation, limits)
    reading = reading_of(body.plan, situation)
    actions, retimed = len(reading.plan.actions), len(reading.mended)
    return answers.VerdictAnswer.of(check(situation, reading.plan), actions=actions, retimed=retimed)
