"""A database proxy that can freeze a client after each statement of each transaction.

It reads the statements that pass. A freezing point is the sequence of a transaction's statements up to one of them:
two transactions with the same start share their first points. The proxy forwards the last statement and then drops
every byte in both directions: the database and others see a server that froze, or lost its network, while it holds
its locks.
"""

from __future__ import annotations

import asyncio
import re
import struct
import threading
import time
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

from marsupial_service.store import StoreError

FreezePoint = tuple[str, ...]
Act = Callable[[], object]

_SOCKET = ".s.PGSQL.5432"
_MANY_VALUES = re.compile(r"\$\d+(, \$\d+)*")
_PER_WRITE = "SAVEPOINT"
"""Starts each of the writes that are committed together; a point leaves out the writes before it."""

_READ_ONLY = "BEGIN ISOLATION LEVEL REPEATABLE READ READ ONLY"
_HOLD_NOTHING = ("SELECT", "LISTEN")
"""First words of statements that write nothing outside of a transaction."""

_END, _OF_CLIENT = ("COMMIT", "ROLLBACK"), "DEALLOCATE"


def after(begun: FreezePoint, sql: str) -> FreezePoint:
    """Return the point after one more statement; further rounds of a loop and different values are ignored."""
    sql = _MANY_VALUES.sub("?", " ".join(sql.split()))
    point = (*(begun[:1] if sql.startswith(_PER_WRITE) else begun), sql)
    for n in range(1, len(point) // 2 + 1):
        if point[-n:] == point[-2 * n : -n]:
            return point[:-n]
    return point


@dataclass(frozen=True, slots=True, kw_only=True)
class FrozenRow:
    """The statements after which a server froze, the time of the other's slowest write in s, and failures."""

    point: FreezePoint
    slowest_s: float
    failed: str

    def __str__(self) -> str:
        of = self.point[2 if len(self.point) > 2 else 0][:50]
        return f"{self.slowest_s:6.2f} s  {self.failed:12s} {len(self.point):2d} of {of:50s} {self.point[-1][:90]}"


class Proxy:
    """Proxies a database's socket in `folder`.

    Attributes
    ----------
    tried
        The points at which it froze, the last one last.
    seen
        All points that have passed.
    frozen
        Set while bytes are dropped.
    """

    def __init__(self, folder: Path, database: Path) -> None:
        self.tried: list[FreezePoint] = []
        self.seen: set[FreezePoint] = set()
        self.frozen = threading.Event()
        self._armed = False
        self._folder, self._database = folder, database
        self._writers: set[asyncio.StreamWriter] = set()
        self._loop = asyncio.new_event_loop()
        threading.Thread(target=self._loop.run_forever, daemon=True).start()
        asyncio.run_coroutine_threadsafe(self._listen(), self._loop).result()

    def through(self, url: str) -> str:
        """Return the address of a database through the proxy."""
        return url.replace(str(self._database), str(self._folder))

    def arm(self) -> None:
        """Freeze at the next point that was not tried yet."""
        self._armed = True

    def free(self) -> None:
        """Break all connections, and forward again."""
        self._armed = False
        asyncio.run_coroutine_threadsafe(self._break(), self._loop).result()

    async def _listen(self) -> None:
        await asyncio.start_unix_server(self._serve, self._folder / _SOCKET)

    async def _break(self) -> None:
        for writer in self._writers:
            writer.transport.abort()
        self._writers.clear()
        self.frozen.clear()

    async def _serve(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        there, back = await asyncio.open_unix_connection(str(self._database / _SOCKET))
        self._writers |= {writer, back}
        with suppress(OSError, asyncio.IncompleteReadError):
            await asyncio.gather(self._statements(reader, back), self._answers(there, writer))
        if not self.frozen.is_set():  # else the end of a connection is not forwarded either
            for one in (writer, back):
                one.transport.abort()
            self._writers -= {writer, back}

    async def _answers(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        while data := await reader.read(65536):
            if not self.frozen.is_set():
                writer.write(data)
        if not self.frozen.is_set():
            writer.transport.abort()

    async def _statements(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        """Forward messages of the client, see "Message Flow" and "Message Formats" of the PostgreSQL documentation."""
        head = await reader.readexactly(4)
        start_up = head + await reader.readexactly(struct.unpack("!i", head)[0] - 4)
        if not self.frozen.is_set():
            writer.write(start_up)
        prepared: dict[bytes, str] = {}
        sql, runs = "", False
        begun: FreezePoint = ()
        while True:
            head = await reader.readexactly(5)
            body = await reader.readexactly(struct.unpack("!i", head[1:])[0] - 4)
            if self.frozen.is_set():
                continue
            writer.write(head + body)
            kind = head[:1]
            if kind == b"Q":
                sql = body.rstrip(b"\0").decode()
            elif kind == b"P":
                name, text = body.split(b"\0")[:2]
                prepared[name] = text.decode()
            elif kind == b"B":
                sql = prepared[body.split(b"\0")[1]]
            runs = runs or kind in (b"Q", b"E")
            if runs and kind in (b"Q", b"S"):  # prepared statements do not run yet
                begun, runs = self._pass(begun, sql), False

    def _pass(self, begun: FreezePoint, sql: str) -> FreezePoint:
        """Record that a statement was forwarded, and freeze if it is due; return its transaction's new point."""
        if sql.startswith(_OF_CLIENT) or (not begun and sql.strip().startswith(_HOLD_NOTHING)):
            return begun
        point = after(begun, sql)
        if point[0] != _READ_ONLY:
            self.seen.add(point)
            if self._armed and point not in self.tried:
                self._armed = False
                self.tried.append(point)
                self.frozen.set()
        return point if point[0].startswith("BEGIN") and sql not in _END else ()


def rows_of(proxy: Proxy, made: Callable[[], tuple[Act, Act]]) -> Iterator[FrozenRow]:
    """Freeze one act at each of its statements, while another act does the same, or work that must continue.

    `made` returns two new acts each time.
    """
    while True:
        act, beside = made()
        proxy.arm()
        with ThreadPoolExecutor(1) as threads:
            stuck = threads.submit(act)
            while not proxy.frozen.wait(0.02):
                if stuck.done():
                    proxy.free()
                    return
            began_s, failed = time.monotonic(), ""
            try:
                beside()
            except StoreError as error:
                failed = str(error)
            yield FrozenRow(point=proxy.tried[-1], slowest_s=time.monotonic() - began_s, failed=failed)
            proxy.free()
            stuck.exception()  # the outcome of a frozen commit is unknown
