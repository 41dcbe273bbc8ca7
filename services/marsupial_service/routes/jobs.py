"""Planning jobs: submit, read, follow, cancel."""

import logging
from collections.abc import AsyncIterator, Mapping
from functools import partial
from typing import Annotated

from fastapi import APIRouter, Body, Query, Response
from fastapi.responses import StreamingResponse

from marsupial_service.http.answers import NOT_CACHED, job_text, json_answer, summary_answer, text_answer
from marsupial_service.http.events import EventStream, stream
from marsupial_service.http.openapi import errors
from marsupial_service.http.routing import PlanRoute
from marsupial_service.intake.jobs import JOB_READER, job_map_text, situation_text
from marsupial_service.intake.reading import INLINE_BYTES, ReceivedBody, read
from marsupial_service.jobs import lookup
from marsupial_service.jobs.records import JobRecord
from marsupial_service.jobs.service import Jobs
from marsupial_service.problems import HttpProblem
from marsupial_service.routes.parameters import (
    IdempotencyKey,
    KeyIsValid,
    LastEventId,
    Owner,
    PageLimit,
    PathJob,
    Prefer,
    ServiceState,
    headers_of,
    older_than,
    page,
    stored,
    streamed,
    wait_seconds,
)
from marsupial_service.schemas import answers
from marsupial_service.schemas.base import described_by
from marsupial_service.schemas.enums import JobState
from marsupial_service.schemas.requests import JobBody

log = logging.getLogger("marsupial.service")

router = APIRouter(prefix="/v1/jobs", route_class=PlanRoute, tags=["jobs"])


@router.post(
    "",
    status_code=202,
    response_model=answers.JobAnswer,
    responses=stored(answers.JobAnswer, "job", 202, at_once="The job has ended."),
)
async def submit_job(
    state: ServiceState,
    owner: Owner,
    sent: Annotated[ReceivedBody, Body(), described_by(JobBody)],
    prefer: Prefer = None,
    idempotency_key: IdempotencyKey = None,
) -> Response:
    """Submit a planning job. With `Prefer: wait`, the answer may be the finished job."""
    settings = state.settings
    request = await read(state.readers, settings.limits, sent, JOB_READER, settings.planners)
    created = await state.jobs.submit(request, owner=owner, idempotency_key=idempotency_key)
    job, headers = created.record, headers_of(created, f"{router.prefix}/{created.record.id}")
    log.info("job accepted", extra={"job": job.id, "owner": owner, "planner": job.planner})
    seconds = wait_seconds(prefer, settings.limits.wait_s)
    if seconds is not None:
        job = await state.jobs.wait(job.id, seconds)
        headers["Preference-Applied"] = f"wait={seconds:g}"
    return await _answer(state.jobs, job, 202 if job.finished_at_ms is None else 200, headers)


@router.get("", response_model=answers.JobListAnswer, responses=errors())
async def list_jobs(
    state: ServiceState,
    owner: Owner,
    job_state: Annotated[answers.JobStateWord | None, Query(alias="state")] = None,
    limit: PageLimit = 50,
    before: Annotated[str | None, older_than("job")] = None,
) -> Response:
    """List your jobs, newest first."""
    wanted = None if job_state is None else JobState(job_state)
    found = await state.jobs.list(owner, state=wanted, limit=limit + 1, before=before)
    jobs, following = page(found, limit, router.prefix, state=job_state)
    return json_answer(answers.JobListAnswer(jobs=[summary_answer(job) for job in jobs], next=following))


@router.get("/{job}", response_model=answers.JobAnswer, responses=errors("not-found"))
async def get_job(state: ServiceState, job: PathJob) -> Response:
    """Return a job with its best plan so far."""
    return await _answer(state.jobs, job)


@router.post("/{job}/cancel", response_model=answers.JobAnswer, responses=errors("not-found", "not-ready"))
async def cancel_job(state: ServiceState, job: PathJob) -> Response:
    """Cancel a job, which keeps its best plan. A job that has ended does not change."""
    return await _answer(state.jobs, await state.jobs.cancel(job.id))


async def _answer(jobs: Jobs, job: JobRecord, status: int = 200, headers: Mapping[str, str] | None = None) -> Response:
    best = await jobs.read(lambda reader: lookup.plan_text(reader, job.id, job.plans)) if job.plans else "null"
    return text_answer(job_text(job, best), status, headers)


@router.get("/{job}/plans", response_model=answers.PlansAnswer, responses=errors("not-found"))
async def list_plans(state: ServiceState, job: PathJob) -> Response:
    """Return all plans found so far, each better than the previous one."""
    return StreamingResponse(_plans(state.jobs, job), headers=NOT_CACHED, media_type="application/json")


async def _plans(jobs: Jobs, job: JobRecord) -> AsyncIterator[bytes]:
    """Yield the text of all plans piece by piece: there may be hundreds, each with thousands of actions."""
    yield b'{"plans":['
    for revision in range(1, job.plans + 1):
        text = await jobs.read(partial(lookup.plan_text, job=job.id, revision=revision))
        yield b"," * (revision > 1) + text.encode()
    yield b"]}"


@router.get(
    "/{job}/events",
    response_class=EventStream,
    responses=streamed("Events `state`, `plan` and `end`, with ids from 1; the stream ends after `end`."),
)
async def follow_job(
    state: ServiceState, owner: Owner, is_valid: KeyIsValid, job: PathJob, last_event_id: LastEventId = None
) -> Response:
    """Stream the events of a job: first the stored ones, then new ones."""
    return await stream(state, owner, is_valid, state.jobs, job.id, last_event_id)


@router.get("/{job}/situation", response_model=answers.JobSituationAnswer, responses=errors("not-found"))
async def get_situation(state: ServiceState, owner: Owner, job: PathJob) -> Response:
    """Return the situation for the planner; for a map state, once it has been analysed."""
    analysis = await state.jobs.read(lambda reader: lookup.analysis(reader, job.id))
    if analysis is not None:
        return text_answer(f'{{"situation":{analysis.situation},"places":{analysis.places}}}'.encode())
    text = await state.jobs.read(lambda reader: lookup.source_text(reader, job.id)) or "{}"
    if len(text) <= INLINE_BYTES:
        found = situation_text(text)
    else:
        found = await state.readers.value_of(owner, situation_text, text)
    if found is None:
        raise HttpProblem("not-found", "the map has not been analysed yet", headers={"Retry-After": "1"})
    return text_answer(found)


@router.get("/{job}/map", response_model=answers.KnownMapAnswer, responses=errors("not-found"))
async def get_map(state: ServiceState, owner: Owner, job: PathJob) -> Response:
    """Return the map that a job was submitted with, as runs; a job for a situation has none."""
    source = await state.jobs.read(lambda reader: lookup.source_text(reader, job.id)) or "{}"
    found = await state.readers.value_of(owner, job_map_text, (source, state.settings.limits))
    if found is None:
        raise HttpProblem("not-found", "the job was submitted with a situation, which has no map")
    return text_answer(found)
