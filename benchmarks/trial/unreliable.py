"""An HTTP proxy that does to requests what networks and broken proxies do.

A request is answered late, sent on twice, sent on again much later, dropped before or after the service got it, or
answered with 502 before or after that; streams of events are cut. Every connection carries one request.
"""

from __future__ import annotations

import asyncio
import random
import re
import threading
from collections import Counter
from contextlib import suppress
from enum import StrEnum
from types import TracebackType
from typing import Self

_HOST = "127.0.0.1"
_BAD_GATEWAY = b"HTTP/1.1 502 Bad Gateway\r\nContent-Length: 0\r\nConnection: close\r\n\r\n"
_LATE_S = 0.3
_MUCH_LATER_S = 3.0
_STREAM_S = 5.0
"""The longest time that a request is held back, that a copy of one is, and that a stream lasts."""


class Injection(StrEnum):
    """What happens to a request."""

    DELAYED = "delayed"
    DOUBLED = "sent twice"
    REPEATED_LATER = "sent again later"
    DROPPED = "dropped"
    UNANSWERED = "answer dropped"
    REFUSED = "502"
    REFUSED_AFTER = "502 after the service got it"


class UnreliableProxy:
    """A proxy before the service at a port; `share` of the requests go wrong, as `seed` draws."""

    def __init__(self, port: int, share: float, seed: int) -> None:
        self._service = port
        self._share = share
        self._rng = random.Random(seed)
        self.injected: Counter[str] = Counter()
        self.requests = self.port = 0
        self._later: set[asyncio.Task[None]] = set()
        self._loop = asyncio.new_event_loop()
        self._ready = threading.Event()
        self._thread = threading.Thread(target=self._run, daemon=True)

    def __enter__(self) -> Self:
        self._thread.start()
        self._ready.wait()
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        self._loop.call_soon_threadsafe(self._loop.stop)
        self._thread.join()

    def _run(self) -> None:
        server = self._loop.run_until_complete(asyncio.start_server(self._serve, _HOST, 0))
        self.port = server.sockets[0].getsockname()[1]
        self._ready.set()
        self._loop.run_forever()
        server.close()
        for task in asyncio.all_tasks(self._loop):
            task.cancel()
        self._loop.run_until_complete(asyncio.sleep(0))
        self._loop.close()

    async def _serve(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        with suppress(OSError, asyncio.IncompleteReadError):
            head = await reader.readuntil(b"\r\n\r\n")
            length = re.search(rb"(?i)\r\ncontent-length: *(\d+)", head)
            body = await reader.readexactly(int(length[1])) if length else b""
            request = re.sub(rb"(?i)\r\nconnection: [^\r]*", b"", head)[:-2] + b"Connection: close\r\n\r\n" + body
            self.requests += 1
            if b"text/event-stream" in head:
                await self._stream(request, writer)
            else:
                writer.write(await self._answer(request))
            await writer.drain()
        writer.close()

    async def _answer(self, request: bytes) -> bytes:
        """Return the answer to a request; empty if none arrives."""
        injection = self._rng.choice(list(Injection)) if self._rng.random() < self._share else None
        self.injected[injection or "passed on"] += 1
        match injection:
            case Injection.DROPPED:
                return b""
            case Injection.REFUSED:
                return _BAD_GATEWAY
            case Injection.DELAYED:
                await asyncio.sleep(self._rng.uniform(0, _LATE_S))
            case Injection.DOUBLED:
                return (await asyncio.gather(self._ask(request), self._ask(request)))[0]
            case Injection.REPEATED_LATER:
                again = self._loop.create_task(self._again(request, self._rng.uniform(0, _MUCH_LATER_S)))
                self._later.add(again)
                again.add_done_callback(self._later.discard)
        answer = await self._ask(request)
        return {Injection.UNANSWERED: b"", Injection.REFUSED_AFTER: _BAD_GATEWAY}.get(injection, answer)  # type: ignore[arg-type]

    async def _again(self, request: bytes, after_s: float) -> None:
        await asyncio.sleep(after_s)
        with suppress(OSError):  # the service may be down
            await self._ask(request)

    async def _ask(self, request: bytes) -> bytes:
        reader, writer = await asyncio.open_connection(_HOST, self._service)
        writer.write(request)
        try:
            return await reader.read()
        finally:
            writer.close()

    async def _stream(self, request: bytes, writer: asyncio.StreamWriter) -> None:
        """Pass a stream of events on for some time, then cut it, also within an event."""
        reader, upstream = await asyncio.open_connection(_HOST, self._service)
        upstream.write(request)
        with suppress(TimeoutError):
            async with asyncio.timeout(self._rng.uniform(0, _STREAM_S)):
                while part := await reader.read(self._rng.randrange(1, 20_000)):
                    writer.write(part)
                    await writer.drain()
                upstream.close()
                return
        self.injected["stream cut"] += 1
        upstream.close()
