"""Answers: the models that the OpenAPI document shows, made of records, and sent as JSON."""

from __future__ import annotations

from collections.abc import Mapping

from starlette.responses import Response

from marsupial_service.jobs.documents import line
from marsupial_service.jobs.records import JobRecord, PlanRecord
from marsupial_service.missions.records import MissionRecord
from marsupial_service.moments import timestamp
from marsupial_service.schemas import answers
from marsupial_service.schemas.answers import JobAnswer, JobSummaryAnswer, MissionAnswer, PlanAnswer
from marsupial_service.schemas.base import Answer

UNKEPT = {"Cache-Control": "no-store"}
"""Headers of answers that nobody on the way is to keep."""


def json_answer(body: Answer, status: int = 200, headers: Mapping[str, str] | None = None) -> Response:
    """Return a response with a JSON body."""
    return text_answer(line(body.model_dump()).encode(), status, headers)


def text_answer(text: bytes, status: int = 200, headers: Mapping[str, str] | None = None) -> Response:
    """Return a response whose body is JSON text already."""
    return Response(text, status_code=status, headers={**UNKEPT, **(headers or {})}, media_type="application/json")


def plan_answer(record: PlanRecord) -> PlanAnswer:
    """Return a revision."""
    return PlanAnswer.of(record, found_at=timestamp(record.at_ms), actions=record.plan.actions)


def job_path(job: str) -> str:
    """Return the path of a job."""
    return f"/v1/jobs/{job}"


def summary_answer(job: JobRecord) -> JobSummaryAnswer:
    """Return a job without its plan."""
    return JobSummaryAnswer.of(job, **_more(job))


def job_answer(job: JobRecord) -> JobAnswer:
    """Return a job with its best plan."""
    return JobAnswer.of(job, best=None if job.best is None else plan_answer(job.best), **_more(job))


def _more(job: JobRecord) -> dict[str, object]:
    makespan_ms = None if job.best is None else job.best.makespan_ms
    return {"makespan_ms": makespan_ms, "links": _links(answers.JobLinksAnswer, job_path(job.id))}


def mission_path(mission: str) -> str:
    """Return the path of a mission."""
    return f"/v1/missions/{mission}"


def mission_answer(record: MissionRecord) -> MissionAnswer:
    """Return a mission."""
    return MissionAnswer.of(record, links=_links(answers.MissionLinksAnswer, mission_path(record.id)))


def _links(links: type[Answer], path: str) -> Answer:
    return links.model_validate({word: path if word == "self" else f"{path}/{word}" for word in links.model_fields})
