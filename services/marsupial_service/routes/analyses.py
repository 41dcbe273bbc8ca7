"""Requests that need no job: analyses of maps, and validations of plans."""

from typing import Annotated

from fastapi import APIRouter, Body, Response

from marsupial_service.analyses import analysis
from marsupial_service.http.answers import json_answer, text_answer
from marsupial_service.http.openapi import errors
from marsupial_service.http.routing import PlanRoute
from marsupial_service.intake.jobs import ANALYSIS_READER, VALIDATION_READER
from marsupial_service.intake.reading import ReceivedBody, read
from marsupial_service.routes.parameters import Owner, ServiceState
from marsupial_service.schemas import answers
from marsupial_service.schemas.base import described_by
from marsupial_service.schemas.requests import AnalysisBody, ValidationBody

router = APIRouter(prefix="/v1", route_class=PlanRoute, tags=["analysis"])


@router.post("/analysis", response_model=answers.AnalysisAnswer, responses=errors("too-many", body=True))
async def analyse(
    state: ServiceState, owner: Owner, sent: Annotated[ReceivedBody, Body(), described_by(AnalysisBody)]
) -> Response:
    """Analyse a map: targets, meeting points, reach and travel times as GeoJSON in metres of the map frame."""
    limits = state.settings.limits
    task, include = await read(state.readers, limits, sent, ANALYSIS_READER)
    found = await state.analyses.value_of(
        owner, analysis.analyse, (task, include, limits.answer_bytes), wait_s=limits.wait_s, needs_quota=True
    )
    return text_answer(found)


@router.post("/validations", response_model=answers.VerdictAnswer, responses=errors("too-many", body=True))
async def validate(
    state: ServiceState, sent: Annotated[ReceivedBody, Body(), described_by(ValidationBody)]
) -> Response:
    """Check whether a plan is executable and reaches the goal, and return its first violation if not."""
    verdict = await read(state.readers, state.settings.limits, sent, VALIDATION_READER)
    return json_answer(verdict)
