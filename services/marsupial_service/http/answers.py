"""Answers: the models that the OpenAPI document shows, made of records, and sent as JSON."""

import json
from collections.abc import Mapping
from http import HTTPStatus

from starlette.responses import Response

from marsupial_service.entries.documents import text_of, text_with
from marsupial_service.jobs.records import JobRecord
from marsupial_service.missions.records import MissionRecord
from marsupial_service.problems import KINDS, MEDIA_TYPE, MOST_ERRORS, HttpProblem, summary
from marsupial_service.schemas import answers
from marsupial_service.schemas.answers import JobSummaryAnswer, MissionAnswer, ProblemAnswer
from marsupial_service.schemas.base import Answer

NOT_CACHED = {"Cache-Control": "no-store"}
"""Headers of answers that must not be cached."""


def json_answer(body: Answer, status: int = 200, headers: Mapping[str, str] | None = None) -> Response:
    return text_answer(text_of(body).encode(), status, headers)


def text_answer(text: bytes, status: int = 200, headers: Mapping[str, str] | None = None) -> Response:
    """Return a response with a body that is already JSON text."""
    return Response(text, status_code=status, headers={**NOT_CACHED, **(headers or {})}, media_type="application/json")


def summary_answer(job: JobRecord) -> JobSummaryAnswer:
    """Return a job without its plan."""
    return JobSummaryAnswer.of(job, links=_links(answers.JobLinksAnswer, f"/v1/jobs/{job.id}"))


def job_text(job: JobRecord, best: str) -> bytes:
    """Return a job with its best plan (``null``: none), which is JSON text already, as `JobAnswer` describes it."""
    return text_with(summary_answer(job).model_dump(), best=best).encode()


def mission_answer(record: MissionRecord) -> MissionAnswer:
    return MissionAnswer.of(record, links=_links(answers.MissionLinksAnswer, f"/v1/missions/{record.id}"))


def _links(links: type[Answer], path: str) -> Answer:
    return links.model_validate({word: path if word == "self" else f"{path}/{word}" for word in links.model_fields})


def answer(problem: HttpProblem, instance: str) -> Response:
    """Return the response for a problem with the request for the path `instance`."""
    kind = KINDS[problem.kind]
    errors = problem.errors[:MOST_ERRORS]
    body = ProblemAnswer(
        type=f"urn:marsupial:problem:{problem.kind}",
        title=kind.title,
        status=kind.status,
        detail=problem.detail
        or summary(errors, len(problem.errors))
        or HTTPStatus(kind.status).description
        or kind.title,
        instance=instance,
        errors=list(errors) or None,
    )
    text = json.dumps(body.model_dump())
    return Response(text.encode(), status_code=kind.status, headers=problem.headers, media_type=MEDIA_TYPE)
