"""Accept, store, run and follow planning jobs.

Everything here runs in one event loop. Blocking work runs elsewhere: reads and writes in the store's threads, each
running job in its slot's thread, planning in separate processes. A job is claimed once a slot is free, as another
server might run it meanwhile. `scheduling` decides which job is next and which is preempted; `attempt` runs one.
"""

import asyncio
import logging
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack, suppress
from functools import partial
from typing import Any

from marsupial.errors import InternalError
from marsupial.planning import engines
from marsupial.processes import launcher
from marsupial_service.entries.records import Created
from marsupial_service.entries.service import RETRY_S, Entries
from marsupial_service.entries.slots import Slot, Slots
from marsupial_service.jobs import scheduling, table, work
from marsupial_service.jobs.attempt import Attempt, AttemptLost
from marsupial_service.jobs.lookup import JOBS
from marsupial_service.jobs.records import Closed, JobRecord, JobSettings, PackedRequest
from marsupial_service.schemas.enums import JobOutcome
from marsupial_service.store import Store, StoreError

# modules that all workers need, loaded before the fork
PRELOAD = (work.watch_compiling, *engines.PRELOAD, work.load_planners)

_BUSY_RETRY_S = 1
_STOP_S = 1.0
# pause between checks whether to preempt a running job, while others wait
_CHECK_S = 0.25

log = logging.getLogger("marsupial.jobs")


class Jobs(Entries[JobRecord]):
    """All planning jobs of one store."""

    def __init__(self, store: Store, settings: JobSettings, slots: Slots | None = None) -> None:
        super().__init__(store, JOBS, settings, settings.limits.kept_jobs)
        self._settings = settings
        self._slots = slots or Slots(self._limits.slots)
        self._threads = ThreadPoolExecutor(self._limits.slots, "job")
        self._attempts: set[Attempt] = set()
        self._ours: set[tuple[int, int]] = set()
        self._is_claiming = False
        self._storing = 0
        self._claiming = asyncio.Lock()

    async def start(self) -> None:
        """Recover the jobs that an earlier run left, and begin to run jobs."""
        await self._begin(PRELOAD)
        self._start("preempt", self._preempt)
        for _ in range(self._limits.slots):
            self._start("slot", self._slot)

    async def stop(self, grace_s: float = 2.0) -> None:
        """End streams and processes; running jobs go back into the queue and continue after the next start."""
        self.begin_shutdown()
        for attempt in self._attempts:
            attempt.cancel()
        if not self.background.running:
            return
        _, left = await asyncio.wait(self.background.running, timeout=min(_STOP_S, grace_s))
        if left:  # for example slots that wait for the fork server
            await asyncio.to_thread(launcher.shutdown)
            _, left = await asyncio.wait(left, timeout=grace_s)
        for task in left:
            task.cancel()
        self._threads.shutdown(wait=False)

    async def submit(
        self, request: PackedRequest, *, owner: str, idempotency_key: str | None = None
    ) -> Created[JobRecord]:
        """Store a job; return it once it is committed. Raises TooMany, KeyReused, StoreError."""
        if self._storing >= self._limits.queue:
            raise table.queue_full(_BUSY_RETRY_S)
        self._storing += 1
        try:
            job = table.NewJob(owner=owner, key=idempotency_key, digest=request.digest, request=request)
            return await self.write(lambda tx: table.insert(tx, job, self._settings, self._capacity, self.now_ms()))
        finally:
            self._storing -= 1

    async def cancel(self, job: str) -> JobRecord:
        """End a job, which keeps its best plan, unless it is over. Raises UnknownEntry, StoreError: it continues."""
        return await self.write(lambda tx: table.cancel(tx, job, self._settings, self.now_ms()))

    async def wait(self, job: str, seconds: float) -> JobRecord:
        """Return the job once it is over, or as it is after `seconds` or at `stop`. Raises UnknownEntry."""
        try:
            async with asyncio.timeout(seconds):
                with self.subscriptions.subscribe(job) as news:
                    while (record := await self.of(None, job)).finished_at_ms is None and not self.stopping:
                        await news.wait()
                        news.clear()
                    return record
        except TimeoutError:
            return await self.of(None, job)

    async def metrics(self) -> dict[str, Any]:
        """Return counts for operators by the names of their metrics."""
        return {"slots": self._slots.count, "slots_in_use": self._slots.in_use, **await self.read(table.counts)}

    async def _recover(self) -> None:
        ours = None if self._is_claiming else frozenset(self._ours)
        await self.write(lambda tx: table.recover(tx, self._settings, self.now_ms(), ours))

    async def _preempt(self) -> None:
        """Preempt jobs on any server for owners who have none running."""
        while await self._wait_for_queue():
            await self._pause(_CHECK_S)
            with suppress(StoreError):
                if not await self.read(lambda reader: scheduling.starved_owners(reader, self.now_ms())):
                    continue
                job = await self.write(lambda tx: table.preempt(tx, self._settings, self.now_ms()))
                if job is not None:
                    log.info("job preempted for another key", extra={"job": job})

    async def _slot(self) -> None:
        """Run jobs one after another, once the fork server is ready: waiting for it must not cost an attempt."""
        with suppress(InternalError):
            await asyncio.to_thread(launcher.warm_up)
        while not self.stopping:
            async with self._claiming:  # one slot at a time: otherwise all would wait for the same job
                claimed = await self._next_claimed()
            if claimed is not None:
                attempt, slot, held = claimed
                with held:
                    await self._run_claimed(attempt, slot)

    async def _next_claimed(self) -> tuple[Attempt, Slot, ExitStack] | None:
        """Wait for a job and a slot; only then claim a job, as it might run elsewhere by then. None at `stop`.

        Leaving the stack releases the slot.
        """
        while await self._wait_for_queue():
            with ExitStack() as held:
                slot = held.enter_context(self._slots.holding(await self._slots.for_job()))
                if not self.stopping and (claim := await self._claim()) is not None:
                    return Attempt(claim, self._store, self._settings), slot, held.pop_all()
        return None

    async def _wait_for_queue(self) -> bool:
        """Wait until there is a job in the queue, then return True; return False at `stop`."""
        with self.subscriptions.subscribe(table.QUEUE) as news:
            while not self.stopping:
                news.clear()
                if await self._is_queued():
                    return True
                await news.wait()
        return False

    async def _claim(self) -> table.Claim | None:
        """Claim a job, if one waits; from now on it is among this server's."""
        self._is_claiming = True
        try:
            claim = await self.write_until_stored(lambda tx: table.claim(tx, self._settings, self.now_ms()))
            if claim is not None:
                self._ours.add((claim.number, claim.term))
        finally:
            self._is_claiming = False
        return claim

    async def _is_queued(self) -> bool:
        with suppress(StoreError):
            return await self.read(table.is_queued)
        return True  # the attempt to claim a job waits for the store

    async def _run_claimed(self, attempt: Attempt, slot: Slot) -> None:
        """Run an attempt at a job and store how it ended."""
        claim = attempt.claim
        end = await self._attempt(attempt, slot)
        self._settings.planned(claim.owner, attempt.took_s)
        try:
            await self._store_end(attempt, end)
        except Exception as error:
            log.exception("the end of a job could not be stored", extra={"job": claim.id})
            await self._store_end(attempt, _failed(error))
        finally:
            self._ours.discard((claim.number, claim.term))

    async def _attempt(self, attempt: Attempt, slot: Slot) -> Closed | AttemptLost:
        claim = attempt.claim
        self._attempts.add(attempt)
        log.info("job started", extra={"job": claim.id, "attempt": claim.attempt, "planner": claim.planner})
        self._slots.allow_preemption(slot, attempt.cancel)
        watch = self._start("cancellation", partial(self._watch_cancellation, attempt))
        try:
            if self.stopping:
                attempt.cancel()
            return await asyncio.get_running_loop().run_in_executor(self._threads, attempt.run)
        except Exception as error:
            log.exception("job failed", extra={"job": claim.id})
            return _failed(error)
        finally:
            watch.cancel()
            slot.preempt = None
            self._attempts.discard(attempt)

    async def _watch_cancellation(self, attempt: Attempt) -> None:
        """Cancel an attempt when its job is cancelled or preempted, by any server."""
        with self.subscriptions.subscribe(table.interrupted(attempt.claim.id)) as news:
            while await self._is_running(attempt.claim):
                await news.wait()
                news.clear()
            attempt.cancel()

    async def _is_running(self, claim: table.Claim) -> bool:
        while True:
            with suppress(StoreError):
                return await self.read(lambda reader: table.is_running(reader, claim))
            await asyncio.sleep(RETRY_S)  # the job can't be cancelled while the store is unavailable

    async def _store_end(self, attempt: Attempt, end: Closed | AttemptLost) -> None:
        """Store how an attempt ended. Its time up to a cancellation is charged already; add the rest."""
        claim, took_ms = attempt.claim, round(1000 * attempt.took_s)
        if isinstance(end, Closed):
            in_time = await self.write_until_stored(
                lambda tx: table.finish(tx, claim, end, self._settings, self.now_ms(), took_ms)
            )
            if in_time:
                log.info("job ended", extra={"job": claim.id, "outcome": end.outcome.value})
        else:
            in_time = await self.write_until_stored(
                lambda tx: table.requeue(tx, claim, end.reason, self._settings, self.now_ms(), took_ms)
            )
            if in_time:
                why = end.reason or "the server is shutting down, or a mission needs the slot"
                log.warning("job interrupted", extra={"job": claim.id, "reason": why})
        if not in_time and self.quota.is_bounded:
            await self._charge(claim.owner, round(1000 * attempt.tail_s))


def _failed(error: Exception) -> Closed:
    return Closed(outcome=JobOutcome.ENGINE_FAILED, detail=f"internal error ({type(error).__name__})")
