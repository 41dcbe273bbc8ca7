"""The two ways to the service: one that blocks and one that awaits.

All that the client does is written once, as coroutines over a `Transport`. Those of a transport that blocks never
wait for anybody, so `finish` runs them to their end in one go.
"""

from __future__ import annotations

import asyncio
import threading
import time
from collections.abc import AsyncGenerator, Awaitable
from contextlib import AbstractAsyncContextManager, aclosing
from types import TracebackType
from typing import Protocol, TypeVar, cast

import httpx2

T = TypeVar("T")

_LONGEST_EVENT_BYTES = 64 * 2**20
"""A line of a mission log may tell of a whole map; the service takes bodies no larger than that."""


_OF_TRANSFER = frozenset({"content-encoding", "content-length", "transfer-encoding"})
"""Headers that say how an answer came, not what it is."""


class TooSlow(Exception):
    """An answer has begun, but not ended by the time that was set: its bytes come too slowly."""


class Transport(Protocol):
    """Sends requests; what breaks comes out as the exceptions of httpx2."""

    @property
    def http(self) -> httpx2.Client | httpx2.AsyncClient:
        """What it sends with."""
        ...

    async def send(self, request: httpx2.Request, until: float) -> httpx2.Response:
        """Return the answer. Raises TooSlow if it is not there by the time `until` of the clock."""
        ...

    async def open(self, request: httpx2.Request) -> httpx2.Response:
        """Return how a stream begins, and have `release` called after it; of a refusal, return the answer."""
        ...

    def frames(self, response: httpx2.Response) -> AsyncGenerator[httpx2.ServerSentEvent, None]:
        """Yield the events of a stream as they come."""
        ...

    async def release(self, response: httpx2.Response) -> None:
        """Let go of the connection of a stream."""
        ...

    def now(self) -> float:
        """Return the seconds of a clock that never goes back."""
        ...

    async def pause(self, seconds: float) -> None:
        """Do nothing for a time."""
        ...

    def lock(self) -> AbstractAsyncContextManager[object]:
        """Return a lock that keeps others who use the client out."""
        ...

    async def close(self) -> None:
        """Close all connections."""
        ...


class Waiting:
    """Awaits, in asyncio."""

    def __init__(self, http: httpx2.AsyncClient) -> None:
        self.http = http

    async def send(self, request: httpx2.Request, until: float) -> httpx2.Response:
        """Return the answer."""
        # timeouts of httpx2 are for each read: a byte now and then would go on for ever
        response = await self.http.send(request, stream=True)
        parts = []
        try:
            async for part in response.aiter_bytes():
                parts.append(part)
                if self.now() > until:
                    raise TooSlow
        finally:
            await response.aclose()
        return _whole(response, parts)

    async def open(self, request: httpx2.Request) -> httpx2.Response:
        """Return how a stream begins."""
        response = await self.http.send(request, stream=True)
        if not response.is_success:
            try:
                await response.aread()
            finally:
                await self.release(response)
        return response

    async def frames(self, response: httpx2.Response) -> AsyncGenerator[httpx2.ServerSentEvent, None]:
        """Yield the events of a stream."""
        events = aiter(httpx2.EventSource(response, _LONGEST_EVENT_BYTES))
        async with aclosing(cast(AsyncGenerator[httpx2.ServerSentEvent, None], events)):
            async for frame in events:
                yield frame

    async def release(self, response: httpx2.Response) -> None:
        """Let go of a stream."""
        await response.aclose()

    def now(self) -> float:
        """Return the time."""
        return time.monotonic()

    async def pause(self, seconds: float) -> None:
        """Let others go on meanwhile."""
        await asyncio.sleep(seconds)

    def lock(self) -> AbstractAsyncContextManager[object]:
        """Return a lock for tasks."""
        return asyncio.Lock()

    async def close(self) -> None:
        """Close all connections."""
        await self.http.aclose()


class Blocking:
    """Blocks the thread; several threads may use it."""

    def __init__(self, http: httpx2.Client) -> None:
        self.http = http

    async def send(self, request: httpx2.Request, until: float) -> httpx2.Response:
        """Return the answer."""
        response = self.http.send(request, stream=True)
        parts = []
        try:
            for part in response.iter_bytes():
                parts.append(part)
                if self.now() > until:
                    raise TooSlow
        finally:
            response.close()
        return _whole(response, parts)

    async def open(self, request: httpx2.Request) -> httpx2.Response:
        """Return how a stream begins."""
        response = self.http.send(request, stream=True)
        if not response.is_success:
            try:
                response.read()
            finally:
                response.close()
        return response

    async def frames(self, response: httpx2.Response) -> AsyncGenerator[httpx2.ServerSentEvent, None]:
        """Yield the events of a stream."""
        for frame in httpx2.EventSource(response, _LONGEST_EVENT_BYTES):
            yield frame

    async def release(self, response: httpx2.Response) -> None:
        """Let go of a stream."""
        response.close()

    def now(self) -> float:
        """Return the time."""
        return time.monotonic()

    async def pause(self, seconds: float) -> None:
        """Sleep."""
        time.sleep(seconds)

    def lock(self) -> AbstractAsyncContextManager[object]:
        """Return a lock for threads."""
        return _ThreadLock()

    async def close(self) -> None:
        """Close all connections."""
        self.http.close()


def _whole(response: httpx2.Response, parts: list[bytes]) -> httpx2.Response:
    """Return a streamed response with its decoded content."""
    headers = [(name, value) for name, value in response.headers.multi_items() if name.lower() not in _OF_TRANSFER]
    return httpx2.Response(response.status_code, headers=headers, content=b"".join(parts), request=response.request)


class _ThreadLock:
    def __init__(self) -> None:
        self._lock = threading.Lock()

    async def __aenter__(self) -> None:
        self._lock.acquire()

    async def __aexit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        self._lock.release()


def finish(work: Awaitable[T]) -> T:
    """Run a coroutine over a transport that blocks to its end."""
    try:
        next(work.__await__())
    except StopIteration as end:
        result: T = end.value
        return result
    raise AssertionError("a transport that blocks has nothing to wait for")
