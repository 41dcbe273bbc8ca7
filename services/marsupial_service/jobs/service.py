"""Planning jobs: taken, kept, run, told about.

Everything here runs in one event loop. What blocks is elsewhere: writing and reading in the store's threads, following
a running job in a thread per slot, planning in processes of its own.
"""

from __future__ import annotations

import asyncio
import json
import logging
import pickle
import sqlite3
import time
import uuid
import zlib
from collections.abc import AsyncIterator, Awaitable, Callable
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from functools import partial
from typing import TypeVar

from marsupial.errors import InternalError
from marsupial.planning import engines
from marsupial.processes import launcher as processes
from marsupial_service.jobs import lookup, table, work
from marsupial_service.jobs.attempt import Attempt, Lost
from marsupial_service.jobs.messages import Closed
from marsupial_service.jobs.news import News
from marsupial_service.jobs.records import (
    FINAL,
    AnalysisRecord,
    EventRecord,
    EventType,
    JobOutcome,
    JobRecord,
    JobRequest,
    JobSettings,
    JobState,
    Metrics,
    PlanRecord,
    QueueFull,
    Submitted,
)
from marsupial_service.jobs.warm import load_planners
from marsupial_service.store import Store, StoreError, Transaction

PRELOAD = (*engines.PRELOAD, work, load_planners)
"""What all workers need, loaded before they are forked."""

_BATCH = 64
_SWEEP_S = 30.0
_RETRY_S = 1.0
_BUSY_RETRY_S = 1
_HANG_S = 1.0

T = TypeVar("T")
log = logging.getLogger("marsupial.jobs")


def wall_clock_ms() -> int:
    """Return now, in ms since 1970."""
    return time.time_ns() // 1_000_000


class Jobs:
    """All planning jobs of one store.

    Parameters
    ----------
    now_ms
        The clock, in ms since 1970.
    """

    def __init__(self, store: Store, settings: JobSettings, now_ms: Callable[[], int] = wall_clock_ms) -> None:
        self._store = store
        self._settings = settings
        self._now_ms = now_ms
        self._news = News()
        self._stopping = False
        self._stop = asyncio.Event()
        self._work = asyncio.Event()
        self._tasks: list[asyncio.Task[None]] = []
        self._threads = ThreadPoolExecutor(settings.slots, "job")
        self._attempts: dict[str, Attempt] = {}
        self._storing = 0

    async def start(self) -> None:
        """Take up what an earlier run left, and begin to run jobs.

        Raises
        ------
        StoreError
            If that can't be stored.
        """
        self._news.attend(self._store)
        await self._write(lambda tx: table.recover(tx, self._settings, self._now_ms()))
        await asyncio.to_thread(partial(processes.warm_up, wait=False, preload=PRELOAD))
        self._tasks = [asyncio.create_task(self._slot()) for _ in range(self._settings.slots)]
        self._tasks.append(asyncio.create_task(self._sweep()))

    async def stop(self, grace_s: float = 2.0) -> None:
        """End streams and processes; jobs under way go back into the queue, to go on at the next start."""
        self._stopping = True
        self._stop.set()
        self._work.set()
        self._news.ring_all()
        for attempt in self._attempts.values():
            attempt.cancel()
        if not self._tasks:
            return
        _, left = await asyncio.wait(self._tasks, timeout=min(_HANG_S, grace_s))
        if left:  # such as those that wait for the fork server to become ready
            await asyncio.to_thread(processes.shutdown)
            _, left = await asyncio.wait(left, timeout=grace_s)
        for task in left:
            task.cancel()
        self._threads.shutdown(wait=False)

    async def submit(self, request: JobRequest, *, owner: str, idempotency_key: str | None = None) -> Submitted:
        """Store a job; what is returned is committed.

        Raises
        ------
        QueueFull
            If too many jobs wait.
        KeyReused
            If the key came with another request before.
        StoreError
            If it can't be stored.
        """
        if self._storing >= self._settings.queue:
            raise QueueFull(_BUSY_RETRY_S)
        self._storing += 1
        try:
            job = await asyncio.to_thread(_packed, request, owner, idempotency_key)
            submitted = await self._write(lambda tx: table.insert(tx, job, self._settings, self._now_ms()))
        finally:
            self._storing -= 1
        self._work.set()
        return submitted

    async def get(self, job: str, owner: str) -> JobRecord | None:
        """Return a job, or None if that owner has no such job."""
        return await self._read(lambda source: lookup.job(source, job, owner))

    async def list(
        self, owner: str, *, state: JobState | None = None, limit: int = 50, before: str | None = None
    ) -> tuple[JobRecord, ...]:
        """Return the jobs of an owner, the newest first, those made before job `before` only."""
        return await self._read(lambda source: lookup.jobs(source, owner, state, limit, before))

    async def plans(self, job: str) -> tuple[PlanRecord, ...]:
        """Return every revision, the first one first."""
        return await self._read(lambda source: lookup.plans(source, job))

    async def analysis(self, job: str) -> AnalysisRecord | None:
        """Return what was found on the map, or None (not yet, or a ready situation was sent)."""
        return await self._read(lambda source: lookup.analysis(source, job))

    async def source(self, job: str) -> str | None:
        """Return what was sent, as JSON text."""
        return await self._read(lambda source: lookup.source_text(source, job))

    async def cancel(self, job: str) -> JobRecord:
        """End a job, which keeps its best plan; one that is over stays as it is.

        Raises
        ------
        UnknownJob
            If there is none.
        StoreError
            If it can't be stored; the job goes on.
        """
        record = await self._write(lambda tx: table.cancel(tx, job, self._now_ms()))
        attempt = self._attempts.get(job)
        if attempt is not None:
            attempt.cancel()
        return record

    async def wait(self, job: str, seconds: float) -> JobRecord:
        """Return the job once it is over, or as it is after so many seconds or at `stop`.

        Raises
        ------
        UnknownJob
            If there is none.
        """
        try:
            async with asyncio.timeout(seconds):
                with self._news.bell(job) as bell:
                    while (record := await self._existing(job)).state not in FINAL and not self._stopping:
                        await bell.wait()
                        bell.clear()
                    return record
        except TimeoutError:
            return await self._existing(job)

    async def follow(self, job: str, after: int = 0) -> AsyncIterator[EventRecord]:
        """Yield the stored events after number `after`, then those to come; ends after `END` or at `stop`."""
        with self._news.bell(job) as bell:
            while not self._stopping:
                bell.clear()
                batch = await self._read(partial(lookup.events, job=job, after=after, limit=_BATCH))
                for event in batch.events:
                    after = event.seq
                    yield event
                    if event.type is EventType.END:
                        return
                if not batch.is_open:
                    return
                if not batch.events:
                    await bell.wait()

    async def metrics(self) -> Metrics:
        """Return counts for operators."""
        states, outcomes = await self._read(lookup.counts)
        return Metrics(
            states=states,
            outcomes=outcomes,
            slots=self._settings.slots,
            slots_in_use=len(self._attempts),
            following=self._news.listening,
        )

    async def _existing(self, job: str) -> JobRecord:
        return lookup.existing(await self._read(lambda source: lookup.job(source, job)), job)

    async def _slot(self) -> None:
        """Run one job after the other, once the fork server is ready: no attempt is to be lost by waiting for it."""
        with suppress(InternalError):
            await asyncio.to_thread(processes.warm_up)
        while not self._stopping:
            self._work.clear()
            claim = await self._surely(lambda tx: table.claim(tx, self._now_ms()))
            if claim is not None:
                await self._attend(claim)
            elif not self._stopping:
                await self._work.wait()

    async def _attend(self, claim: table.Claim) -> None:
        """Do an attempt at a job and store how it ended."""
        end = await self._attempt(claim)
        try:
            await self._settle(claim, end)
        except Exception as error:
            log.exception("the end of a job can't be stored", extra={"job": claim.id})
            await self._settle(claim, _failed(error))

    async def _attempt(self, claim: table.Claim) -> Closed | Lost:
        attempt = self._attempts[claim.id] = Attempt(claim, self._store, self._settings, self._now_ms)
        log.info("job started", extra={"job": claim.id, "attempt": claim.attempt, "planner": claim.planner})
        try:
            if self._stopping:
                attempt.cancel()
            return await asyncio.get_running_loop().run_in_executor(self._threads, attempt.run)
        except Exception as error:
            log.exception("job failed", extra={"job": claim.id})
            return _failed(error)
        finally:
            del self._attempts[claim.id]

    async def _settle(self, claim: table.Claim, end: Closed | Lost) -> None:
        """Store how an attempt ended."""
        if isinstance(end, Closed):
            in_time = await self._surely(lambda tx: table.finish(tx, claim, end, self._now_ms()))
            if in_time:
                log.info("job ended", extra={"job": claim.id, "outcome": end.outcome.value})
            return
        again = await self._surely(lambda tx: table.give_back(tx, claim, end.reason, self._settings, self._now_ms()))
        if again:
            log.warning("job interrupted", extra={"job": claim.id, "reason": end.reason or "the server stops"})
            self._work.set()

    async def _sweep(self) -> None:
        """Remove old jobs now and then."""
        while not self._stopping:
            removed = await self._surely(lambda tx: table.remove_old(tx, self._settings, self._now_ms()))
            if not removed:
                await self._pause(_SWEEP_S)

    async def _surely(self, write: Callable[[Transaction], T]) -> T | None:
        """Write, again and again while the disk refuses; None if that goes on until `stop`."""
        while True:
            try:
                return await self._write(write)
            except StoreError as error:
                log.error("the store can't be written", extra={"reason": str(error)})
            if self._stopping:
                return None
            await self._pause(_RETRY_S)

    async def _pause(self, seconds: float) -> None:
        with suppress(TimeoutError):
            async with asyncio.timeout(seconds):
                await self._stop.wait()

    def _write(self, write: Callable[[Transaction], T]) -> Awaitable[T]:
        return asyncio.wrap_future(self._store.write(write))

    def _read(self, read: Callable[[sqlite3.Connection], T]) -> Awaitable[T]:
        return asyncio.wrap_future(self._store.read(read))


def _failed(error: Exception) -> Closed:
    return Closed(outcome=JobOutcome.ENGINE_FAILED, detail=f"internal error ({type(error).__name__})")


def _packed(request: JobRequest, owner: str, key: str | None) -> table.NewJob:
    return table.NewJob(
        id=uuid.uuid4().hex,
        owner=owner,
        key=key,
        digest=request.digest,
        planner=request.planner,
        budget=request.budget,
        task=pickle.dumps(request.task, protocol=pickle.HIGHEST_PROTOCOL),
        source=zlib.compress(json.dumps(request.source).encode(), 1),
    )
