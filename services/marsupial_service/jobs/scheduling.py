"""Scheduling: which job runs next, and which is preempted for an owner who has none running.

All servers of a store share one queue, the rows of `jobs` in state `queued`, and claim one job at a time, each in a
transaction. So no scheduler or leader is needed: each server with a free slot claims the first job.

    owners     running   waiting                  next
    ann        2         a3 a4 a5                 cat: none of hers run,
    bob        1         b2                       and she was served longest ago
    cat        0         c1 c2            ---->   c1
    dan        0         d1

Fair share: the owner with the fewest running jobs comes first, among equals the one served longest ago (`owners.served`
counts servings); each owner's oldest job runs first. A flood of jobs from one owner delays only that owner.

With that alone, a new owner would wait until running jobs use up their budgets, up to minutes. So a running job is
preempted (`preemptible`) once an owner without a running job has waited for `PATIENCE_MS`. It goes back into the queue
with its best plan and the rest of its budget. The victim is a job of an owner with the most running jobs: one that can
continue from its plan rather than one that must start from scratch, and of those the newest. An owner's only job is
spared until it has run for as long as all its earlier attempts together: so its time slices double, and
starting from scratch costs at most half of its time.

Missions do not wait in this queue. Their plannings take slots of their own server before any job, and preempt a job if
all slots are taken (`entries.slots`).
"""

from collections import Counter
from collections.abc import Collection, Sequence

from marsupial_service.schemas.enums import JobState
from marsupial_service.store import Transaction
from marsupial_service.store.engine import StoreRow
from marsupial_service.store.transaction import StoreReader

# how long an owner without a running job waits before another owner's job is preempted
PATIENCE_MS = 1000


def first(tx: Transaction) -> int | None:
    """Return the number of the next job, if one waits, and note that its owner was served."""
    sql = "SELECT number FROM jobs WHERE state = ? AND finished_ms IS NULL AND owner = ? ORDER BY number LIMIT 1"
    for owner in _waiting(tx):
        # another server may be claiming that job right now: the next one will do
        row = tx.execute(sql + tx.skip_locked, (JobState.QUEUED, owner)).fetchone()
        if row is not None:
            tx.execute(
                "INSERT INTO owners SELECT ?, coalesce(max(served), 0) + 1 FROM owners WHERE true"
                " ON CONFLICT (name) DO UPDATE SET served = excluded.served",
                (owner,),
            )
            return int(row["number"])
    return None


def _waiting(tx: Transaction) -> Sequence[str]:
    """Return the owners of waiting jobs, the next one to be served first."""
    counts = "SELECT owner, min(number) AS first, count(*) AS jobs FROM jobs WHERE state = ? AND finished_ms IS NULL"
    rows = tx.execute(
        f"SELECT waits.owner FROM ({counts} GROUP BY owner) AS waits"
        f" LEFT JOIN ({counts} GROUP BY owner) AS runs ON runs.owner = waits.owner"
        " LEFT JOIN owners ON owners.name = waits.owner"
        " ORDER BY coalesce(runs.jobs, 0), coalesce(owners.served, 0), waits.first",
        (JobState.QUEUED, JobState.RUNNING),
    )
    return [row["owner"] for row in rows]


def starved_owners(reader: StoreReader, now_ms: int) -> list[str]:
    """Return owners with no running job, none that just ended and one that has waited too long: longest wait first."""
    rows = reader.execute(
        "SELECT owner FROM (SELECT owner, min(queued_ms) AS since_ms FROM jobs WHERE finished_ms IS NULL GROUP BY owner"
        " HAVING sum(CASE WHEN state = ? THEN 1 ELSE 0 END) = 0) AS waits WHERE since_ms <= ? AND NOT EXISTS"
        " (SELECT 1 FROM jobs WHERE jobs.owner = waits.owner AND jobs.finished_ms > ?) ORDER BY since_ms",
        (JobState.RUNNING, now_ms - PATIENCE_MS, now_ms - PATIENCE_MS),
    )
    return [row["owner"] for row in rows.fetchall()]


def preemptible(tx: Transaction, now_ms: int, restarting: Collection[str]) -> StoreRow | None:
    """Return number and id of the running job to preempt for an owner who has none running, if there is one.

    Jobs with a budget in steps, or of the planners in `restarting`, would start from scratch.
    """
    rows = tx.execute(
        "SELECT number, id, owner, planner, steps, claimed_ms, spent_ms FROM jobs"
        f" WHERE state = ? AND finished_ms IS NULL AND claimed_ms IS NOT NULL{tx.skip_locked}",
        (JobState.RUNNING,),
    ).fetchall()
    running = Counter(row["owner"] for row in rows)
    most = max(running.values(), default=0)
    return max(
        (
            row
            for row in rows
            if running[row["owner"]] == most
            and (most > 1 or now_ms - row["claimed_ms"] >= max(PATIENCE_MS, row["spent_ms"]))
        ),
        key=lambda row: (row["steps"] is None and row["planner"] not in restarting, row["claimed_ms"]),
        default=None,
    )
