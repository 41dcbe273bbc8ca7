"""Events of a job or mission as server-sent events: first the stored ones, then new ones, until its end.

A stream that resumes after an event (``Last-Event-ID``) continues as an uninterrupted one would.
"""

import asyncio
import time
from collections.abc import AsyncIterator, Callable, Iterator, Sequence
from contextlib import suppress
from functools import partial

from starlette.responses import Response, StreamingResponse
from starlette.types import Receive, Scope, Send

from marsupial_service.entries.records import E, EventRecord, TooMany
from marsupial_service.entries.service import Entries
from marsupial_service.problems import HttpProblem
from marsupial_service.schemas.answers import ProblemDetailAnswer
from marsupial_service.state import State
from marsupial_service.store import StoreError

KEEP_ALIVE_S = 15.0
# pause between checks whether the key of a stream is still valid
KEY_S = 2.0

_CHUNK_BYTES = 16_384

NO_KEY = b": the key has expired or was revoked\n\n"
SHUTTING_DOWN = b": the service is shutting down; resume this stream later\n\n"
NO_STORE = b": the store can't be read; resume this stream later\n\n"


class EventStream(StreamingResponse):
    """An answer that is a stream of events."""

    media_type = "text/event-stream"


class _CountedStream(EventStream):
    """A stream that calls `close` once it is over, for whatever reason."""

    def __init__(self, frames: AsyncIterator[bytes], close: Callable[[], None]) -> None:
        # nginx would hold events back until its buffer is full
        super().__init__(frames, headers={"Cache-Control": "no-store", "X-Accel-Buffering": "no"})
        self._close = close

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        try:
            await super().__call__(scope, receive, send)
        finally:
            self._close()


async def stream(
    state: State, owner: str, is_valid: Callable[[], bool], entries: Entries[E], entry: str, last_event_id: str | None
) -> Response:
    """Return the answer that streams the events of an entry after the last one that was seen. Raises TooMany.

    The stream ends when the key of the request no longer `is_valid`.
    """
    after = int(last_event_id or 0)
    if last_event_id is not None:
        following = await entries.next_event(entry, after)
        # 204 makes a browser stop reconnecting; after an empty stream it would continue
        if not following.events and not following.is_open:
            return Response(status_code=204, headers={"Cache-Control": "no-store"})
        # a client that is ahead, as after a restore, must start again; a browser stops, and reports an error
        if after > following.stored:
            text = f"must be at most {following.stored}, the number of the last event, got {after}"
            raise HttpProblem("invalid", errors=[ProblemDetailAnswer(header="Last-Event-ID", detail=text)])
    if state.streams[owner] >= state.settings.limits.streams:
        raise TooMany(f"the limit of {state.settings.limits.streams} open event streams is reached", retry_after_s=5)
    state.streams[owner] += 1
    frames = _frames(entries, entry, after, is_valid)
    return _CountedStream(frames, partial(state.streams.subtract, (owner,)))


async def _frames(entries: Entries[E], entry: str, after: int, is_valid: Callable[[], bool]) -> AsyncIterator[bytes]:
    yield b": events\n\n"
    events = entries.follow(entry, after)
    pending: asyncio.Future[tuple[EventRecord, ...] | None] | None = None
    sent_s = checked_s = time.monotonic()
    try:
        while True:
            pending = pending or asyncio.ensure_future(_next(events))
            await asyncio.wait({pending}, timeout=KEY_S)
            now_s = time.monotonic()
            if now_s - checked_s >= KEY_S:
                checked_s = now_s
                if not is_valid():
                    yield NO_KEY
                    return
            if not pending.done():
                if now_s - sent_s >= KEEP_ALIVE_S:
                    sent_s = now_s
                    yield b": keep-alive\n\n"
                continue
            sent_s = now_s
            done, pending = pending, None
            try:
                found = done.result()
            except StoreError:
                yield NO_STORE
                return
            if found is None:
                break
            for chunk in _chunks(found):
                yield chunk
        if entries.stopping:
            yield SHUTTING_DOWN
    finally:
        if pending is not None:
            pending.cancel()
            with suppress(asyncio.CancelledError):
                await pending
        await events.aclose()


def _chunks(events: Sequence[EventRecord]) -> Iterator[bytes]:
    """Yield the bytes of events, many small ones at once, as each chunk costs as much as a small request."""
    chunk = b""
    for event in events:
        chunk += f"id: {event.seq}\nevent: {event.type.value}\ndata: {event.data}\n\n".encode()
        if len(chunk) >= _CHUNK_BYTES:
            yield chunk
            chunk = b""
    if chunk:
        yield chunk


async def _next(events: AsyncIterator[tuple[EventRecord, ...]]) -> tuple[EventRecord, ...] | None:
    return await anext(events, None)
