"""Planning jobs: taken, kept, run, told about."""

from __future__ import annotations

from collections.abc import AsyncIterator

from services.jobs.records import (
    AnalysisRecord,
    EventRecord,
    JobRecord,
    JobRequest,
    JobSettings,
    JobState,
    Metrics,
    PlanRecord,
    Submitted,
)
from services.store import Store


class Jobs:
    """All planning jobs of one store."""

    def __init__(self, store: Store, settings: JobSettings) -> None:
        raise NotImplementedError

    async def start(self) -> None:
        """Take up what an earlier run left, and begin to run jobs."""
        raise NotImplementedError

    async def stop(self, grace_s: float = 2.0) -> None:
        """End streams and processes; jobs under way go back into the queue, to go on at the next start."""
        raise NotImplementedError

    async def submit(self, request: JobRequest, *, owner: str, idempotency_key: str | None = None) -> Submitted:
        """Store a job; what is returned is committed. Raises QueueFull, KeyReused, StoreError."""
        raise NotImplementedError

    async def get(self, job: str, owner: str) -> JobRecord | None:
        """Return a job, or None if there is none of that owner."""
        raise NotImplementedError

    async def list(
        self, owner: str, *, state: JobState | None = None, limit: int = 50, before: str | None = None
    ) -> list[JobRecord]:
        """Return the jobs of an owner, the newest first, those before job `before` only."""
        raise NotImplementedError

    async def plans(self, job: str) -> list[PlanRecord]:
        """Return every revision, the first one first."""
        raise NotImplementedError

    async def analysis(self, job: str) -> AnalysisRecord | None:
        """Return what was found on the map, or None (not yet, or a ready situation was sent)."""
        raise NotImplementedError

    async def source(self, job: str) -> str | None:
        """Return what was sent, as JSON text."""
        raise NotImplementedError

    async def cancel(self, job: str) -> JobRecord:
        """End a job, which keeps its best plan; one that is over stays as it is. Raises UnknownJob."""
        raise NotImplementedError

    async def wait(self, job: str, seconds: float) -> JobRecord:
        """Return the job once it is over, or as it is after so many seconds. Raises UnknownJob."""
        raise NotImplementedError

    def follow(self, job: str, after: int = 0) -> AsyncIterator[EventRecord]:
        """Yield the events after number `after`, then those to come; ends after `END` or at `stop`."""
        raise NotImplementedError

    async def metrics(self) -> Metrics:
        """Return counts for operators."""
        raise NotImplementedError
