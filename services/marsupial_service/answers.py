"""Answers: the models that the OpenAPI document shows, made of records, and sent as JSON."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict
from typing import TypeVar

from starlette.responses import Response

from marsupial.model.planning import EngineInfo
from marsupial.planning.checker import Verdict
from marsupial_service.jobs import FINAL, JobRecord, PlanRecord
from marsupial_service.jobs.documents import line, timestamp
from marsupial_service.missions.records import MissionRecord
from marsupial_service.schemas.answers import (
    ActionAnswer,
    BudgetAnswer,
    JobAnswer,
    JobLinksAnswer,
    JobSummaryAnswer,
    MissionAnswer,
    MissionLinksAnswer,
    PlanAnswer,
    PlannerAnswer,
    VerdictAnswer,
    ViolationAnswer,
)
from marsupial_service.schemas.base import Answer

L = TypeVar("L", JobLinksAnswer, MissionLinksAnswer)


def json_answer(body: Answer, status: int = 200, headers: Mapping[str, str] | None = None) -> Response:
    """Return a response with a JSON body."""
    fixed = {"Cache-Control": "no-store", **(headers or {})}
    text = line(body.model_dump())
    return Response(text.encode(), status_code=status, headers=fixed, media_type="application/json")


def plan_answer(record: PlanRecord) -> PlanAnswer:
    """Return a revision."""
    return PlanAnswer(
        revision=record.revision,
        makespan_ms=record.makespan_ms,
        found_after_ms=record.found_after_ms,
        found_at=timestamp(record.at_ms),
        actions=[ActionAnswer.of(action) for action in record.plan.actions],
        ipc=record.ipc,
    )


def job_path(job: str) -> str:
    """Return the path of a job."""
    return f"/v1/jobs/{job}"


def summary_answer(job: JobRecord) -> JobSummaryAnswer:
    """Return a job without its plan."""
    return JobSummaryAnswer.model_validate(_summary(job))


def job_answer(job: JobRecord) -> JobAnswer:
    """Return a job with its best plan."""
    return JobAnswer.model_validate({**_summary(job), "best": None if job.best is None else plan_answer(job.best)})


def _summary(job: JobRecord) -> dict[str, object]:
    path = job_path(job.id)
    return {
        "id": job.id,
        "state": job.state,
        "outcome": job.outcome,
        "detail": job.detail,
        "planner": job.planner,
        "budget": BudgetAnswer.of(job.budget),
        "attempts": job.attempts,
        "created_at": timestamp(job.created_at_ms),
        "queued_at": timestamp(job.queued_at_ms),
        "started_at": _moment(job.started_at_ms),
        "first_plan_at": _moment(job.first_plan_at_ms),
        "finished_at": _moment(job.finished_at_ms),
        "plans": job.plans,
        "makespan_ms": None if job.best is None else job.best.makespan_ms,
        "lower_bound_ms": job.lower_bound_ms,
        "gap": job.gap,
        "links": _links(JobLinksAnswer, path),
    }


def is_over(job: JobRecord) -> bool:
    """Say whether a job has ended."""
    return job.state in FINAL


def mission_path(mission: str) -> str:
    """Return the path of a mission."""
    return f"/v1/missions/{mission}"


def mission_answer(record: MissionRecord) -> MissionAnswer:
    """Return a mission."""
    return MissionAnswer(
        id=record.id,
        name=record.name,
        state=record.state.value,
        status=record.status,
        reason=record.reason,
        strategy=record.strategy,
        planner=record.planner,
        n=record.n,
        t_ms=record.t_ms,
        revision=record.revision,
        created_at=timestamp(record.created_at_ms),
        finished_at=_moment(record.finished_at_ms),
        links=_links(MissionLinksAnswer, mission_path(record.id)),
    )


def verdict_answer(verdict: Verdict, actions: int) -> VerdictAnswer:
    """Return what the checker says of a plan of so many actions."""
    found = verdict.violation
    violation = None if found is None else ViolationAnswer.of(found)
    return VerdictAnswer(valid=verdict.valid, violation=violation, makespan_ms=verdict.makespan_ms, actions=actions)


def planner_answer(info: EngineInfo) -> PlannerAnswer:
    """Return what a planner can do."""
    return PlannerAnswer.model_validate({**asdict(info), "available": info.missing is None})


def _moment(ms: int | None) -> str | None:
    return None if ms is None else timestamp(ms)


def _links(links: type[L], path: str) -> L:
    return links.model_validate({word: path if word == "self" else f"{path}/{word}" for word in links.model_fields})
