"""What happens to jobs in the store: every change of state, plan and event, each in one transaction.

A job's state, its plans and its events change together. A change that comes too late (the job is over, or another
attempt at it is under way) changes nothing and says so: that is how a final state is reached once.
"""

from __future__ import annotations

import json
import math
from dataclasses import dataclass

from marsupial.model.objective import Value
from marsupial.model.plan import Plan
from marsupial.model.planning import Budget
from marsupial_service.jobs import lookup
from marsupial_service.jobs.documents import line, plan_event, plan_of
from marsupial_service.jobs.messages import Analysed, Closed, Found
from marsupial_service.jobs.records import (
    STATE_OF,
    EventType,
    JobOutcome,
    JobRecord,
    JobSettings,
    JobState,
    QueueFull,
    Submitted,
    UnknownJob,
)
from marsupial_service.schemas.base import timestamp
from marsupial_service.store import Transaction, entries

_LONGEST_RETRY_S = 60
_REMOVED_AT_ONCE = 100
_FREED_PAGES = 2000
_LONGEST_DETAIL = 4000


@dataclass(frozen=True, slots=True, kw_only=True)
class NewJob:
    """A job to be stored; `task` is pickled, `source` compressed."""

    id: str
    owner: str
    key: str | None
    digest: bytes
    planner: str
    budget: Budget
    task: bytes
    source: bytes


@dataclass(frozen=True, slots=True, kw_only=True)
class Claim:
    """An attempt at a job: what the worker needs, and `attempt`, without which it can't change the job."""

    number: int
    id: str
    attempt: int
    planner: str
    budget: Budget
    task: bytes
    start: Plan | None


def insert(tx: Transaction, job: NewJob, settings: JobSettings, now_ms: int) -> Submitted:
    """Store a job, or find the one that the same request made before. Raises KeyReused, QueueFull."""
    known = entries.made_before(tx, "jobs", job.owner, job.key, job.digest)
    if known is not None:
        return Submitted(job=_record(tx, known), replayed=True)
    _find_room(tx, settings)
    number = tx.execute(
        "INSERT INTO jobs (id, owner, idempotency_key, digest, planner, seconds, steps, state, created_ms, queued_ms)"
        " VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?, ?)",
        (
            *(job.id, job.owner, job.key, job.digest, job.planner, job.budget.seconds, job.budget.steps),
            *(JobState.QUEUED, now_ms, now_ms),
        ),
    ).lastrowid
    assert number is not None
    tx.execute("INSERT INTO payloads (job, task, source) VALUES (?, ?, ?)", (number, job.task, job.source))
    _tell_state(tx, number, now_ms)
    return Submitted(job=_record(tx, job.id), replayed=False)


def _find_room(tx: Transaction, settings: JobSettings) -> None:
    waiting, mean_s = tx.execute(
        "SELECT count(*), avg(seconds) FROM jobs WHERE state = ? AND finished_ms IS NULL", (JobState.QUEUED,)
    ).fetchone()
    if waiting >= settings.queue:
        retry_s = math.ceil((mean_s or settings.steps_limit_s) / settings.slots)
        raise QueueFull(min(_LONGEST_RETRY_S, max(1, retry_s)))


def claim(tx: Transaction, now_ms: int) -> Claim | None:
    """Take the job that has waited longest, if there is one: it is running from now on."""
    row = tx.execute(
        "SELECT number, id, planner, seconds, steps, attempts, task FROM jobs JOIN payloads ON job = number"
        " WHERE state = ? AND finished_ms IS NULL ORDER BY number LIMIT 1",
        (JobState.QUEUED,),
    ).fetchone()
    if row is None:
        return None
    tx.execute(
        "UPDATE jobs SET state = ?, attempts = attempts + 1, started_ms = coalesce(started_ms, ?) WHERE number = ?",
        (JobState.RUNNING, now_ms, row["number"]),
    )
    _tell_state(tx, row["number"], now_ms)
    best = _best(tx, row["number"])
    return Claim(
        number=row["number"],
        id=row["id"],
        attempt=row["attempts"] + 1,
        planner=row["planner"],
        budget=Budget(seconds=row["seconds"], steps=row["steps"]),
        task=row["task"],
        start=None if best is None else plan_of(best[1]),
    )


def add_analysis(tx: Transaction, claim: Claim, analysed: Analysed) -> bool:
    """Keep what was found on the map; say whether it was in time."""
    if not _is_running(tx, claim):
        return False
    tx.execute(
        "UPDATE payloads SET situation = ?, places = ? WHERE job = ?",
        (analysed.situation, analysed.places, claim.number),
    )
    return True


def add_plan(tx: Transaction, claim: Claim, found: Found, now_ms: int) -> bool:
    """Keep a plan as the next revision; say whether it was in time and better than the last."""
    best = _best(tx, claim.number)
    if not _is_running(tx, claim) or (best is not None and found.score >= best[0]):
        return False
    revision, started_ms = tx.execute(
        "UPDATE jobs SET plans = plans + 1, first_plan_ms = coalesce(first_plan_ms, ?) WHERE number = ?"
        " RETURNING plans, started_ms",
        (now_ms, claim.number),
    ).fetchone()
    after_ms = max(0, now_ms - started_ms)
    tx.execute(
        "INSERT INTO plans (job, revision, score, makespan_ms, found_after_ms, at_ms, actions, ipc)"
        " VALUES (?, ?, ?, ?, ?, ?, ?, ?)",
        (claim.number, revision, line(found.score), found.makespan_ms, after_ms, now_ms, found.actions, found.ipc),
    )
    data = plan_event(revision, found.makespan_ms, after_ms, now_ms, found.actions)
    _tell(tx, claim.number, EventType.PLAN, data, now_ms)
    return True


def finish(tx: Transaction, claim: Claim, closed: Closed, now_ms: int) -> bool:
    """Put a running job into its final state; say whether it was in time."""
    return _is_running(tx, claim) and _end(tx, claim.number, closed, now_ms)


def cancel(tx: Transaction, job: str, now_ms: int) -> JobRecord:
    """Put a job into its final state, unless it is in one. Raises UnknownJob."""
    row = tx.execute("SELECT number FROM jobs WHERE id = ?", (job,)).fetchone()
    if row is None:
        raise UnknownJob(job)
    _end(tx, row["number"], Closed(outcome=JobOutcome.CANCELLED, detail="cancelled by a client"), now_ms)
    return _record(tx, job)


def give_back(tx: Transaction, claim: Claim, reason: str, settings: JobSettings, now_ms: int) -> bool:
    """Put a job whose attempt was lost into the queue again, or end it if that was the last; say which (True: queue).

    With no `reason` the attempt was ended by us and does not count.
    """
    if not _is_running(tx, claim):
        return False
    if reason and claim.attempt >= settings.max_attempts:
        _give_up(tx, claim.number, claim.attempt, reason, now_ms)
        return False
    _requeue(tx, claim.number, claim.attempt if reason else claim.attempt - 1, now_ms)
    return True


def recover(tx: Transaction, settings: JobSettings, now_ms: int) -> None:
    """Put jobs that were running when the server died into the queue again, as `give_back` does."""
    rows = tx.execute(
        "SELECT number, attempts FROM jobs WHERE state = ? AND finished_ms IS NULL", (JobState.RUNNING,)
    ).fetchall()
    for number, attempts in rows:
        if attempts >= settings.max_attempts:
            _give_up(tx, number, attempts, "the server ended while it ran", now_ms)
        else:
            _requeue(tx, number, attempts, now_ms)


def remove_old(tx: Transaction, settings: JobSettings, now_ms: int) -> int:
    """Remove some finished jobs that are too old or too many, if there are any, and return how many."""
    before_ms = now_ms - round(1000 * settings.retention_s)
    removed = entries.remove_old(tx, "jobs", before_ms, settings.kept_jobs, _REMOVED_AT_ONCE)
    if removed:
        tx.execute(f"PRAGMA incremental_vacuum({_FREED_PAGES})").fetchall()
    return removed


def _record(tx: Transaction, job: str) -> JobRecord:
    found = lookup.job(tx, job)
    assert found is not None
    return found


def _best(tx: Transaction, number: int) -> tuple[Value, str] | None:
    row = tx.execute(
        "SELECT score, actions FROM plans WHERE job = ? ORDER BY revision DESC LIMIT 1", (number,)
    ).fetchone()
    return None if row is None else (tuple(json.loads(row["score"])), row["actions"])


def _is_running(tx: Transaction, claim: Claim) -> bool:
    row = tx.execute(
        "SELECT 1 FROM jobs WHERE number = ? AND state = ? AND attempts = ?",
        (claim.number, JobState.RUNNING, claim.attempt),
    ).fetchone()
    return row is not None


def _requeue(tx: Transaction, number: int, attempts: int, now_ms: int) -> None:
    tx.execute(
        "UPDATE jobs SET state = ?, attempts = ?, queued_ms = ? WHERE number = ?",
        (JobState.QUEUED, attempts, now_ms, number),
    )
    _tell_state(tx, number, now_ms)


def _give_up(tx: Transaction, number: int, attempts: int, reason: str, now_ms: int) -> None:
    detail = f"given up after {attempts} attempts; in the last one, {reason}"
    _end(tx, number, Closed(outcome=JobOutcome.ENGINE_FAILED, detail=detail), now_ms)


def _end(tx: Transaction, number: int, closed: Closed, now_ms: int) -> bool:
    state = STATE_OF[closed.outcome]
    detail = closed.detail.encode(errors="replace").decode()[:_LONGEST_DETAIL]
    row = tx.execute(
        "UPDATE jobs SET state = ?, outcome = ?, detail = ?, lower_bound_ms = ?, finished_ms = ?"
        " WHERE number = ? AND finished_ms IS NULL RETURNING plans",
        (state, closed.outcome, detail, closed.lower_bound_ms, now_ms, number),
    ).fetchone()
    if row is None:
        return False
    tx.execute("UPDATE payloads SET task = NULL WHERE job = ?", (number,))
    end = {
        "state": state,
        "outcome": closed.outcome,
        "detail": detail,
        "plans": row["plans"],
        "lower_bound_ms": closed.lower_bound_ms,
        "at": timestamp(now_ms),
    }
    _tell(tx, number, EventType.END, line(end), now_ms)
    return True


def _tell_state(tx: Transaction, number: int, now_ms: int) -> None:
    row = tx.execute("SELECT state, attempts FROM jobs WHERE number = ?", (number,)).fetchone()
    data = {"state": row["state"], "attempts": row["attempts"], "at": timestamp(now_ms)}
    _tell(tx, number, EventType.STATE, line(data), now_ms)


def _tell(tx: Transaction, number: int, kind: EventType, data: str, now_ms: int) -> None:
    row = tx.execute("UPDATE jobs SET events = events + 1 WHERE number = ? RETURNING id, events", (number,)).fetchone()
    tx.execute(
        "INSERT INTO events (job, seq, type, data, at_ms) VALUES (?, ?, ?, ?, ?)",
        (number, row["events"], kind, data, now_ms),
    )
    tx.news.add(row["id"])
