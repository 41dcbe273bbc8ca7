"""Missions: created, reported to, told about. Everything here runs in one event loop, and blocks nowhere."""

from __future__ import annotations

import asyncio
import pickle
import sqlite3
import uuid
from collections.abc import AsyncIterator, Awaitable, Callable
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from functools import partial
from typing import TypeVar

from marsupial.processes import launcher as processes
from marsupial_service.analysis import load_analysis
from marsupial_service.jobs.news import News
from marsupial_service.jobs.service import wall_clock_ms
from marsupial_service.missions import host, table
from marsupial_service.missions.keeper import Keeper
from marsupial_service.missions.ledger import Conflict, Ledger
from marsupial_service.missions.records import MissionEventRecord, MissionRecord, MissionSettings, TooMany
from marsupial_service.missions.values import Brief, EventType, Report, Wish
from marsupial_service.store import Store, StoreError, Transaction

PRELOAD = (load_analysis, host)

_BATCH = 64
_SWEEP_S = 60.0

T = TypeVar("T")


class Missions:
    """All missions of one store.

    Parameters
    ----------
    now_ms
        The clock, in ms since 1970.
    """

    def __init__(self, store: Store, settings: MissionSettings, now_ms: Callable[[], int] = wall_clock_ms) -> None:
        self._store = store
        self._settings = settings
        self._now_ms = now_ms
        self._news = News()
        self._stopping = False
        self._threads = ThreadPoolExecutor(2 * settings.missions, "mission")  # one listens, one talks
        self._keepers: dict[str, Keeper] = {}
        self._tasks: set[asyncio.Task[None]] = set()

    async def start(self) -> None:
        """Take up the missions that an earlier run left open.

        Raises
        ------
        StoreError
            If they can't be read.
        """
        self._news.attend(self._store)
        await asyncio.to_thread(partial(processes.warm_up, wait=False, preload=PRELOAD))
        for mission in await self._read(table.open_missions):
            record, ledger = await self._read(partial(_state, mission=mission))
            await self._open(record, ledger)
        self._go(self._sweep())

    async def stop(self) -> None:
        """End streams and processes; open missions go on at the next start."""
        self._stopping = True
        self._news.ring_all()
        for task in self._tasks:
            task.cancel()
        if self._tasks:
            await asyncio.wait(self._tasks)
        self._threads.shutdown(wait=False)

    async def create(
        self, brief: Brief, digest: bytes, *, owner: str, idempotency_key: str | None = None
    ) -> tuple[MissionRecord, bool]:
        """Store a mission and begin it; True if an earlier request with the same key had made it.

        Raises
        ------
        TooMany
            If too many are open.
        KeyReused
            If the key came with another request before.
        StoreError
            If it can't be stored.
        """
        packed = await asyncio.to_thread(pickle.dumps, brief, pickle.HIGHEST_PROTOCOL)
        new = table.NewMission(
            id=uuid.uuid4().hex, owner=owner, key=idempotency_key, digest=digest, brief=brief, packed=packed
        )
        return await asyncio.shield(asyncio.ensure_future(self._create(new)))

    async def get(self, mission: str, owner: str) -> MissionRecord | None:
        """Return a mission, or None if that owner has no such mission."""
        return await self._read(lambda source: table.find(source, mission, owner))

    async def list(self, owner: str, *, limit: int = 50, before: str | None = None) -> tuple[MissionRecord, ...]:
        """Return the missions of an owner, the newest first, those made before mission `before` only."""
        return await self._read(lambda source: table.missions(source, owner, limit, before))

    async def brief(self, record: MissionRecord) -> Brief:
        """Return what a mission was created with."""
        keeper = self._keepers.get(record.id)
        return await self._read(lambda source: table.brief(source, record)) if keeper is None else keeper.brief

    async def report(self, record: MissionRecord, report: Report, digest: bytes) -> MissionRecord:
        """Take a report in; what is returned is committed. One that was taken before changes nothing.

        Raises
        ------
        Conflict
            If it can't be true, is not the next one, or the mission is over.
        TooMany
            If too many reports wait.
        StoreError
            If it can't be stored.
        """
        return await asyncio.shield(asyncio.ensure_future(self._report(record, report, digest)))

    async def wish(self, record: MissionRecord, wish: Wish) -> MissionRecord:
        """Pause, resume or cancel a mission; asking twice is asking once.

        Raises
        ------
        Conflict
            If the mission is over, and `wish` is not to cancel it.
        StoreError
            If it can't be stored.
        """
        return await asyncio.shield(asyncio.ensure_future(self._wish(record.id, wish)))

    async def log(self, record: MissionRecord) -> str:
        """Return the mission log as far as there is one; where the map changed, of the time since."""
        lines = await self._read(lambda source: table.log(source, record))
        return "".join(f"{line}\n" for line in lines)

    async def ledger(self, record: MissionRecord) -> Ledger:
        """Return what is known of a mission, the map included; not to be changed."""
        keeper = self._keepers.get(record.id)
        return await self._read(lambda source: table.ledger(source, record)) if keeper is None else keeper.ledger

    async def follow(self, mission: str, after: int = 0) -> AsyncIterator[MissionEventRecord]:
        """Yield the stored events after number `after`, then those to come; ends after `END` or at `stop`."""
        with self._news.bell(mission) as bell:
            while not self._stopping:
                bell.clear()
                batch, is_open = await self._read(partial(table.events, mission=mission, after=after, limit=_BATCH))
                for event in batch:
                    after = event.seq
                    yield event
                    if event.type is EventType.END:
                        return
                if not is_open:
                    return
                if not batch:
                    await bell.wait()

    async def counts(self) -> dict[str, int]:
        """Return how many missions there are by state."""
        return await self._read(table.counts)

    async def _create(self, new: table.NewMission) -> tuple[MissionRecord, bool]:
        record, replayed = await self._write(lambda tx: table.insert(tx, new, self._settings, self._now_ms()))
        if not replayed:
            await self._open(record, Ledger(new.brief), new.brief)
        return record, replayed

    async def _report(self, record: MissionRecord, report: Report, digest: bytes) -> MissionRecord:
        keeper = self._keepers.get(record.id)
        if keeper is None:
            if (await self.ledger(record)).is_repeat(report.n, digest):
                return record
            raise Conflict(table.over(await self._read(lambda source: table.existing(source, record.id))))
        async with keeper.lock:
            if keeper.ledger.is_repeat(report.n, digest):
                return await self._read(lambda source: table.existing(source, record.id))
            if keeper.inputs - keeper.turns >= self._settings.backlog:
                raise TooMany(f"{self._settings.backlog} reports wait for the planner")
            keeper.ledger.check(report)
            stored = await self._write(lambda tx: table.add_report(tx, record.id, report, digest, self._now_ms()))
            keeper.ledger.take(report, digest)
            keeper.came()
            return stored

    async def _wish(self, mission: str, wish: Wish) -> MissionRecord:
        keeper = self._keepers.get(mission)
        if keeper is None:
            return await self._write(lambda tx: table.add_wish(tx, mission, wish, self._now_ms()))
        async with keeper.lock:
            stored = await self._write(lambda tx: table.add_wish(tx, mission, wish, self._now_ms()))
            if stored.inputs > keeper.inputs:
                keeper.came()
            return stored

    async def _open(self, record: MissionRecord, ledger: Ledger, brief: Brief | None = None) -> None:
        keeper = Keeper(
            record,
            await self.brief(record) if brief is None else brief,
            ledger,
            self._store,
            self._threads,
            self._settings.memory_bytes,
            self._now_ms,
        )
        self._keepers[record.id] = keeper
        self._go(self._keep(keeper))

    async def _keep(self, keeper: Keeper) -> None:
        try:
            await keeper.keep()
        finally:
            if not self._stopping:
                del self._keepers[keeper.id]

    def _go(self, work: Awaitable[None]) -> None:
        task = asyncio.ensure_future(work)
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)

    async def _sweep(self) -> None:
        """Remove old missions now and then."""
        while True:
            removed = 0
            with suppress(StoreError):
                removed = await self._write(lambda tx: table.remove_old(tx, self._settings, self._now_ms()))
            if not removed:
                await asyncio.sleep(_SWEEP_S)

    def _write(self, write: Callable[[Transaction], T]) -> Awaitable[T]:
        return asyncio.wrap_future(self._store.write(write))

    def _read(self, read: Callable[[sqlite3.Connection], T]) -> Awaitable[T]:
        return asyncio.wrap_future(self._store.read(read))


def _state(source: sqlite3.Connection, mission: str) -> tuple[MissionRecord, Ledger]:
    record = table.existing(source, mission)
    return record, table.ledger(source, record)
