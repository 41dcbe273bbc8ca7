"""What passes between planning jobs and their callers: requests, records, events, settings.

Times are integer milliseconds since 1970 (UTC).
"""

from __future__ import annotations

import json
import zlib
from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import StrEnum

from marsupial.model.objective import Value
from marsupial.model.plan import Plan
from marsupial.model.planning import Budget
from marsupial_service.entries.records import EntrySettings, StoredEntry
from marsupial_service.schemas.words import JobOutcome, JobState
from marsupial_service.settings import ServiceLimits

STATE_OF: Mapping[JobOutcome, JobState] = {
    **dict.fromkeys(JobOutcome, JobState.FAILED),
    JobOutcome.OPTIMAL: JobState.SUCCEEDED,
    JobOutcome.SATISFICING: JobState.SUCCEEDED,
    JobOutcome.UNSOLVABLE: JobState.SUCCEEDED,
    JobOutcome.CANCELLED: JobState.CANCELLED,
}

FINAL = frozenset(STATE_OF.values())

MOVES: Mapping[StrEnum, frozenset[StrEnum]] = {
    JobState.QUEUED: frozenset({JobState.RUNNING, JobState.CANCELLED}),
    JobState.RUNNING: frozenset({JobState.QUEUED, *FINAL}),
    **dict.fromkeys(FINAL, frozenset[StrEnum]()),
}


@dataclass(frozen=True, slots=True, kw_only=True)
class PackedRequest:
    """A job as it is stored: `source` is the compressed JSON text that was sent, which its worker reads again.

    Two requests with one idempotency key must have the same `digest`.
    """

    planner: str
    budget: Budget
    digest: bytes
    source: bytes

    @classmethod
    def of(cls, *, planner: str, budget: Budget, digest: bytes, source: Mapping[str, object]) -> PackedRequest:
        """Pack a job."""
        packed = zlib.compress(json.dumps(source).encode(), 1)
        return cls(planner=planner, budget=budget, digest=digest, source=packed)


@dataclass(frozen=True, slots=True, kw_only=True)
class JobRecord(StoredEntry):
    """A job as it is stored; it has an `outcome` if and only if its state is final.

    It has more than one of `attempts` only if a process of it was killed or the server ended. Each of its `plans`
    improves on the one before; `makespan_ms` is that of the last, `lower_bound_ms` is what the planner proved.
    """

    state: JobState
    outcome: JobOutcome | None
    detail: str
    planner: str
    budget: Budget
    attempts: int
    plans: int
    makespan_ms: int | None
    lower_bound_ms: int | None
    queued_at_ms: int
    started_at_ms: int | None
    first_plan_at_ms: int | None

    @property
    def gap(self) -> float | None:
        """How much longer the best plan is than the bound, as a share of the plan; None where one is missing."""
        if self.makespan_ms is None or self.lower_bound_ms is None:
            return None
        return max(0, self.makespan_ms - self.lower_bound_ms) / self.makespan_ms if self.makespan_ms else 0.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Metrics:
    """Counts for operators: jobs in the store by state and by outcome, those that wait by owner, and slots in use."""

    states: Mapping[JobState, int]
    outcomes: Mapping[JobOutcome, int]
    waiting: Mapping[str, int]
    slots: int
    slots_in_use: int


@dataclass(frozen=True, slots=True, kw_only=True)
class JobSettings(EntrySettings):
    """Limits of jobs, and how they are run.

    A job is started up to `max_attempts` times if its processes or the server are killed. `commands` has the engine
    names of external planners (``cmd:...``) by the names that clients use.
    """

    max_attempts: int = 3
    commands: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True, slots=True, kw_only=True)
class WorkerTask:
    """One attempt at a job: its `source` as in `PackedRequest`, which must keep the `limits` of the service.

    `start` is the best plan of earlier attempts; only better ones are sent back.
    """

    source: bytes
    limits: ServiceLimits
    engine: str
    budget: Budget
    start: Plan | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Analysed:
    """What the worker found on a map: the situation and its places, both as JSON text."""

    situation: str
    places: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Found:
    """A plan that the checker accepts and that is better than all before it; its actions as JSON text, and as IPC."""

    score: Value
    makespan_ms: int
    actions: str
    ipc: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Closed:
    """How the job ended, according to its worker."""

    outcome: JobOutcome
    detail: str = ""
    lower_bound_ms: int | None = None
