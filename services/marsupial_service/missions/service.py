"""Missions: created, reported to, told about. Everything here runs in one event loop, and blocks nowhere."""

from __future__ import annotations

import asyncio
import threading
import uuid
from collections.abc import Awaitable, Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from functools import partial
from typing import TypeVar

from marsupial.errors import Problem
from marsupial.model.grid import Grid
from marsupial.processes.runner import LOCAL, Runner
from marsupial_service.analyses.analysis import load_analysis
from marsupial_service.entries.records import Created
from marsupial_service.entries.service import Entries
from marsupial_service.entries.slots import Slots
from marsupial_service.intake import analyses, jobs, simulations
from marsupial_service.missions import host, reading, table, telling
from marsupial_service.missions.driver import Driver
from marsupial_service.missions.keeper import Keeper
from marsupial_service.missions.ledger import Conflict, Ledger
from marsupial_service.missions.ledgers import Ledgers, brief
from marsupial_service.missions.records import LastReports, MissionCounts, MissionRecord, MissionSettings
from marsupial_service.missions.table import MISSIONS
from marsupial_service.missions.values import Brief, Report, SimulatedBrief, Told, Wish
from marsupial_service.moments import wall_clock_ms
from marsupial_service.store import Store, StoreError, kept, packing
from marsupial_service.store.engine import Connection

READERS = (load_analysis, reading, telling, jobs, analyses, simulations)
"""What analyses need, and those who read and write what is large: they work on the server itself in any case."""

PRELOAD = (*READERS, host.load_missions)
_AT_A_TIME = 4

T = TypeVar("T")


class Missions(Entries[MissionRecord]):
    """All missions of one store."""

    def __init__(
        self,
        store: Store,
        settings: MissionSettings,
        now_ms: Callable[[], int] = wall_clock_ms,
        runner: Runner = LOCAL,
        slots: Slots | None = None,
    ) -> None:
        super().__init__(store, MISSIONS, settings, now_ms, runner)
        self._settings = settings
        self._slots = slots or Slots(settings.missions)
        self._threads = ThreadPoolExecutor(2 * settings.missions, "mission")  # one listens, one talks
        self._keepers: dict[str, Keeper] = {}
        self._creating: set[str] = set()
        self._ledgers = Ledgers()
        self._shown, self._showing = Ledgers(), threading.Lock()  # of what is committed, for the threads that read

    async def start(self) -> None:
        """Begin to take up missions that are left open by others, or an earlier run."""
        await self._begin(PRELOAD)

    async def stop(self) -> None:
        """End streams and processes; open missions go on at the next start, or with another server."""
        self.leave()
        for task in self.background.running:
            task.cancel()
        if self.background.running:
            await asyncio.wait(self.background.running)
        self._threads.shutdown(wait=False)
        with suppress(StoreError):
            await self.write(table.leave)

    async def create(
        self, brief: Brief, digest: bytes, *, owner: str, idempotency_key: str | None = None
    ) -> Created[MissionRecord]:
        """Store a mission and begin it, or find the one that an earlier request with the same key had made.

        Raises TooMany, KeyReused, StoreError.
        """
        packed = await asyncio.to_thread(lambda: packing.pack(kept.dumps(brief)))
        new = table.NewMission(
            id=uuid.uuid4().hex, owner=owner, key=idempotency_key, digest=digest, brief=brief, packed=packed
        )
        return await asyncio.shield(asyncio.ensure_future(self._create(new)))

    async def brief(self, record: MissionRecord) -> Brief:
        """Return what a mission was created with."""
        known = self._ledgers.brief(record.id)
        return await self.read(lambda reader: brief(reader, record)) if known is None else known

    async def reports(self, record: MissionRecord, sent: Sequence[tuple[Report, bytes]]) -> MissionRecord:
        """Take reports in, with their digests: all of them, or none; what is returned is committed.

        Those that were taken before change nothing. Raises Conflict (also where the mission is over), which says whose
        fault it is, TooMany, StoreFull, StoreError.
        """
        if record.simulation is not None:
            raise Conflict(Problem("", "the robots of this mission are simulated by the service: it takes no reports"))
        ledgers, settings, room = self._ledgers, self._settings, self._room
        return await asyncio.shield(
            self.write(lambda tx: table.add_reports(tx, ledgers, record.id, sent, settings, self.now_ms(), room))
        )

    async def wish(self, record: MissionRecord, wish: Wish) -> MissionRecord:
        """Pause, resume or cancel a mission; asking twice is asking once.

        Raises Conflict (a mission that is over can only be cancelled), StoreError.
        """
        return await asyncio.shield(self.write(lambda tx: table.add_wish(tx, record.id, wish, self.now_ms())))

    async def log(self, record: MissionRecord) -> str:
        """Return the mission log as far as there is one."""
        lines = await self.read(lambda reader: table.log(reader, record))
        return "".join(f"{line}\n" for line in lines)

    async def known(self, record: MissionRecord) -> Grid:
        """Return the map after the last report."""

        frame, cells = await self._look(record, lambda ledger: (ledger.frame, ledger.cells.copy()))
        return frame.grid((await self.brief(record)).grid, cells)

    async def last_reports(self, record: MissionRecord) -> LastReports:
        """Return which reports were the last."""
        return await self._look(record, lambda ledger: LastReports(n=ledger.n, t_ms=ledger.t_ms, robots=ledger.counts))

    async def _look(self, record: MissionRecord, look: Callable[[Ledger], T]) -> T:
        """Return what `look` finds in the ledger of a mission, after its last report."""

        def found(reader: Connection) -> T:
            with self._showing:
                return look(self._shown.ledger(reader, MISSIONS.existing(reader, record.id)))

        return await self.read(found)

    async def counts(self) -> MissionCounts:
        """Return counts for operators."""
        return await self.read(table.counts)

    async def _create(self, new: table.NewMission) -> Created[MissionRecord]:
        self._creating.add(new.id)
        try:
            created = await self.write(
                lambda tx: table.insert(tx, new, self._settings, self.now_ms(), self._room, self.quota)
            )
            if not created.replayed:
                self._open(created.record, new.brief)
        finally:
            self._creating.discard(new.id)
        return created

    async def _take_up(self) -> None:
        await self._call_off()
        while found := await self._taken():
            for record in found:
                self._open(record, await self.brief(record))

    def _taken(self) -> Awaitable[tuple[MissionRecord, ...]]:
        ours = frozenset(self._keepers) | self._creating
        return self.write(lambda tx: table.take_up(tx, _AT_A_TIME, ours))

    async def _call_off(self) -> None:
        """Cancel missions that nobody reports to any more, or nobody may."""
        settings, now_ms = self._settings, self.now_ms()
        for mission, owner, is_idle in await self.read(lambda r: table.abandoned(r, settings.idle_s, now_ms)):
            if not settings.may_go_on(owner):
                reason = "its key has expired or was revoked"
            elif is_idle:
                reason = f"no report came for {settings.idle_s:g} s"
            else:
                continue
            await self.write(partial(table.call_off, mission=mission, reason=reason, now_ms=now_ms))

    def _open(self, record: MissionRecord, brief: Brief) -> None:
        driver = None
        if isinstance(brief, SimulatedBrief):
            driver = Driver(brief.speed, partial(self._simulated, record))
        keeper = Keeper(record, brief, self, self._slots, self._threads, self._runner, self._settings, driver)
        self._keepers[record.id] = keeper
        # not started again: a mission that nobody keeps is taken up by `_take_up`
        self._start("keeper", partial(self._keep, keeper), restart=False)

    async def _simulated(self, record: MissionRecord, told: Told) -> None:
        """Take in what simulated robots report, unless the mission is over or another server's."""
        ledgers, settings, room = self._ledgers, self._settings, self._room
        await self.write(lambda tx: table.add_simulated(tx, ledgers, record, told, settings, self.now_ms(), room))

    async def _keep(self, keeper: Keeper) -> None:
        try:
            await keeper.keep()
        finally:
            if not self.stopping and self._keepers.get(keeper.id) is keeper:
                del self._keepers[keeper.id]
