"""Events of a job or mission as server-sent events: what is stored, word for word, then what comes, until its end.

A stream that is taken up after an event (``Last-Event-ID``) goes on with what an uninterrupted one would say.
"""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator
from contextlib import suppress
from typing import Any

from starlette.responses import StreamingResponse

from marsupial_service.entries import EventRecord, TooMany
from marsupial_service.state import State

KEEP_ALIVE_S = 15.0
BYE = b": the service is ending; take this stream up again later\n\n"


class EventStream(StreamingResponse):
    """An answer that is a stream of events."""

    media_type = "text/event-stream"


def frame(event: EventRecord) -> bytes:
    """Return an event as it is sent."""
    return f"id: {event.seq}\nevent: {event.type.value}\ndata: {event.data}\n\n".encode()


def stream(state: State, owner: str, events: AsyncIterator[EventRecord]) -> EventStream:
    """Return the answer that streams `events`.

    Raises
    ------
    TooMany
        If this owner has as many streams open as it may.
    """
    if state.streams[owner] >= state.settings.limits.streams:
        raise TooMany(f"at most {state.settings.limits.streams} streams at a time", retry_after_s=5)
    state.streams[owner] += 1
    headers = {"Cache-Control": "no-store", "X-Accel-Buffering": "no"}
    return _Counted(state, owner, _frames(state, events), headers)


class _Counted(EventStream):
    """A stream that counts as open until it is over, however that comes."""

    def __init__(self, state: State, owner: str, frames: AsyncIterator[bytes], headers: dict[str, str]) -> None:
        super().__init__(frames, headers=headers)
        self._state, self._owner = state, owner

    async def __call__(self, scope, receive, send) -> None:  # type: ignore[no-untyped-def]
        try:
            await super().__call__(scope, receive, send)
        finally:
            self._state.streams[self._owner] -= 1


async def _frames(state: State, events: AsyncIterator[EventRecord]) -> AsyncIterator[bytes]:
    yield b": events\n\n"
    leaving = asyncio.ensure_future(state.leaving.wait())
    coming: asyncio.Future[EventRecord] | None = None
    try:
        while True:
            coming = coming or asyncio.ensure_future(anext(events))
            both: set[asyncio.Future[Any]] = {coming, leaving}
            await asyncio.wait(both, timeout=KEEP_ALIVE_S, return_when=asyncio.FIRST_COMPLETED)
            if coming.done():
                with suppress(StopAsyncIteration):
                    event, coming = coming.result(), None
                    yield frame(event)
                    continue
                if state.leaving.is_set():
                    yield BYE
                return
            if leaving.done():
                yield BYE
                return
            yield b": still there\n\n"
    finally:
        leaving.cancel()
        if coming is not None:
            coming.cancel()
            with suppress(asyncio.CancelledError, StopAsyncIteration):
                await coming
        await events.aclose()  # type: ignore[attr-defined]
