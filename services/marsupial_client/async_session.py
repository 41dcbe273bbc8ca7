"""Requests that are retried until they are answered, and streams that resume where they broke.

Every request to the service can be repeated: jobs and missions have keys, reports have numbers, and no other POST
changes anything the second time. `marsupial_client.http` decides which errors to retry, and when.
"""

import json
import math
from asyncio import sleep
from collections.abc import AsyncGenerator, Callable, Mapping
from contextlib import aclosing
from http import HTTPStatus
from time import monotonic
from typing import Any, cast

import httpx2

from marsupial_client.errors import Unreachable
from marsupial_client.events import END, Readers, event_of
from marsupial_client.http import (
    LONGEST_EVENT_BYTES,
    STABLE_STREAM_S,
    TRANSIENT,
    MalformedAnswer,
    Service,
    document_in,
    event_number,
    joined,
)


class AsyncSession:
    """The connections to one service."""

    def __init__(self, service: Service, http: httpx2.AsyncClient | None) -> None:
        self.service = service
        self._http = http or httpx2.AsyncClient(transport=service.transport(httpx2.AsyncHTTPTransport))

    async def close(self) -> None:
        """Close all connections."""
        await self._http.aclose()

    async def ask(
        self,
        method: str,
        path: str,
        body: object = None,
        headers: Mapping[str, str] | None = None,
        read: Callable[[httpx2.Response, str], Any] = document_in,
    ) -> Any:
        """Send a request until it is answered; return what `read` makes of the answer. Raises Refused, Unreachable."""
        # encoded once, so that every attempt sends the same bytes
        content = None if body is None else json.dumps(body).encode()
        pauses = self.service.pauses()
        while True:
            try:
                request = self.service.request(self._http, method, path, content, headers or {})
                return read(self.service.checked(await self._answer(request, path), path), path)
            except TRANSIENT as error:
                await sleep(pauses.after(error, monotonic()))

    async def events(self, path: str, readers: Readers, after: int) -> AsyncGenerator[Any, None]:
        """Yield the events of a stream after number `after`, each once and in order, up to its `end`.

        Raises Refused, Unreachable; ClientError if the data of an event is not JSON.
        """
        pauses = self.service.pauses()
        while True:
            opened = math.inf
            try:
                response = await self._http.send(self.service.stream_request(self._http, path, after), stream=True)
                try:
                    if not response.is_success:
                        await response.aread()
                    self.service.checked(response, path)
                    opened = monotonic()
                    if response.status_code == HTTPStatus.NO_CONTENT:
                        return  # nothing follows it
                    source = aiter(httpx2.EventSource(response, LONGEST_EVENT_BYTES))
                    async with aclosing(cast(AsyncGenerator[httpx2.ServerSentEvent, None], source)) as events:
                        async for frame in events:
                            number = event_number(frame)
                            if number <= after:
                                continue
                            after = number
                            pauses = self.service.pauses()
                            event = event_of(number, frame, readers, path)
                            if event is not None:
                                yield event
                            if frame.event == END:
                                return
                finally:
                    await response.aclose()
                raise MalformedAnswer("the stream ended early")
            except TRANSIENT as error:
                if monotonic() - opened >= STABLE_STREAM_S:
                    pauses = self.service.pauses()
                await sleep(pauses.after(error, monotonic()))

    async def _answer(self, request: httpx2.Request, path: str) -> httpx2.Response:
        """Send a request once. Raises Unreachable if the answer isn't complete when patience ends."""
        # httpx2's timeouts apply to each read: a server that sends a byte now and then would never time out
        patience_s = self.service.patience_s
        deadline = monotonic() + patience_s
        response = await self._http.send(request, stream=True)
        parts = []
        try:
            async for part in response.aiter_bytes():
                parts.append(part)
                if monotonic() > deadline:
                    raise Unreachable(f"{self.service.url} takes longer than {patience_s:g} s to answer {path}")
        finally:
            await response.aclose()
        return joined(response, parts)
