"""Keeps one mission going: starts its process, hands it the inputs, stores what it makes of them, replaces it.

Whatever process there is gets all inputs from the first one. Turns that are stored must come out again as they are;
the ones after them are new, are stored, and only then told to anybody.
"""

from __future__ import annotations

import asyncio
import logging
import secrets
import sqlite3
import tempfile
from collections.abc import Awaitable, Callable, Iterator
from concurrent.futures import Executor, Future
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import TypeVar

from marsupial.errors import InternalError
from marsupial.processes import launcher as processes
from marsupial.processes.jobs import Ended, Ending, Job, Limits
from marsupial_service.missions import table, wire
from marsupial_service.missions.ledger import Ledger
from marsupial_service.missions.records import MissionRecord
from marsupial_service.missions.values import Brief, Call, Event, EventType, Next, Turn
from marsupial_service.store import Store, StoreError, Transaction

_MOST_DEATHS = 3
"""A process that dies so often by itself before it has made anything new is not started again."""

_MOST_KILLED = 20
"""The same where somebody else killed it."""

_PAUSE_S = 0.1
_WALL_S = 7 * 86400.0
_CONNECT_S = 120.0
_LAST_WORDS_S = 0.5
_RETRY_S = 1.0

T = TypeVar("T")
Line = tuple[asyncio.StreamReader, asyncio.StreamWriter]
log = logging.getLogger("marsupial.missions")


class Diverged(Exception):
    """A new process made something else of the same inputs: the mission can't be gone on with."""


class Exchange:
    """The socket that the processes of missions call back."""

    def __init__(self) -> None:
        self._folder = tempfile.TemporaryDirectory(prefix="marsupial-")
        self.address = str(Path(self._folder.name) / "missions")
        self._awaited: dict[bytes, asyncio.Future[Line]] = {}
        self._server: asyncio.Server | None = None

    async def start(self) -> None:
        """Listen."""
        self._server = await asyncio.start_unix_server(self._arrive, self.address)

    async def stop(self) -> None:
        """Listen no more."""
        if self._server is not None:
            self._server.close()
        self._folder.cleanup()

    @contextmanager
    def expected(self) -> Iterator[tuple[bytes, asyncio.Future[Line]]]:
        """Give what a process has to say first, and its line once it does, which is closed in the end."""
        token = secrets.token_bytes(wire.TOKEN_BYTES)
        line = self._awaited[token] = asyncio.get_running_loop().create_future()
        try:
            yield token, line
        finally:
            del self._awaited[token]
            line.cancel()
            if not line.cancelled():
                line.result()[1].close()

    async def _arrive(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        line = None
        try:
            with suppress(EOFError, OSError):
                line = self._awaited.get(await reader.readexactly(wire.TOKEN_BYTES))
        finally:
            if line is None or line.done():
                writer.close()
            else:
                line.set_result((reader, writer))


class Keeper:
    """One open mission."""

    def __init__(
        self,
        record: MissionRecord,
        brief: Brief,
        ledger: Ledger,
        store: Store,
        exchange: Exchange,
        threads: Executor,
        memory_bytes: int,
        now_ms: Callable[[], int],
    ) -> None:
        self.id = record.id
        self.ledger = ledger
        self.lock = asyncio.Lock()
        self.inputs = record.inputs
        self.turns = record.turns
        self._number = record.number
        self.brief = brief
        self._store = store
        self._exchange = exchange
        self._threads = threads
        self._memory_bytes = memory_bytes
        self._now_ms = now_ms
        self._came = asyncio.Event()

    def came(self) -> None:
        """Say that another input is stored."""
        self.inputs += 1
        self._came.set()

    async def keep(self) -> None:
        """Keep the mission going until it has ended."""
        failure = await self._go_on()
        while failure is not None:
            try:
                return await self._give_up(failure)
            except StoreError as error:
                await self._pause(error)

    async def _go_on(self) -> str | None:
        """Follow one process after the other; return why that leads nowhere, None if the mission has ended."""
        deaths = 0
        while True:
            before = self.turns
            try:
                ended = await self._live()
            except StoreError as error:
                await self._pause(error)
                continue
            except Exception as error:
                log.exception("a mission failed", extra={"mission": self.id})
                return str(error)
            if ended is None:
                return None
            log.warning("the process of a mission ended", extra={"mission": self.id, "reason": ended.detail})
            deaths = 1 if self.turns > before else deaths + 1
            if deaths >= (_MOST_KILLED if ended.ending is Ending.KILLED else _MOST_DEATHS):
                return ended.detail
            await asyncio.sleep(_PAUSE_S * (deaths - 1))

    async def _give_up(self, reason: str) -> None:
        await self._write(lambda tx: table.fail(tx, self.id, reason, self._now_ms()))

    async def _pause(self, error: StoreError) -> None:
        log.error("the store can't be used", extra={"mission": self.id, "reason": str(error)})
        await asyncio.sleep(_RETRY_S)

    async def _live(self) -> Ended | None:
        """Follow one process to its end; return None if it was the mission's end too."""
        with self._exchange.expected() as (token, line):
            call = Call(address=self._exchange.address, token=token, brief=self.brief)
            limits = Limits(wall_s=_WALL_S, memory_bytes=self._memory_bytes)
            run = await self._started(Job(function="marsupial_service.missions.host:run", argument=call, limits=limits))
            ended = asyncio.get_running_loop().run_in_executor(self._threads, _last, run)
            talk = asyncio.create_task(self._talk(line))
            try:
                await asyncio.wait((ended, talk), return_when=asyncio.FIRST_COMPLETED)
                await asyncio.wait((ended, talk), timeout=_LAST_WORDS_S)
            finally:
                talk.cancel()
                run.cancel()
                await asyncio.wait((ended, talk))
        error = EOFError() if talk.cancelled() else talk.exception()
        if error is not None and not isinstance(error, EOFError | OSError):
            raise error
        return None if error is None else await ended

    async def _started(self, job: Job) -> processes.Run:
        """Start a process; if that is cancelled meanwhile, the process is ended as soon as it is there."""
        starting = self._threads.submit(processes.run, job)
        try:
            return await asyncio.wrap_future(starting)
        except asyncio.CancelledError:
            starting.add_done_callback(_close)
            raise

    async def _talk(self, line: Awaitable[Line]) -> None:
        """Hand out inputs and take turns, until the last one."""
        async with asyncio.timeout(_CONNECT_S):
            reader, writer = await line
        try:
            number, due = 0, Next(input=None, decisions=await self._decisions(0))
            while True:
                writer.write(wire.pack(due))
                await writer.drain()
                turn: Turn = await wire.read(reader)
                await self._take(number, turn)
                if turn.over:
                    return
                number += 1
                due = await self._next(number)
        finally:
            writer.close()

    async def _take(self, number: int, turn: Turn) -> None:
        if number < self.turns:
            if await self._stored(number) != turn.events:
                raise Diverged(
                    f"what happened after report {number} can't be gone through again: it comes out different"
                )
            return
        async with self.lock:
            await self._write(lambda tx: table.add_turn(tx, self.id, number, turn, self._now_ms()))
            for event in turn.events:
                self.ledger.publish(event)
            self.turns = number + 1

    async def _next(self, number: int) -> Next:
        while self.inputs < number:
            self._came.clear()
            await self._came.wait()
        found = await self._read(lambda source: table.input_at(source, self._number, number))
        return Next(input=found, decisions=await self._decisions(number))

    async def _decisions(self, number: int) -> tuple[str, ...]:
        if number >= self.turns:
            return ()
        return tuple(event.data for event in await self._stored(number) if event.type is EventType.DECISION)

    async def _stored(self, number: int) -> tuple[Event, ...]:
        return await self._read(lambda source: table.turn_at(source, self._number, number))

    def _write(self, write: Callable[[Transaction], T]) -> Awaitable[T]:
        return asyncio.wrap_future(self._store.write(write))

    def _read(self, read: Callable[[sqlite3.Connection], T]) -> Awaitable[T]:
        return asyncio.wrap_future(self._store.read(read))


def _close(starting: Future[processes.Run]) -> None:
    if not starting.cancelled() and starting.exception() is None:
        starting.result().close()


def _last(run: processes.Run) -> Ended:
    """Wait for the end of a process."""
    for event in run:
        if isinstance(event, Ended):
            return event
    raise InternalError("a run ended without saying so")
