"""Planning jobs: sent, looked at, followed, cancelled."""

from __future__ import annotations

import asyncio
import json
import logging
from collections.abc import Mapping
from typing import Annotated, Any

from fastapi import APIRouter, Query, Response

from marsupial.model.planning import EngineInfo
from marsupial.model.situation import Situation
from marsupial_service.http.answers import job_answer, job_path, json_answer, plan_answer, summary_answer
from marsupial_service.http.events import EventStream, stream
from marsupial_service.http.openapi import errors
from marsupial_service.http.problems import HttpProblem
from marsupial_service.http.routing import PlanRoute
from marsupial_service.intake.maps import map_state_of
from marsupial_service.intake.situations import budget_of, refuse, situation_of
from marsupial_service.jobs.records import JobRequest, JobState, MapTask
from marsupial_service.operations.settings import ServiceSettings
from marsupial_service.planners import planner_info, planner_names
from marsupial_service.routes.parameters import (
    IdempotencyKey,
    JobOfPath,
    Json,
    LastEventId,
    Owner,
    PageLimit,
    Prefer,
    Service,
    digest_of,
    older_than,
    wait_seconds,
)
from marsupial_service.routes.stored import headers_of, page, stored
from marsupial_service.schemas import answers
from marsupial_service.schemas.requests import JobBody, MapStateJobBody, SituationJobBody

DEFAULT_BUDGET_S = 5.0

log = logging.getLogger("marsupial.service")

router = APIRouter(prefix="/v1/jobs", route_class=PlanRoute, tags=["jobs"])


@router.post(
    "",
    status_code=202,
    response_model=answers.JobAnswer,
    responses=stored(answers.JobAnswer, "job", 202, at_once="The job is over."),
)
async def submit_job(
    state: Service,
    owner: Owner,
    sent: Json,
    body: JobBody,
    prefer: Prefer = None,
    idempotency_key: IdempotencyKey = None,
) -> Response:
    """Store a planning job. With `Prefer: wait` the answer may be the finished job."""
    request = await asyncio.to_thread(_request, body.root, sent, state.settings)
    created = await state.running().submit(request, owner=owner, idempotency_key=idempotency_key)
    job, headers = created.record, headers_of(created, job_path(created.record.id))
    log.info("job taken", extra={"job": job.id, "owner": owner, "planner": job.planner})
    seconds = wait_seconds(prefer, state.settings.limits.wait_s)
    if seconds is not None:
        job = await state.running().wait(job.id, seconds)
        headers["Preference-Applied"] = f"wait={seconds:g}"
    return json_answer(job_answer(job), 202 if job.finished_at_ms is None else 200, headers)


def _request(
    body: SituationJobBody | MapStateJobBody, sent: Mapping[str, Any], settings: ServiceSettings
) -> JobRequest:
    """Read the body; in a thread of its own, as maps may be large."""
    info = _planner(body.planner, settings)
    budget = budget_of(body.budget, settings.limits, DEFAULT_BUDGET_S)
    if budget.steps is not None and not info.deterministic_steps:
        raise refuse("budget.steps", f"planner {body.planner} can't count steps: give it a budget in seconds")
    task: Situation | MapTask
    if isinstance(body, SituationJobBody):
        task = situation_of(body.situation, settings.limits)
    else:
        task = map_state_of(body.map_state, settings.limits)
    return JobRequest(planner=body.planner, budget=budget, task=task, digest=digest_of(sent), source=sent)


def _planner(name: str, settings: ServiceSettings) -> EngineInfo:
    names = planner_names(settings.planners)
    if name not in names:
        raise refuse("planner", f"unknown planner {name!r}; there are {', '.join(sorted(names))}")
    info = planner_info(name, settings.planners)
    if info.missing is not None:
        raise refuse("planner", f"{name} can't be used here: {info.missing}")
    return info


@router.get("", response_model=answers.JobListAnswer, responses=errors())
async def list_jobs(
    state: Service,
    owner: Owner,
    job_state: Annotated[answers.StateWord | None, Query(alias="state")] = None,
    limit: PageLimit = 50,
    before: Annotated[str | None, older_than("job")] = None,
) -> Response:
    """List one's jobs, the newest first."""
    wanted = None if job_state is None else JobState(job_state)
    found = await state.running().list(owner, state=wanted, limit=limit + 1, before=before)
    jobs, following = page(found, limit, router.prefix, state=job_state)
    return json_answer(answers.JobListAnswer(jobs=[summary_answer(job) for job in jobs], next=following))


@router.get("/{job}", response_model=answers.JobAnswer, responses=errors("not-found"))
async def get_job(job: JobOfPath) -> Response:
    """Return a job with its best plan so far."""
    return json_answer(job_answer(job))


@router.post("/{job}/cancel", response_model=answers.JobAnswer, responses=errors("not-found", "not-ready"))
async def cancel_job(state: Service, job: JobOfPath) -> Response:
    """End a job early; it keeps its best plan. A job that has ended does not change."""
    return json_answer(job_answer(await state.running().cancel(job.id)))


@router.get("/{job}/plans", response_model=answers.PlansAnswer, responses=errors("not-found"))
async def list_plans(state: Service, job: JobOfPath) -> Response:
    """Return every plan found so far, each better than the one before."""
    found = await state.running().plans(job.id)
    return json_answer(answers.PlansAnswer(plans=[plan_answer(plan) for plan in found]))


@router.get(
    "/{job}/events",
    response_class=EventStream,
    responses={
        **errors("not-found", "too-many"),
        200: {"description": "Events `state`, `plan` and `end`, with ids from 1; the stream ends after `end`."},
    },
)
async def follow_job(state: Service, owner: Owner, job: JobOfPath, last_event_id: LastEventId = None) -> Response:
    """Stream the events of a job as they come, the stored ones first."""
    return stream(state, owner, state.running(), job.id, last_event_id)


@router.get("/{job}/situation", response_model=answers.JobSituationAnswer, responses=errors("not-found"))
async def get_situation(state: Service, job: JobOfPath) -> Response:
    """Return what the planner is asked; for a map state once that has been analysed."""
    analysis = await state.running().analysis(job.id)
    if analysis is not None:
        found = {"situation": json.loads(analysis.situation), "places": json.loads(analysis.places)}
        return json_answer(answers.JobSituationAnswer.model_validate(found))
    sent = json.loads(await state.running().source(job.id) or "{}")
    if "situation" not in sent:
        raise HttpProblem("not-found", "the map has not been analysed yet", headers={"Retry-After": "1"})
    return json_answer(answers.JobSituationAnswer(situation=sent["situation"], places=None))
