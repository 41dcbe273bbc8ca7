"""The values that planning jobs exchange with their callers: requests, records, events, settings.

Times are integer milliseconds since 1970 (UTC).
"""

from __future__ import annotations

import zlib
from collections.abc import Mapping, Set
from dataclasses import dataclass, field
from enum import StrEnum

from marsupial.model.objective import Value
from marsupial.model.plan import Plan
from marsupial.model.planning import Budget
from marsupial.planning.engines import PROCESSES
from marsupial_service.entries.records import EntrySettings, StoredEntry
from marsupial_service.schemas.enums import JobOutcome, JobState
from marsupial_service.settings import ServiceLimits

STATE_OF: Mapping[JobOutcome, JobState] = {
    **dict.fromkeys(JobOutcome, JobState.FAILED),
    JobOutcome.OPTIMAL: JobState.SUCCEEDED,
    JobOutcome.SATISFICING: JobState.SUCCEEDED,
    JobOutcome.UNSOLVABLE: JobState.SUCCEEDED,
    JobOutcome.CANCELLED: JobState.CANCELLED,
}

FINAL = frozenset(STATE_OF.values())

TRANSITIONS: Mapping[StrEnum, frozenset[StrEnum]] = {
    JobState.QUEUED: frozenset({JobState.RUNNING, JobState.CANCELLED}),
    JobState.RUNNING: frozenset({JobState.QUEUED, *FINAL}),
    **dict.fromkeys(FINAL, frozenset[StrEnum]()),
}


@dataclass(frozen=True, slots=True, kw_only=True)
class PackedRequest:
    """A job to store: `source` is the client's JSON text, compressed, which the worker parses again.

    Two requests with one idempotency key must have the same `digest`.
    """

    planner: str
    budget: Budget
    digest: bytes
    source: bytes

    @classmethod
    def of(cls, *, planner: str, budget: Budget, digest: bytes, text: bytes) -> PackedRequest:
        """Pack a job that was sent as `text`."""
        return cls(planner=planner, budget=budget, digest=digest, source=zlib.compress(text, 1))


@dataclass(frozen=True, slots=True, kw_only=True)
class JobRecord(StoredEntry):
    """A stored job; it has an `outcome` if and only if its state is final.

    `attempts` exceeds 1 only if a process of the job was killed or a server ended. Each of its `plans` improves on the
    one before; `makespan_ms` is that of the last plan, `lower_bound_ms` is the bound that the planner proved.
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
        """The gap between the best plan and the bound, as a share of the plan; None if either is missing."""
        if self.makespan_ms is None or self.lower_bound_ms is None:
            return None
        return max(0, self.makespan_ms - self.lower_bound_ms) / self.makespan_ms if self.makespan_ms else 0.0


@dataclass(frozen=True, slots=True, kw_only=True)
class JobSettings(EntrySettings):
    """Limits of jobs, and how to run them.

    A job is started up to `max_attempts` times if its processes or the server are killed. `commands` maps clients'
    names of external planners to their engine names (``cmd:...``).
    """

    max_attempts: int = 3
    commands: Mapping[str, str] = field(default_factory=dict)

    @property
    def restarting(self) -> Set[str]:
        """The planners that start from scratch after an interruption."""
        return PROCESSES | self.commands.keys()


@dataclass(frozen=True, slots=True, kw_only=True)
class WorkerTask:
    """One attempt at a job: its `source` as in `PackedRequest`, which must be within the `limits` of the service.

    `start` is the best plan of earlier attempts; the worker sends back only better ones.
    """

    source: bytes
    limits: ServiceLimits
    engine: str
    budget: Budget
    start: Plan | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Analysed:
    """The worker's analysis of a map: the situation and its places, both as JSON text."""

    situation: str
    places: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Found:
    """A valid plan that is better than all before it; its actions as JSON text, and as IPC."""

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
