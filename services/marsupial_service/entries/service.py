"""The code that jobs and missions share while the service runs, in one event loop that never blocks."""

import asyncio
import logging
from collections import Counter
from collections.abc import AsyncGenerator, Awaitable, Callable, Iterator
from contextlib import contextmanager, suppress
from enum import StrEnum
from functools import partial
from typing import Generic, TypeVar

from marsupial.processes import launcher
from marsupial.processes.launcher import Preload
from marsupial_service.entries.background import BackgroundTasks, Work, pause
from marsupial_service.entries.capacity import StoreCapacity
from marsupial_service.entries.quota import PREPARATION_S, Quota
from marsupial_service.entries.records import E, EntrySettings, EventBatch, EventRecord
from marsupial_service.entries.table import EntryTable
from marsupial_service.store import Store, StoreError, Transaction
from marsupial_service.store.engine import Connection

# most events read at a time; fewer mean that there are no more
_BATCH = 64
_SWEEP_S = 30.0
_WATCH_S = 3.0
# pause before a write or read that must succeed is retried; the store logs the failure
RETRY_S = 1.0

T = TypeVar("T")
log = logging.getLogger("marsupial.entries")


class Subscriptions:
    """The subscribers of each topic, in one event loop: asyncio events that are set after a commit."""

    def __init__(self) -> None:
        self._events: dict[str, set[asyncio.Event]] = {}

    @contextmanager
    def subscribe(self, topic: str) -> Iterator[asyncio.Event]:
        """Provide an event that is set on news about `topic`; a waiting caller clears it before it reads."""
        event = asyncio.Event()
        self._events.setdefault(topic, set()).add(event)
        try:
            yield event
        finally:
            events = self._events[topic]
            events.discard(event)
            if not events:
                del self._events[topic]

    def listen_to(self, store: Store) -> None:
        """Notify subscribers of every commit from now on; call this in the event loop."""
        loop = asyncio.get_running_loop()

        def pass_on(topics: frozenset[str] | None) -> None:  # called in any thread, even after the loop has ended
            with suppress(RuntimeError):
                loop.call_soon_threadsafe(self.notify, topics)

        store.listen(pass_on)

    def notify(self, topics: frozenset[str] | None) -> None:
        """Notify the subscribers of these topics; None: of all topics."""
        for topic in self._events if topics is None else topics:
            for event in self._events.get(topic, ()):
                event.set()


class Entries(Generic[E]):
    """All entries of one kind in a store, which retains the `kept` newest that have ended.

    The tasks in `background` run as long as the service or an entry does.
    """

    def __init__(self, store: Store, table: EntryTable[E], settings: EntrySettings, kept: int) -> None:
        self._store = store
        self._table = table
        self._planned = settings.planned
        self._limits = limits = settings.limits
        self._kept = kept
        self._capacity = StoreCapacity(limits.store_bytes, limits.key_bytes)
        self.quota = Quota(limits)
        self._uncharged_ms = Counter[str]()  # used, but not yet stored as used
        self.now_ms = settings.now_ms
        self.subscriptions = Subscriptions()
        self._stop = asyncio.Event()
        self.background = BackgroundTasks(self._stop, settings.failed)

    async def of(self, owner: str | None, entry: str) -> E:
        """Return an entry of an owner (None: any); other owners can't learn that it exists. Raises UnknownEntry."""
        return await self.read(lambda reader: self._table.existing(reader, entry, owner))

    async def list(
        self, owner: str, *, limit: int = 50, before: str | None = None, state: StrEnum | None = None
    ) -> tuple[E, ...]:
        """Return an owner's entries, newest first: only those created before entry `before`, only those in `state`."""
        return await self.read(lambda reader: self._table.newest(reader, owner, limit, before, state))

    async def follow(self, entry: str, after: int = 0) -> AsyncGenerator[tuple[EventRecord, ...]]:
        """Yield the stored events after number `after`, then new ones, up to the last one or `stop`."""
        with self.subscriptions.subscribe(entry) as news:
            while not self.stopping:
                news.clear()
                batch = await self.read(partial(self._table.events, entry=entry, after=after, limit=_BATCH))
                if batch.events:
                    after = batch.events[-1].seq
                    yield batch.events
                if not batch.is_open:
                    return
                if len(batch.events) < _BATCH:
                    await news.wait()

    async def next_event(self, entry: str, after: int) -> EventBatch:
        """Return the stored event after number `after`, if there is one, and whether more may follow."""
        return await self.read(partial(self._table.events, entry=entry, after=after, limit=1))

    @property
    def stopping(self) -> bool:
        return self._stop.is_set()

    async def _begin(self, preload: tuple[Preload, ...]) -> None:
        """Subscribe to commits, preload what processes need, and start the background tasks."""
        self.subscriptions.listen_to(self._store)
        await asyncio.to_thread(launcher.warm_up, wait=False, preload=preload)
        self._start("take up", self._watch)
        self._start("sweep", self._sweep)

    def begin_shutdown(self) -> None:
        """End streams and begin nothing new: `stop` will follow."""
        self._stop.set()
        self.subscriptions.notify(None)

    def charge(self, owner: str, planned_s: float) -> None:
        """Charge an owner for planning in the background, so that nobody has to wait."""
        self._planned(owner, planned_s)
        if self.quota.is_bounded:
            planned_ms = round(1000 * planned_s)
            self._uncharged_ms[owner] += planned_ms
            self._start("charge", partial(self._charge_later, owner, planned_ms), restart=False)

    async def check_quota(self, owner: str) -> None:
        """Raise TooMany if an owner has used up their quota, so that even short work may not begin."""
        if self.quota.is_bounded:
            uncharged_s = self._uncharged_ms[owner] / 1000
            now_ms = self.now_ms()
            await self.read(lambda reader: self.quota.check(reader, owner, PREPARATION_S, now_ms, uncharged_s))

    async def _charge_later(self, owner: str, planned_ms: int) -> None:
        try:
            await self._charge(owner, planned_ms)
        finally:
            self._uncharged_ms[owner] -= planned_ms

    async def _charge(self, owner: str, planned_ms: int) -> None:
        await self.write_until_stored(lambda tx: self.quota.charge(tx, owner, planned_ms, self.now_ms()))

    def _start(self, what: str, work: Work, *, restart: bool = True) -> asyncio.Task[None]:
        """Start a background task; metrics and the log name it by the kind of entry and `what`."""
        return self.background.start(f"{self._table.noun} {what}", work, restart=restart)

    async def _recover(self) -> None:
        """Take over the entries that dead servers have left. Raises StoreError."""
        raise NotImplementedError

    async def _watch(self) -> None:
        """Take over entries of other servers: on a goodbye message, and by polling, as a killed server sends none."""
        with self.subscriptions.subscribe(self._table.orphaned_topic) as news:
            while not self.stopping:
                news.clear()
                pause_s = _WATCH_S
                try:
                    await self._recover()
                except StoreError:
                    pause_s = RETRY_S
                await pause(news, pause_s)

    async def _sweep(self) -> None:
        """Remove old entries now and then and free their space, in small steps so that others can write."""
        checkpointed = True
        while not self.stopping:
            removed = await self.write_until_stored(
                lambda tx: self._table.remove_old(tx, self._limits.retention_s, self._kept, self.now_ms())
            )
            more = await self.write_until_stored(lambda tx: tx.shrink())
            checkpointed = checkpointed and not removed and not more
            if removed or more:
                continue
            checkpointed = checkpointed or await asyncio.to_thread(self._store.checkpoint)
            await self._pause(_SWEEP_S if checkpointed else RETRY_S)

    async def write_until_stored(self, write: Callable[[Transaction], T]) -> T | None:
        """Run `write` in a transaction, and retry while the store fails; return None if it still fails at `stop`."""
        while True:
            with suppress(StoreError):
                return await self.write(write)
            if self.stopping:
                return None
            await self._pause(RETRY_S)

    async def _pause(self, seconds: float) -> None:
        await pause(self._stop, seconds)

    async def left_s(self) -> dict[str, float]:
        """Return the seconds of planning left for each owner who has used some."""
        return await self.read(lambda reader: self.quota.left_s(reader, self.now_ms()))

    def disk_bytes(self) -> Awaitable[int]:
        """Return how many bytes the store takes on disk."""
        return asyncio.wrap_future(self._store.disk_bytes())

    def write(self, write: Callable[[Transaction], T]) -> Awaitable[T]:
        """Run `write` in a transaction; return its result once that is on disk."""
        return asyncio.wrap_future(self._store.write(write))

    def read(self, read: Callable[[Connection], T]) -> Awaitable[T]:
        """Run `read` on a snapshot of the committed data."""
        return asyncio.wrap_future(self._store.read(read))
