"""Records as the JSON of answers."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from starlette.responses import Response

from marsupial.planning.checker import Verdict
from marsupial_service.jobs.documents import action_document, line
from marsupial_service.jobs.records import FINAL, JobRecord, PlanRecord
from marsupial_service.moments import timestamp, timestamp_if_any


def json_answer(document: object, status: int = 200, headers: Mapping[str, str] | None = None) -> Response:
    """Return a response with a JSON body."""
    fixed = {"Cache-Control": "no-store", **(headers or {})}
    return Response(line(document).encode(), status_code=status, headers=fixed, media_type="application/json")


def plan_document(record: PlanRecord) -> dict[str, Any]:
    """Return a revision."""
    return {
        "revision": record.revision,
        "makespan_ms": record.makespan_ms,
        "found_after_ms": record.found_after_ms,
        "found_at": timestamp(record.at_ms),
        "actions": [action_document(action) for action in record.plan.actions],
        "ipc": record.ipc,
    }


def job_path(job: str) -> str:
    """Return the path of a job."""
    return f"/v1/jobs/{job}"


def summary_document(job: JobRecord) -> dict[str, Any]:
    """Return a job without its plan."""
    budget = {"seconds": job.budget.seconds} if job.budget.seconds is not None else {"steps": job.budget.steps}
    path = job_path(job.id)
    return {
        "id": job.id,
        "state": job.state.value,
        "outcome": None if job.outcome is None else job.outcome.value,
        "detail": job.detail,
        "planner": job.planner,
        "budget": budget,
        "attempts": job.attempts,
        "created_at": timestamp(job.created_at_ms),
        "queued_at": timestamp(job.queued_at_ms),
        "started_at": timestamp_if_any(job.started_at_ms),
        "first_plan_at": timestamp_if_any(job.first_plan_at_ms),
        "finished_at": timestamp_if_any(job.finished_at_ms),
        "plans": job.plans,
        "makespan_ms": None if job.best is None else job.best.makespan_ms,
        "lower_bound_ms": job.lower_bound_ms,
        "gap": job.gap,
        "links": {"self": path, **{word: f"{path}/{word}" for word in ("plans", "events", "situation", "cancel")}},
    }


def job_document(job: JobRecord) -> dict[str, Any]:
    """Return a job with its best plan."""
    return {**summary_document(job), "best": None if job.best is None else plan_document(job.best)}


def is_over(job: JobRecord) -> bool:
    """Say whether a job has ended."""
    return job.state in FINAL


def verdict_document(verdict: Verdict, actions: int) -> dict[str, Any]:
    """Return what the checker says of a plan of so many actions."""
    found = verdict.violation
    violation = (
        None
        if found is None
        else {
            "kind": found.kind.value,
            "time_ms": found.time_ms,
            "action": None if found.action is None else action_document(found.action),
            "message": found.message,
        }
    )
    return {"valid": verdict.valid, "violation": violation, "makespan_ms": verdict.makespan_ms, "actions": actions}
