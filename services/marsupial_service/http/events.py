"""Events of a job or mission as server-sent events: what is stored, word for word, then what comes, until its end.

A stream that is taken up after an event (``Last-Event-ID``) continues as an uninterrupted one would.
"""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Callable
from contextlib import suppress
from functools import partial

from starlette.responses import StreamingResponse
from starlette.types import Receive, Scope, Send

from marsupial_service.entries.records import E, EventRecord, TooMany
from marsupial_service.entries.service import Entries
from marsupial_service.state import State

KEEP_ALIVE_S = 15.0
BYE = b": the service is ending; take this stream up again later\n\n"


class EventStream(StreamingResponse):
    """An answer that is a stream of events."""

    media_type = "text/event-stream"


class _Counted(EventStream):
    """Calls `close` once it is over, however that comes."""

    def __init__(self, frames: AsyncIterator[bytes], close: Callable[[], None]) -> None:
        super().__init__(frames, headers={"Cache-Control": "no-store", "X-Accel-Buffering": "no"})
        self._close = close

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Send it."""
        try:
            await super().__call__(scope, receive, send)
        finally:
            self._close()


def frame(event: EventRecord) -> bytes:
    """Return an event as it is sent."""
    return f"id: {event.seq}\nevent: {event.type.value}\ndata: {event.data}\n\n".encode()


def stream(state: State, owner: str, entries: Entries[E], entry: str, last_event_id: str | None) -> EventStream:
    """Return the answer that streams the events of an entry after the last one that was seen. Raises TooMany."""
    if state.streams[owner] >= state.settings.limits.streams:
        raise TooMany(f"at most {state.settings.limits.streams} streams at a time", retry_after_s=5)
    state.streams[owner] += 1
    return _Counted(_frames(entries, entry, int(last_event_id or 0)), partial(state.streams.subtract, (owner,)))


async def _frames(entries: Entries[E], entry: str, after: int) -> AsyncIterator[bytes]:
    yield b": events\n\n"
    events = entries.follow(entry, after)
    coming: asyncio.Future[EventRecord | None] | None = None
    try:
        while True:
            coming = coming or asyncio.ensure_future(_next(events))
            await asyncio.wait({coming}, timeout=KEEP_ALIVE_S)
            if not coming.done():
                yield b": still there\n\n"
                continue
            event, coming = coming.result(), None
            if event is None:
                break
            yield frame(event)
        if entries.stopping:
            yield BYE
    finally:
        if coming is not None:
            coming.cancel()
            with suppress(asyncio.CancelledError):
                await coming
        await events.aclose()


async def _next(events: AsyncIterator[EventRecord]) -> EventRecord | None:
    return await anext(events, None)
