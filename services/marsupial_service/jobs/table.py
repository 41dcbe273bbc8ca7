"""Changes to jobs in the store: every new state, plan and event, each in one transaction.

A job's state, its plans and its events change together. A write that comes too late (the job is over, or another
attempt at it is running) changes nothing and reports that.
"""

import json
import math
from collections.abc import Collection, Mapping
from dataclasses import dataclass
from typing import Any

from marsupial.model.objective import Value
from marsupial.model.plan import Plan
from marsupial.model.planning import Budget
from marsupial_service.entries.capacity import StoreCapacity
from marsupial_service.entries.documents import line, plan_of, text_of, text_with
from marsupial_service.entries.quota import PREPARATION_S, Quota
from marsupial_service.entries.records import Created, NewEntry, TooMany
from marsupial_service.entries.table import record_of
from marsupial_service.jobs import scheduling
from marsupial_service.jobs.lookup import JOBS
from marsupial_service.jobs.records import (
    STATE_OF,
    Analysed,
    Closed,
    Found,
    JobRecord,
    JobSettings,
    PackedRequest,
)
from marsupial_service.schemas.enums import JobEventType, JobOutcome, JobState
from marsupial_service.schemas.events import JobEndData, JobStateData
from marsupial_service.settings import ServiceLimits
from marsupial_service.store import Transaction, documents
from marsupial_service.store.tables import ENTRY_BYTES, ROW_BYTES
from marsupial_service.store.transaction import StoreReader
from marsupial_service.timestamps import timestamp

# the topic of jobs that wait to be claimed
QUEUE = "queue"
# with an owner's name, the document with the time when a job was last preempted for this owner, or one of theirs was
_PREEMPTIONS = "preemption/"
# budget of a job that was interrupted when its time was up
_LEAST_S = 0.1

_LONGEST_RETRY_S = 60
_LONGEST_DETAIL = 4000


@dataclass(frozen=True, slots=True, kw_only=True)
class NewJob(NewEntry):
    """A job to store."""

    request: PackedRequest


@dataclass(frozen=True, slots=True, kw_only=True)
class Claim:
    """An attempt at a job: the worker's input, and the `term` that the attempt needs to change the job."""

    number: int
    id: str
    owner: str
    term: int
    attempt: int
    planner: str
    budget: Budget
    source: bytes
    start: Plan | None


def insert(
    tx: Transaction, job: NewJob, settings: JobSettings, capacity: StoreCapacity, now_ms: int
) -> Created[JobRecord]:
    """Store a job, or find the one that the same request created. Raises KeyReused, StoreFull, TooMany."""
    quota = Quota(settings.limits)

    def add() -> None:
        capacity.check(tx, job.owner)
        _check_queue(tx, job.owner, settings.limits)
        quota.check(tx, job.owner, quota.reserved_s(job.request.budget.seconds), now_ms)
        number = JOBS.add(
            tx,
            job,
            JobState.QUEUED,
            now_ms,
            planner=job.request.planner,
            seconds=job.request.budget.seconds,
            steps=job.request.budget.steps,
            queued_ms=now_ms,
            bytes=ENTRY_BYTES + ROW_BYTES + len(job.request.source),
        )
        tx.insert("payloads", job=number, source=job.request.source)
        _add_state_event(tx, number, now_ms)
        tx.news.add(QUEUE)

    return JOBS.create(tx, job, add)


def _check_queue(tx: Transaction, owner: str, limits: ServiceLimits) -> None:
    sql = "SELECT count(*), avg(seconds) FROM jobs WHERE state = ? AND finished_ms IS NULL"
    for more, values, most in (("", (), limits.queue), (" AND owner = ?", (owner,), limits.key_queue)):
        waiting, mean_s = tx.execute(sql + more, (JobState.QUEUED, *values)).fetchone()
        if waiting >= most:
            retry_s = math.ceil((mean_s or limits.steps_s) / limits.slots)
            raise queue_full(min(_LONGEST_RETRY_S, max(1, retry_s)), own_share=bool(more))


def interrupted(job: str) -> str:
    """Return the topic of a job's cancellation or preemption."""
    return f"{job}/interrupted"


def queue_full(retry_after_s: int, *, own_share: bool = False) -> TooMany:
    """Return the error for a refused job: too many wait, in all or (`own_share`) of this owner."""
    whose = "your part of the queue" if own_share else "the queue"
    return TooMany(f"{whose} is full; try again in {retry_after_s} s", retry_after_s)


def is_queued(reader: StoreReader) -> bool:
    sql = "SELECT 1 FROM jobs WHERE state = ? AND finished_ms IS NULL LIMIT 1"
    return reader.execute(sql, (JobState.QUEUED,)).fetchone() is not None


def claim(tx: Transaction, settings: JobSettings, now_ms: int) -> Claim | None:
    """Claim a job, if one waits: its state becomes running.

    Interrupted attempts have used up part of its budget. Planners that start from scratch get the whole budget again,
    unless all attempts together would take more than twice the budget.
    """
    number = scheduling.first(tx)
    if number is None:
        return None
    row = tx.execute(
        "SELECT number, id, owner, planner, seconds, steps, spent_ms, attempts, started_ms, source"
        " FROM jobs JOIN payloads ON job = number WHERE number = ?",
        (number,),
    ).fetchone()
    attempt = row["attempts"] + 1
    started_ms = now_ms if row["started_ms"] is None else row["started_ms"]
    JOBS.transition(tx, number, JobState.RUNNING, now_ms, attempts=attempt, started_ms=started_ms)
    term = JOBS.take_over(tx, number, claimed_ms=now_ms)
    _add_state_event(tx, number, now_ms)
    best = _best(tx, number)
    seconds = row["seconds"]
    if seconds is not None:
        all_s = 2 * seconds if row["planner"] in settings.restarting else seconds
        seconds = max(_LEAST_S, min(seconds, all_s - row["spent_ms"] / 1000))
    budget = Budget(seconds=seconds, steps=row["steps"])
    start = None if best is None else plan_of(json.loads(best[1]))
    return record_of(Claim, row, term=term, attempt=attempt, budget=budget, start=start)


def counts(reader: StoreReader) -> dict[str, Mapping[Any, int]]:
    """Return counts for operators by the names of their metrics."""
    sql = "SELECT owner, count(*) FROM jobs WHERE state = ? AND finished_ms IS NULL GROUP BY owner"
    return {
        "jobs": JOBS.counts(reader, "state", JobState),
        "job_outcomes": JOBS.counts(reader, "outcome", JobOutcome),
        "jobs_waiting": dict(map(tuple, reader.execute(sql, (JobState.QUEUED,)).fetchall())),
    }


def add_analysis(tx: Transaction, claim: Claim, analysed: Analysed) -> bool:
    """Store the analysis of the map; return whether it was in time."""
    if not is_running(tx, claim, tx.row_lock):
        return False
    sql = "UPDATE payloads SET situation = ?, places = ? WHERE job = ?"
    tx.execute(sql, (analysed.situation, analysed.places, claim.number))
    _add_bytes(tx, claim.number, len(analysed.situation) + len(analysed.places))
    return True


def add_plan(tx: Transaction, claim: Claim, found: Found, now_ms: int) -> bool:
    """Store a plan as the next revision; return whether it was in time and better than the last."""
    best = _best(tx, claim.number)
    # an attempt presumed dead may still send plans
    if not is_running(tx, claim, tx.row_lock) or (best is not None and found.score >= best[0]):
        return False
    revision, started_ms = tx.execute(
        "UPDATE jobs SET plans = plans + 1, first_plan_ms = coalesce(first_plan_ms, ?) WHERE number = ?"
        " RETURNING plans, started_ms",
        (now_ms, claim.number),
    ).fetchone()
    after_ms = max(0, now_ms - started_ms)
    tx.insert(
        "plans",
        job=claim.number,
        revision=revision,
        score=line(found.score),
        makespan_ms=found.makespan_ms,
        found_after_ms=after_ms,
        at_ms=now_ms,
        actions=found.actions,
        ipc=found.ipc,
    )
    _add_bytes(tx, claim.number, ROW_BYTES + len(found.actions) + len(found.ipc))
    head = {"revision": revision, "makespan_ms": found.makespan_ms, "found_after_ms": after_ms}
    data = text_with({**head, "at": timestamp(now_ms)}, actions=found.actions)  # as `JobPlanData`: they may be many
    JOBS.add_event(tx, claim.number, JobEventType.PLAN, data, now_ms)
    return True


def finish(
    tx: Transaction, claim: Claim, closed: Closed, settings: JobSettings, now_ms: int, took_ms: int | None = None
) -> bool:
    """Put a running job into its final state; return whether it was in time. `took_ms`: see `_charge`."""
    return is_running(tx, claim, tx.row_lock) and _end(tx, claim.number, closed, settings, now_ms, took_ms)


def cancel(tx: Transaction, job: str, settings: JobSettings, now_ms: int) -> JobRecord:
    """Cancel a job, unless its state is final already. Raises UnknownEntry."""
    number = JOBS.locked(tx, job).number
    _end(tx, number, Closed(outcome=JobOutcome.CANCELLED, detail="cancelled by a client"), settings, now_ms)
    tx.news.add(interrupted(job))
    return JOBS.existing(tx, job)


def requeue(
    tx: Transaction, claim: Claim, reason: str, settings: JobSettings, now_ms: int, took_ms: int | None = None
) -> bool:
    """Requeue a job whose attempt was lost, or end it if that was the last attempt; return whether it was requeued.

    With an empty `reason` this server ended the attempt: it does not count, but its time is charged (`took_ms`: see
    `_charge`).
    """
    return is_running(tx, claim, tx.row_lock) and _requeue(tx, claim.number, reason, settings, now_ms, took_ms)


def preempt(tx: Transaction, settings: JobSettings, now_ms: int) -> str | None:
    """Requeue a running job if an owner without running jobs has waited too long; return the job's id."""
    # servers decide one at a time, or each would preempt a job for the same owner
    tx.lock(_PREEMPTIONS)
    for owner in scheduling.starved_owners(tx, now_ms):
        # this owner may be about to get a slot, or has just lost one
        if now_ms - int(documents.text_of(tx, _PREEMPTIONS + owner) or "0") < scheduling.PATIENCE_MS:
            continue
        job = scheduling.preemptible(tx, now_ms, settings.restarting)
        if job is None:
            break
        for one in (owner, job["owner"]):
            documents.store_text(tx, _PREEMPTIONS + one, str(now_ms))
        _requeue(tx, job["number"], "", settings, now_ms)
        tx.news.add(interrupted(job["id"]))
        return str(job["id"])
    return None


def recover(
    tx: Transaction, settings: JobSettings, now_ms: int, ours: Collection[tuple[int, int]] | None = None
) -> None:
    """Requeue jobs that were running when their server died, as `requeue` does.

    Also requeue jobs of this server that are not among `ours` (number and term): the connection to the database broke
    right after the commit of the claim, so this server never learned of it and never began them.
    """
    sql = "SELECT number, term FROM jobs WHERE state = ? AND finished_ms IS NULL AND "
    orphaned = f"{sql}(holder IS NULL OR holder NOT IN ({tx.live})){tx.skip_locked}"
    for row in tx.execute(orphaned, (JobState.RUNNING,)).fetchall():
        _requeue(tx, row["number"], "the server ended during the attempt", settings, now_ms)
    if ours is not None:
        for row in tx.execute(f"{sql}holder = ?{tx.skip_locked}", (JobState.RUNNING, tx.server)).fetchall():
            if (row["number"], row["term"]) not in ours:
                tx.execute("UPDATE jobs SET claimed_ms = NULL WHERE number = ?", (row["number"],))
                _requeue(tx, row["number"], "", settings, now_ms)


def _best(tx: Transaction, number: int) -> tuple[Value, str] | None:
    row = tx.execute(
        "SELECT score, actions FROM plans WHERE job = ? ORDER BY revision DESC LIMIT 1", (number,)
    ).fetchone()
    return None if row is None else (tuple(json.loads(row["score"])), row["actions"])


def is_running(reader: StoreReader, claim: Claim, lock: str = "") -> bool:
    """Return whether an attempt is running: it is neither over nor superseded by another one."""
    sql = f"SELECT 1 FROM jobs WHERE number = ? AND state = ? AND term = ?{lock}"
    return reader.execute(sql, (claim.number, JobState.RUNNING, claim.term)).fetchone() is not None


def _requeue(
    tx: Transaction, number: int, reason: str, settings: JobSettings, now_ms: int, took_ms: int | None = None
) -> bool:
    (attempts,) = tx.execute("SELECT attempts FROM jobs WHERE number = ?", (number,)).fetchone()
    if reason and attempts >= settings.max_attempts:
        detail = f"given up after {attempts} attempts; in the last one, {reason}"
        _end(tx, number, Closed(outcome=JobOutcome.ENGINE_FAILED, detail=detail), settings, now_ms, took_ms)
        return False
    took_ms = _charge(tx, number, settings, now_ms, took_ms)
    counted = attempts if reason else attempts - 1
    JOBS.transition(tx, number, JobState.QUEUED, now_ms, attempts=counted, queued_ms=now_ms)
    if not reason:
        tx.execute("UPDATE jobs SET spent_ms = spent_ms + ? WHERE number = ?", (took_ms, number))
    _add_state_event(tx, number, now_ms)
    tx.news.add(QUEUE)
    return True


def _charge(tx: Transaction, number: int, settings: JobSettings, now_ms: int, took_ms: int | None) -> int:
    """Charge the owner of a job for the attempt that ends, if one is running; return how long it took, in ms.

    Only the server that ran the attempt knows `took_ms`. If another ends it (None), it is charged up to now.
    """
    row = tx.execute(
        "SELECT owner, seconds, claimed_ms FROM jobs WHERE number = ? AND state = ?", (number, JobState.RUNNING)
    ).fetchone()
    if row is None or row["claimed_ms"] is None:
        return 0
    quota = Quota(settings.limits)
    if took_ms is None:
        # at most the time that it can have taken: its server may have died long ago
        most_s = quota.required_s(row["seconds"]) + PREPARATION_S
        took_ms = max(0, round(min(now_ms - row["claimed_ms"], 1000 * most_s)))
    quota.charge(tx, row["owner"], took_ms, now_ms)
    return took_ms


def _end(
    tx: Transaction, number: int, closed: Closed, settings: JobSettings, now_ms: int, took_ms: int | None = None
) -> bool:
    _charge(tx, number, settings, now_ms, took_ms)
    state = STATE_OF[closed.outcome]
    detail = closed.detail.encode(errors="replace").decode()[:_LONGEST_DETAIL]
    bound_ms = closed.lower_bound_ms
    if not JOBS.transition(tx, number, state, now_ms, outcome=closed.outcome, detail=detail, lower_bound_ms=bound_ms):
        return False
    (plans,) = tx.execute("SELECT plans FROM jobs WHERE number = ?", (number,)).fetchone()
    at = timestamp(now_ms)
    end = JobEndData(state=state, outcome=closed.outcome, detail=detail, plans=plans, lower_bound_ms=bound_ms, at=at)
    JOBS.add_event(tx, number, JobEventType.END, text_of(end), now_ms)
    return True


def _add_bytes(tx: Transaction, number: int, more: int) -> None:
    tx.execute("UPDATE jobs SET bytes = bytes + ? WHERE number = ?", (more, number))


def _add_state_event(tx: Transaction, number: int, now_ms: int) -> None:
    row = tx.execute("SELECT state, attempts FROM jobs WHERE number = ?", (number,)).fetchone()
    state = JobStateData(state=row["state"], attempts=row["attempts"], at=timestamp(now_ms))
    JOBS.add_event(tx, number, JobEventType.STATE, text_of(state), now_ms)
