"""Requests that are sent until they are answered, and streams that are taken up where they broke.

Every request of the service may be sent again: jobs and missions have keys, reports numbers, and what else is posted
changes nothing the second time. So whatever breaks, and whoever is busy, is tried again until the client's patience
ends, after pauses that grow, drawn at random so that a fleet does not come back all at once.
"""

from __future__ import annotations

import json
import math
import random
import re
from collections.abc import AsyncGenerator, Callable, Mapping
from contextlib import aclosing
from http import HTTPStatus
from typing import Any

import httpx2

from marsupial_client.errors import Busy, Unreachable, refusal
from marsupial_client.events import END
from marsupial_client.transports import TooSlow, Transport

FIRST_PAUSE_S = 0.1
LONGEST_PAUSE_S = 2.0
"""Between tries, where the service doesn't say by ``Retry-After``: a server that is back is found soon."""

MISSED_S = 1.5
"""After so long those who wait are told."""

LASTING_S = LONGEST_PAUSE_S
"""A stream that breaks after so long was a sound one: patience begins anew, and pauses are short again."""

SILENCE_S = 45.0
"""A stream that is silent for so long is dead: the service says every 15 s that it is still there."""


Missed = Callable[[Unreachable | Busy], object]
"""Told why the service is missed, each time that it is, once."""


class Broken(Exception):
    """An answer that ends before its time, or can't be what the service sent."""


TRANSIENT = (
    httpx2.TimeoutException,
    httpx2.NetworkError,
    httpx2.RemoteProtocolError,
    httpx2.ProxyError,
    httpx2.DecodingError,
    httpx2.SSEError,
    Broken,
    Busy,
)
"""What may go better the next time."""


class Conversation:
    """Talks to the service at `url`.

    Parameters
    ----------
    key
        The API key, if the service needs one.
    timeout_s
        How long to wait for a connection and for each part of an answer.
    patience_s
        How long to try, from when the service is first missed; also how long one answer may take to arrive whole.
    missed
        Told when it has been missed for a while (`MISSED_S`).
    """

    def __init__(
        self,
        transport: Transport,
        url: httpx2.URL,
        *,
        key: str | None,
        timeout_s: float,
        patience_s: float,
        missed: Missed | None = None,
    ) -> None:
        self.transport = transport
        self.url = str(url).rstrip("/")
        self.patience_s = patience_s
        self.missed = missed
        self._timeout_s = timeout_s
        self._headers = {} if key is None else {"Authorization": f"Bearer {key}"}

    async def ask(
        self, method: str, path: str, body: object = None, headers: Mapping[str, str] | None = None
    ) -> httpx2.Response:
        """Send a request until it is answered, and return the answer. Raises Refused, Unreachable."""
        content = None if body is None else json.dumps(body).encode()
        kind = {} if body is None else {"Content-Type": "application/json"}
        all_headers = {**self._headers, **kind, **(headers or {})}
        tries = _Tries(self)
        while True:
            try:
                request = self.transport.http.build_request(
                    method, self.url + path, content=content, headers=all_headers, timeout=self._timeout_s
                )
                response = await self.transport.send(request, self.transport.now() + self.patience_s)
                _check(response, path)
                return response
            except TooSlow as error:
                raise Unreachable(f"{self.url} takes longer than {self.patience_s:g} s to answer {path}") from error
            except TRANSIENT as error:
                await tries.again(error)

    async def document(
        self, method: str, path: str, body: object = None, headers: Mapping[str, str] | None = None
    ) -> Any:
        """Send a request and return the JSON it is answered. Raises Refused, Unreachable."""
        tries = _Tries(self)
        while True:
            response = await self.ask(method, path, body, headers)
            try:
                return response.json()
            except (ValueError, RecursionError):
                await tries.again(Broken(f"{path} is answered by what is no JSON"))

    async def frames(self, path: str, after: int = 0) -> AsyncGenerator[tuple[int, httpx2.ServerSentEvent], None]:
        """Yield the events of a stream after number `after`, each once and in order, up to its `end`.

        Raises Refused, Unreachable.
        """
        tries = _Tries(self)
        while True:
            opened = math.inf
            try:
                response = await self._open(path, after)
                opened = self.transport.now()
                try:
                    if response.status_code == HTTPStatus.NO_CONTENT:
                        return  # nothing more will come
                    async with aclosing(self.transport.frames(response)) as frames:
                        async for frame in frames:
                            number = _number(frame)
                            if number <= after:
                                continue
                            after = number
                            tries = _Tries(self)
                            yield number, frame
                            if frame.event == END:
                                return
                finally:
                    await self.transport.release(response)
                raise Broken("the stream ended before its time")
            except TRANSIENT as error:
                if self.transport.now() - opened >= LASTING_S:
                    tries = _Tries(self)
                await tries.again(error)

    async def _open(self, path: str, after: int) -> httpx2.Response:
        headers = {**self._headers, "Accept": "text/event-stream", "Last-Event-ID": str(after)}
        timeout = httpx2.Timeout(self._timeout_s, read=SILENCE_S)
        request = self.transport.http.build_request("GET", self.url + path, headers=headers, timeout=timeout)
        response = await self.transport.open(request)
        _check(response, path)
        return response


class _Tries:
    """How often something was tried, and for how long it may be tried again."""

    def __init__(self, conversation: Conversation) -> None:
        self._conversation = conversation
        self._failures = 0
        self._since: float | None = None
        self._told = False

    async def again(self, error: Exception) -> None:
        """Pause before the next try. Raises Unreachable or the Busy that `error` is if it is not worth while."""
        transport, missed = self._conversation.transport, self._conversation.missed
        now = transport.now()
        self._since = now if self._since is None else self._since
        left_s = self._since + self._conversation.patience_s - now
        asked_s = (error.retry_after_s or 0.0) if isinstance(error, Busy) else 0.0
        why = (
            error
            if isinstance(error, Busy)
            else Unreachable(f"{self._conversation.url} can't be reached ({_said(error)})")
        )
        if left_s <= 0 or asked_s > left_s:
            raise why from (None if why is error else error)
        if missed is not None and not self._told and (now - self._since >= MISSED_S or asked_s >= MISSED_S):
            self._told = True
            missed(why)
        longest_s = min(LONGEST_PAUSE_S, FIRST_PAUSE_S * 2**self._failures)
        self._failures += 1
        await transport.pause(min(left_s, max(asked_s, random.uniform(longest_s / 2, longest_s))))


def _said(error: Exception) -> str:
    """Return what an error says, in the middle of a sentence."""
    text = re.sub(r"^\[Errno -?\d+\] ", "", str(error)) or type(error).__name__
    return text[:1].lower() + text[1:] if text[1:2].islower() and " " in text else text


def _check(response: httpx2.Response, path: str) -> None:
    """Raise Refused unless the answer is one of success."""
    if not response.is_success:
        raise refusal(response.status_code, response.text, path, response.headers.get("Retry-After"))


def _number(frame: httpx2.ServerSentEvent) -> int:
    if not re.fullmatch(r"[0-9]{1,15}", frame.id):  # what the service takes as Last-Event-ID
        raise Broken("an event has no number")
    return int(frame.id)
