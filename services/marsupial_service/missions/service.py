"""Create and follow missions, and take their reports. Everything here runs in one event loop and never blocks."""

import asyncio
import logging
import threading
from collections.abc import Awaitable, Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from functools import partial
from typing import TypeVar

from marsupial.errors import Problem
from marsupial.model.grid import Grid
from marsupial.model.zones import DatedZone, ZoneChange
from marsupial_service.entries.records import Created, digest_of
from marsupial_service.entries.service import Entries
from marsupial_service.entries.slots import Slots
from marsupial_service.missions import process, table
from marsupial_service.missions.driver import Driver
from marsupial_service.missions.encoding import decode_brief, encode_brief, encode_input
from marsupial_service.missions.records import MissionRecord, MissionSettings
from marsupial_service.missions.room import open_missions
from marsupial_service.missions.state import (
    KEY_BYTES,
    CachedState,
    MissionState,
    MissionStates,
    ReportConflict,
    brief,
)
from marsupial_service.missions.supervisor import MissionSupervisor
from marsupial_service.missions.table import MISSIONS
from marsupial_service.missions.values import Control, MissionBrief, StoredReport
from marsupial_service.schemas.answers import LastReportsAnswer
from marsupial_service.store import Store, StoreError, Transaction, packing
from marsupial_service.store.engine import Connection

# missions per transaction, so that several servers share those of a dead one
_AT_A_TIME = 4

log = logging.getLogger("marsupial.missions")

T = TypeVar("T")


class Missions(Entries[MissionRecord]):
    """All missions of one store."""

    def __init__(self, store: Store, settings: MissionSettings, slots: Slots | None = None) -> None:
        super().__init__(store, MISSIONS, settings, settings.limits.kept_missions)
        self._settings = settings
        self._slots = slots or Slots(self._limits.missions)
        self._threads = ThreadPoolExecutor(2 * self._limits.missions, "mission")  # one receives, one sends
        self._supervisors: dict[str, MissionSupervisor] = {}
        self._creating: set[str] = set()
        self._left: set[str] = set()  # missions that this server can't continue
        self._states = MissionStates()
        # committed states, for the threads that read
        self._shown, self._showing = MissionStates(), threading.Lock()

    async def start(self) -> None:
        """Begin to take over open missions that other servers or an earlier run have left."""
        await self._begin((process.load_missions,))

    async def stop(self) -> None:
        """End streams and processes; open missions continue at the next start, or on another server."""
        self.begin_shutdown()
        for task in self.background.running:
            task.cancel()
        if self.background.running:
            await asyncio.wait(self.background.running)
        self._threads.shutdown(wait=False)
        with suppress(StoreError):
            await self.write(table.release_all)

    async def create(
        self, brief: MissionBrief, digest: bytes, *, owner: str, idempotency_key: str | None = None
    ) -> Created[MissionRecord]:
        """Store a mission and begin it, or find the one that an earlier request with the same key created.

        Raises TooMany, KeyReused, StoreError.
        """
        kept, packed = await asyncio.to_thread(_stored_form, brief)
        new = table.NewMission(
            owner=owner, key=idempotency_key, digest=digest, brief=kept, packed=packed, version=self._settings.version
        )
        return await asyncio.shield(asyncio.ensure_future(self._create(new)))

    async def free_simulations(self, owner: str) -> int:
        """Return how many simulated missions an owner may create now."""
        return (await self.read(lambda reader: open_missions(reader, owner))).free_simulations(self._limits)

    async def brief(self, record: MissionRecord) -> MissionBrief:
        known = self._states.brief(record.id)
        return await self.read(lambda reader: brief(reader, record)) if known is None else known

    async def reports(self, record: MissionRecord, sent: Sequence[StoredReport]) -> MissionRecord:
        """Store reports with their digests, all or none; return the mission once they are committed.

        Repeated reports change nothing. Raises ReportConflict, which names the faulty report (also if the mission is
        over), TooMany, StoreFull, StoreError.
        """
        if record.simulation is not None:
            text = "the service simulates the robots of this mission, so it accepts no reports"
            raise ReportConflict(Problem("", text))
        limits, capacity = self._limits, self._capacity
        return await self._write_to(
            record.id, lambda tx: table.add_reports(tx, self._states, record.id, sent, limits, capacity, self.now_ms())
        )

    async def control(
        self, record: MissionRecord, control: Control, idempotency_key: str | None = None
    ) -> MissionRecord:
        """Pause, resume or cancel a mission; with a key that such a request had before, change nothing.

        Raises KeyReused, ReportConflict (a mission that is over can only be cancelled), StoreError.
        """
        digest, mission = _wish_digest(control, idempotency_key), record.id
        if control is Control.CANCEL:
            found = await asyncio.shield(self.write(lambda tx: _cancel_if_left(tx, mission, self.now_ms())))
            if found.reason == table.LEFT:
                return found
        return await self._write_to(
            mission, lambda tx: table.add_control(tx, self._states, mission, control, digest, self.now_ms())
        )

    async def change_zone(
        self, record: MissionRecord, change: ZoneChange, idempotency_key: str | None = None
    ) -> tuple[DatedZone, ...]:
        """Change a zone of a mission, idempotent as `control`; return its zones.

        Raises KeyReused, ReportConflict (also if the mission is over), TooMany, StoreFull, StoreError.
        """
        digest = _wish_digest(change, idempotency_key)

        def changed(tx: Transaction) -> tuple[DatedZone, ...]:
            limits, capacity = self._limits, self._capacity
            return table.change_zone(tx, self._states, record.id, change, digest, limits, capacity, self.now_ms())

        return await self._write_to(record.id, changed)

    async def _write_to(self, mission: str, write: Callable[[Transaction], T]) -> T:
        """Run a write that needs the state of a mission.

        What is stored of a long mission is applied beforehand, as the thread that writes serves all missions.
        """
        prepared = None if self._states.brief(mission) is not None else await self._copy(mission)

        def written(tx: Transaction) -> T:
            if prepared is not None:
                self._states.add(mission, prepared)
            return write(tx)

        return await asyncio.shield(self.write(written))

    async def _copy(self, mission: str) -> CachedState:
        await self._catch_up(mission)

        def found(reader: Connection) -> CachedState:
            with self._showing:
                self._shown.of(reader, MISSIONS.existing(reader, mission))
                return self._shown.copy(mission)

        return await self.read(found)

    async def _catch_up(self, mission: str) -> None:
        """Apply what is stored of a mission to the state for readers, in steps: others read in between."""

        def step(reader: Connection) -> bool:
            with self._showing:
                return self._shown.advance(reader, MISSIONS.existing(reader, mission))

        while not await self.read(step):
            pass

    async def zones(self, record: MissionRecord) -> tuple[DatedZone, ...]:
        """Return the zones of a mission that hold or will."""
        return await self._on_state(record, lambda state: state.zones)

    async def log(self, record: MissionRecord) -> str:
        return await self.read(lambda reader: table.log(reader, record))

    async def known(self, record: MissionRecord) -> Grid:
        """Return the map after the last report."""
        frame, cells = await self._on_state(record, lambda state: (state.map.frame, state.map.cells.copy()))
        return frame.grid((await self.brief(record)).grid, cells)

    async def last_reports(self, record: MissionRecord) -> LastReportsAnswer:
        return await self._on_state(record, lambda state: LastReportsAnswer.of(state, robots=state.counts))

    async def _on_state(self, record: MissionRecord, read: Callable[[MissionState], T]) -> T:
        """Return the result of `read` on the state of a mission after its last report."""
        await self._catch_up(record.id)

        def found(reader: Connection) -> T:
            with self._showing:
                return read(self._shown.of(reader, MISSIONS.existing(reader, record.id)))

        return await self.read(found)

    async def _create(self, new: table.NewMission) -> Created[MissionRecord]:
        self._creating.add(new.id)
        try:
            created = await self.write(lambda tx: table.insert(tx, new, self._limits, self._capacity, self.now_ms()))
            if not created.replayed:
                self._open(created.record, new.brief)
        finally:
            self._creating.discard(new.id)
        return created

    async def _recover(self) -> None:
        await self._cancel_abandoned()
        while found := await self._take_over():
            for record in found:
                self._settings.resumed("takeover")
                try:
                    brief = await self.brief(record)
                except StoreError:
                    raise
                except Exception as error:  # another version has stored it in a form that this one can't read
                    self.background.report("brief", error)
                    await self._leave(record, f"this server can't read its brief ({type(error).__name__})")
                else:
                    self._open(record, brief)

    async def _leave(self, record: MissionRecord, reason: str) -> None:
        """Leave a mission as it is to another server, or until it is cancelled."""
        log.error("mission left", extra={"mission": record.id, "reason": reason})
        self._left.add(record.id)
        await self.write_until_stored(lambda tx: table.leave(tx, record.id, record.term, reason, self.now_ms()))

    def _take_over(self) -> Awaitable[tuple[MissionRecord, ...]]:
        ours = frozenset(self._supervisors) | self._creating
        left = frozenset(self._left)
        return self.write(lambda tx: table.take_over_orphans(tx, _AT_A_TIME, ours, left))

    async def _cancel_abandoned(self) -> None:
        """Cancel missions that no longer get reports, or whose owner has no valid key left."""
        idle_s, now_ms = self._limits.idle_s, self.now_ms()
        for mission, owner, is_idle in await self.read(lambda r: table.abandoned(r, idle_s, now_ms)):
            if not self._settings.has_valid_key(owner):
                reason = "the mission's key has expired or was revoked"
            elif is_idle:
                reason = f"no report for {idle_s:g} s"
            else:
                continue
            await self.write(partial(table.cancel_abandoned, mission=mission, reason=reason, now_ms=now_ms))

    def _open(self, record: MissionRecord, brief: MissionBrief) -> None:
        simulation = record.simulation
        driver = None if simulation is None else Driver(simulation.speed, partial(self._store_simulated, record))
        supervisor = MissionSupervisor(
            record, brief, self, self._slots, self._threads, self._settings, driver, self._leave
        )
        self._supervisors[record.id] = supervisor
        # not restarted: `_recover` picks up a mission without a supervisor
        self._start("supervisor", partial(self._supervise, supervisor), restart=False)

    async def _store_simulated(self, record: MissionRecord, report: StoredReport) -> None:
        """Store a report of simulated robots, unless the mission is over or belongs to another server."""

        def add(tx: Transaction) -> None:
            if table.locked(tx, record.id, record.term) is not None:
                table.add_reports(tx, self._states, record.id, [report], self._limits, self._capacity, self.now_ms())

        await self._write_to(record.id, add)

    async def _supervise(self, supervisor: MissionSupervisor) -> None:
        try:
            await supervisor.run()
        finally:
            if not self.stopping and self._supervisors.get(supervisor.record.id) is supervisor:
                del self._supervisors[supervisor.record.id]


def _cancel_if_left(tx: Transaction, mission: str, now_ms: int) -> MissionRecord:
    """Cancel a mission if no server can continue it: its state, which this one may be unable to read, is not needed."""
    # locked, as another server may be about to continue it; a mission that is over stays as it is
    if MISSIONS.locked(tx, mission).reason:
        table.cancel_abandoned(tx, mission, table.LEFT, now_ms)
    return MISSIONS.existing(tx, mission)


def _wish_digest(wish: Control | ZoneChange, key: str | None) -> bytes | None:
    """Return the digest by which a copy of an operator's request is recognised, None without an idempotency key.

    Its beginning is that of the key, by which another request with that key is recognised.
    """
    if key is None:
        return None
    return digest_of(key.encode())[:KEY_BYTES] + digest_of(encode_input(wish))[KEY_BYTES:]


def _stored_form(brief: MissionBrief) -> tuple[MissionBrief, bytes]:
    """Return a brief as every process of its mission reads it, and its stored text."""
    text = encode_brief(brief)
    return decode_brief(text), packing.pack(text)
