"""What can be read of jobs in the store, at one moment."""

from __future__ import annotations

import sqlite3
import zlib
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Protocol

from marsupial.model.planning import Budget
from marsupial_service.jobs.documents import plan_of
from marsupial_service.jobs.records import (
    AnalysisRecord,
    EventRecord,
    EventType,
    JobOutcome,
    JobRecord,
    JobState,
    PlanRecord,
    UnknownJob,
)

_JOBS = (
    "SELECT jobs.*, plans.revision, plans.makespan_ms, plans.found_after_ms, plans.at_ms, plans.actions, plans.ipc"
    " FROM jobs LEFT JOIN plans ON plans.job = jobs.number AND plans.revision = jobs.plans"
)


class Source(Protocol):
    """A connection, or a transaction under way."""

    def execute(self, sql: str, values: tuple[object, ...] = ..., /) -> sqlite3.Cursor:
        """Run one statement."""
        ...


@dataclass(frozen=True, slots=True, kw_only=True)
class Batch:
    """Events of a job, and whether more may come after the last one there is."""

    events: tuple[EventRecord, ...]
    is_open: bool


def job(source: Source, job: str, owner: str | None = None) -> JobRecord | None:
    """Return a job, if there is one (of that owner)."""
    row = source.execute(f"{_JOBS} WHERE jobs.id = ? AND jobs.owner = coalesce(?, jobs.owner)", (job, owner)).fetchone()
    return None if row is None else _job(row)


def jobs(source: Source, owner: str, state: JobState | None, limit: int, before: str | None) -> tuple[JobRecord, ...]:
    """Return the newest jobs of an owner, those made before job `before` only."""
    where, values = ["jobs.owner = ?"], [owner]
    if state is not None:
        where.append("jobs.state = ?")
        values.append(state)
    if before is not None:
        where.append("jobs.number < (SELECT number FROM jobs WHERE id = ?)")
        values.append(before)
    sql = f"{_JOBS} WHERE {' AND '.join(where)} ORDER BY jobs.number DESC LIMIT ?"
    return tuple(_job(row) for row in source.execute(sql, (*values, limit)))


def plans(source: Source, job: str) -> tuple[PlanRecord, ...]:
    """Return the plans of a job in order."""
    sql = "SELECT plans.* FROM plans JOIN jobs ON number = job WHERE id = ? ORDER BY revision"
    return tuple(_plan(row) for row in source.execute(sql, (job,)))


def analysis(source: Source, job: str) -> AnalysisRecord | None:
    """Return what was found on the map of a job, if it had one and that is done."""
    sql = "SELECT situation, places FROM payloads JOIN jobs ON number = job WHERE id = ? AND situation IS NOT NULL"
    row = source.execute(sql, (job,)).fetchone()
    return None if row is None else AnalysisRecord(situation=row["situation"], places=row["places"])


def source_text(source: Source, job: str) -> str | None:
    """Return the JSON text that was sent for a job."""
    sql = "SELECT source FROM payloads JOIN jobs ON number = job WHERE id = ?"
    row = source.execute(sql, (job,)).fetchone()
    return None if row is None else zlib.decompress(row["source"]).decode()


def events(source: Source, job: str, after: int, limit: int) -> Batch:
    """Return the next events of a job after number `after`. A job that is not there has none and gets none."""
    row = source.execute("SELECT number, finished_ms, events FROM jobs WHERE id = ?", (job,)).fetchone()
    if row is None:
        return Batch(events=(), is_open=False)
    found = source.execute(
        "SELECT seq, type, data, at_ms FROM events WHERE job = ? AND seq > ? ORDER BY seq LIMIT ?",
        (row["number"], after, limit),
    ).fetchall()
    told = tuple(
        EventRecord(job=job, seq=seq, type=EventType(kind), data=data, at_ms=at) for seq, kind, data, at in found
    )
    last = told[-1].seq if told else after
    return Batch(events=told, is_open=row["finished_ms"] is None or last < row["events"])


def counts(source: Source) -> tuple[Mapping[JobState, int], Mapping[JobOutcome, int]]:
    """Return how many jobs there are by state and by outcome."""
    states, outcomes = dict.fromkeys(JobState, 0), dict.fromkeys(JobOutcome, 0)
    for state, outcome, count in source.execute("SELECT state, outcome, count(*) FROM jobs GROUP BY 1, 2"):
        states[JobState(state)] += count
        if outcome is not None:
            outcomes[JobOutcome(outcome)] += count
    return states, outcomes


def existing(found: JobRecord | None, job: str) -> JobRecord:
    """Return the record that there has to be. Raises UnknownJob."""
    if found is None:
        raise UnknownJob(job)
    return found


def _job(row: sqlite3.Row) -> JobRecord:
    return JobRecord(
        id=row["id"],
        owner=row["owner"],
        state=JobState(row["state"]),
        outcome=None if row["outcome"] is None else JobOutcome(row["outcome"]),
        detail=row["detail"],
        planner=row["planner"],
        budget=Budget(seconds=row["seconds"], steps=row["steps"]),
        attempts=row["attempts"],
        plans=row["plans"],
        best=None if row["revision"] is None else _plan(row),
        lower_bound_ms=row["lower_bound_ms"],
        created_at_ms=row["created_ms"],
        queued_at_ms=row["queued_ms"],
        started_at_ms=row["started_ms"],
        first_plan_at_ms=row["first_plan_ms"],
        finished_at_ms=row["finished_ms"],
    )


def _plan(row: sqlite3.Row) -> PlanRecord:
    return PlanRecord(
        revision=row["revision"],
        plan=plan_of(row["actions"]),
        makespan_ms=row["makespan_ms"],
        found_after_ms=row["found_after_ms"],
        at_ms=row["at_ms"],
        ipc=row["ipc"],
    )
