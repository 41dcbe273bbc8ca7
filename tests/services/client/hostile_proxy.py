"""A proxy between client and server that cuts connections at random bytes, delays, answers 503 and sends twice."""

import asyncio
import itertools
import random
import threading
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from typing import Self

from patience import HANG_S
from talk import HOST

BUSY = b"HTTP/1.1 503 Service Unavailable\r\nRetry-After: 0\r\nContent-Length: 4\r\nConnection: close\r\n\r\nbusy"
FATES = ("busy", "twice", "twice", "relay", "relay", "relay", "relay", "relay")
"""What becomes of connections, in an order that is drawn; those that are relayed may be cut."""

_GONE = (OSError, asyncio.IncompleteReadError)

Ends = tuple[asyncio.StreamReader, asyncio.StreamWriter]


class HostileProxy:
    """Stands before the server at `port`; within a block it listens at `url`.

    `bytes_between_cuts` is the mean in each direction of a connection. `done` counts connections by what was done to
    them: `busy`, `twice`, `cut`.
    """

    def __init__(self, port: int, seed: int, bytes_between_cuts: int = 4000) -> None:
        self.done: Counter[str] = Counter()
        self._port = port
        self._draw = random.Random(seed)
        self._bytes_between_cuts = bytes_between_cuts
        self._fates = itertools.cycle(self._draw.sample(FATES, len(FATES)))
        self._loop = asyncio.new_event_loop()
        self._thread = threading.Thread(target=self._loop.run_forever)

    def __enter__(self) -> Self:
        self._thread.start()
        starting = asyncio.run_coroutine_threadsafe(asyncio.start_server(self._serve, HOST, 0), self._loop)
        self._server = starting.result(HANG_S)
        self.url = f"http://{HOST}:{self._server.sockets[0].getsockname()[1]}"
        return self

    def __exit__(self, *_: object) -> None:
        asyncio.run_coroutine_threadsafe(self._stop(), self._loop).result(HANG_S)
        self._loop.call_soon_threadsafe(self._loop.stop)
        self._thread.join(HANG_S)
        self._loop.close()

    async def _stop(self) -> None:
        self._server.close()
        others = asyncio.all_tasks() - {asyncio.current_task()}
        for task in others:
            task.cancel()
        await asyncio.gather(*others, return_exceptions=True)
        await asyncio.sleep(0.01)  # what was aborted is closed in the loop's next turns

    async def _serve(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        """Serve one connection in one of the ways."""
        fate = next(self._fates)
        with suppress(*_GONE), _aborted(writer):
            first = await _request(reader)
            if fate == "busy":
                self.done["busy"] += 1
                writer.write(BUSY)
                await writer.drain()
                await reader.read()  # until the client has closed: an abort could outrun the answer
                return
            if fate == "twice" and first.startswith(b"POST"):
                self.done["twice"] += 1
                await self._send_once_more(first)
            await self._relay(first, (reader, writer))

    async def _send_once_more(self, request: bytes) -> None:
        reader, writer = await asyncio.open_connection(HOST, self._port)
        with _aborted(writer):
            writer.write(request)
            await reader.readuntil(b"\r\n\r\n")

    async def _relay(self, first: bytes, client: Ends) -> None:
        """Pass bytes in both directions until one of them is cut."""
        reader, writer = await asyncio.open_connection(HOST, self._port)
        with _aborted(writer):
            writer.write(first)
            ways = [
                asyncio.ensure_future(way)
                for way in (self._pass_on(client[0], writer), self._pass_on(reader, client[1]))
            ]
            try:
                await asyncio.wait(ways, return_when=asyncio.FIRST_COMPLETED)
            finally:
                for way in ways:
                    way.cancel()
                await asyncio.gather(*ways, return_exceptions=True)

    async def _pass_on(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        left = int(self._draw.expovariate(1 / self._bytes_between_cuts))
        while chunk := await reader.read(self._draw.randint(1, 2000)):
            writer.write(chunk[:left])
            await writer.drain()
            left -= len(chunk)
            if left <= 0:
                self.done["cut"] += 1
                return
            await asyncio.sleep(self._draw.choice((0, 0, 0, 0.003)))


@contextmanager
def _aborted(writer: asyncio.StreamWriter) -> Iterator[None]:
    """Abort a connection after a block, however that ends."""
    try:
        yield
    finally:
        writer.transport.abort()


async def _request(reader: asyncio.StreamReader) -> bytes:
    head = await reader.readuntil(b"\r\n\r\n")
    lengths = [line.partition(b":")[2] for line in head.splitlines() if line.lower().startswith(b"content-length:")]
    return head + await reader.readexactly(int(lengths[0]) if lengths else 0)
