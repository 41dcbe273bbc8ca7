"""Missions: created, reported to, told about. Everything here runs in one event loop, and blocks nowhere."""

from __future__ import annotations

import asyncio
import uuid
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from contextlib import nullcontext

from marsupial_service.analyses.analysis import load_analysis
from marsupial_service.entries.records import Created, TooMany
from marsupial_service.entries.service import Entries
from marsupial_service.intake import analyses, jobs
from marsupial_service.missions import host, reading, table, telling
from marsupial_service.missions.keeper import Keeper
from marsupial_service.missions.ledger import Conflict, Ledger
from marsupial_service.missions.records import MissionPhase, MissionRecord, MissionSettings
from marsupial_service.missions.table import MISSIONS
from marsupial_service.missions.values import Brief, Report, Wish
from marsupial_service.moments import wall_clock_ms
from marsupial_service.store import Store, kept

PRELOAD = (load_analysis, host.load_missions, reading, telling, jobs, analyses)


class Missions(Entries[MissionRecord]):
    """All missions of one store."""

    def __init__(self, store: Store, settings: MissionSettings, now_ms: Callable[[], int] = wall_clock_ms) -> None:
        super().__init__(store, MISSIONS, settings, now_ms)
        self._settings = settings
        self._threads = ThreadPoolExecutor(2 * settings.missions, "mission")  # one listens, one talks
        self._keepers: dict[str, Keeper] = {}

    async def start(self) -> None:
        """Take up the missions that an earlier run left open. Raises StoreError."""
        await self._begin(PRELOAD)
        for mission in await self.read(table.open_missions):
            record = await self._existing(mission)
            self._open(record, await self.brief(record), await self.ledger(record))

    async def stop(self) -> None:
        """End streams and processes; open missions go on at the next start."""
        self.leave()
        for task in self._tasks:
            task.cancel()
        if self._tasks:
            await asyncio.wait(self._tasks)
        self._threads.shutdown(wait=False)

    async def create(
        self, brief: Brief, digest: bytes, *, owner: str, idempotency_key: str | None = None
    ) -> Created[MissionRecord]:
        """Store a mission and begin it, or find the one that an earlier request with the same key had made.

        Raises TooMany, KeyReused, StoreError.
        """
        packed = await asyncio.to_thread(kept.dumps, brief)
        new = table.NewMission(
            id=uuid.uuid4().hex, owner=owner, key=idempotency_key, digest=digest, brief=brief, packed=packed
        )
        return await asyncio.shield(asyncio.ensure_future(self._create(new)))

    async def brief(self, record: MissionRecord) -> Brief:
        """Return what a mission was created with."""
        keeper = self._keepers.get(record.id)
        return await self.read(lambda reader: table.brief(reader, record)) if keeper is None else keeper.brief

    async def report(self, record: MissionRecord, report: Report, digest: bytes) -> MissionRecord:
        """Take a report in; what is returned is committed. One that was taken before changes nothing.

        Raises Conflict (also where the mission is over), TooMany, StoreError.
        """
        return await asyncio.shield(asyncio.ensure_future(self._report(record, report, digest)))

    async def wish(self, record: MissionRecord, wish: Wish) -> MissionRecord:
        """Pause, resume or cancel a mission; asking twice is asking once.

        Raises Conflict (a mission that is over can only be cancelled), StoreError.
        """
        return await asyncio.shield(asyncio.ensure_future(self._wish(record.id, wish)))

    async def log(self, record: MissionRecord) -> str:
        """Return the mission log as far as there is one; where the map changed, of the time since."""
        lines = await self.read(lambda reader: table.log(reader, record))
        return "".join(f"{line}\n" for line in lines)

    async def ledger(self, record: MissionRecord) -> Ledger:
        """Return what is known of a mission, the map included; not to be changed."""
        keeper = self._keepers.get(record.id)
        return await self.read(lambda reader: table.ledger(reader, record)) if keeper is None else keeper.ledger

    async def counts(self) -> dict[MissionPhase, int]:
        """Return how many missions there are by state."""
        return await self.read(lambda reader: MISSIONS.counts(reader, "state", MissionPhase))

    async def _create(self, new: table.NewMission) -> Created[MissionRecord]:
        created = await self.write(lambda tx: table.insert(tx, new, self._settings, self.now_ms()))
        if not created.replayed:
            self._open(created.record, new.brief, Ledger(new.brief))
        return created

    async def _report(self, record: MissionRecord, report: Report, digest: bytes) -> MissionRecord:
        keeper = self._keepers.get(record.id)
        if keeper is None:
            if (await self.ledger(record)).is_repeat(report.n, digest):
                return record
            raise Conflict(table.over(await self._existing(record.id)))
        async with keeper.lock:
            if keeper.ledger.is_repeat(report.n, digest):
                return await self._existing(record.id)
            if keeper.inputs - keeper.turns >= self._settings.backlog:
                raise TooMany(f"{self._settings.backlog} reports wait for the planner")
            keeper.ledger.check(report)
            stored = await self.write(lambda tx: table.add_report(tx, record.id, report, digest, self.now_ms()))
            keeper.ledger.take(report, digest)
            keeper.came()
            return stored

    async def _wish(self, mission: str, wish: Wish) -> MissionRecord:
        keeper = self._keepers.get(mission)
        async with nullcontext() if keeper is None else keeper.lock:
            stored = await self.write(lambda tx: table.add_wish(tx, mission, wish, self.now_ms()))
            if keeper is not None and stored.inputs > keeper.inputs:
                keeper.came()
            return stored

    def _open(self, record: MissionRecord, brief: Brief, ledger: Ledger) -> None:
        keeper = Keeper(record, brief, ledger, self, self._threads, self._settings.memory_bytes)
        self._keepers[record.id] = keeper
        self._go(self._keep(keeper))

    async def _keep(self, keeper: Keeper) -> None:
        try:
            await keeper.keep()
        finally:
            if not self.stopping:
                del self._keepers[keeper.id]
