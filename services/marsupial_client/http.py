"""The HTTP code that both clients share: addresses, when to retry a request, and how to read answers.

Nothing here sends or waits: `AsyncSession` does, and `Session`, which is generated from it.
"""

import random
import re
from collections.abc import Callable, Mapping
from typing import Any, TypeVar

import httpx2

from marsupial_client.errors import Busy, Unreachable, refusal
from marsupial_client.proxies import proxy_for

# pause between attempts if the service sends no ``Retry-After``; short, to find a restarted server soon
FIRST_PAUSE_S = 0.1
LONGEST_PAUSE_S = 2.0
# time without the service before the callback `on_outage` is called
OUTAGE_S = 1.5
# after a stream has lasted this long, a break counts as the first failure: patience and pauses start anew
STABLE_STREAM_S = LONGEST_PAUSE_S
# a stream that is silent for this long is dead: the service sends a comment every 15 s
SILENCE_S = 45.0
# a line of a mission log may hold a joined map; the service accepts no larger bodies
LONGEST_EVENT_BYTES = 64 * 2**20
# headers that describe how an answer was sent, not its content
_TRANSFER_HEADERS = frozenset({"content-encoding", "content-length", "transfer-encoding"})

Http = httpx2.Client | httpx2.AsyncClient
T = TypeVar("T", httpx2.HTTPTransport, httpx2.AsyncHTTPTransport)

OutageCallback = Callable[[Unreachable | Busy], object]
"""A callback that gets the error, once per outage of the service."""


class MalformedAnswer(Exception):
    """An answer is truncated, or can't be what the service sent."""


TRANSIENT = (
    httpx2.TimeoutException,
    httpx2.NetworkError,
    httpx2.RemoteProtocolError,
    httpx2.ProxyError,
    httpx2.DecodingError,
    httpx2.SSEError,
    MalformedAnswer,
    Busy,
)
"""Errors that are worth another attempt."""


class RetryPauses:
    """The pauses between attempts at one request, until patience ends."""

    def __init__(self, fault: str, patience_s: float, on_outage: OutageCallback | None) -> None:
        self._fault = fault  # what to say if there is no answer
        self._patience_s = patience_s
        self._on_outage = on_outage
        self._failures = 0
        self._since: float | None = None

    def after(self, error: Exception, now: float) -> float:
        """Return the seconds to wait after a failure. Raises Unreachable, or `error` if it is Busy, at the end."""
        self._since = now if self._since is None else self._since
        left_s = self._since + self._patience_s - now
        asked_s = (error.retry_after_s or 0.0) if isinstance(error, Busy) else 0.0
        reason = error if isinstance(error, Busy) else Unreachable(f"{self._fault} ({_as_clause(error)})")
        if left_s <= 0 or asked_s > left_s:
            raise reason from (None if reason is error else error)
        if self._on_outage is not None and max(now - self._since, asked_s) >= OUTAGE_S:
            self._on_outage(reason)
            self._on_outage = None
        longest_s = min(LONGEST_PAUSE_S, FIRST_PAUSE_S * 2**self._failures)
        self._failures += 1
        # random, so that the robots of a fleet don't all come back at once
        return min(left_s, max(asked_s, random.uniform(longest_s / 2, longest_s)))


class Service:
    """Where a service is, and how to send it requests; the parameters are those of `AsyncClient`.

    `proxy` is the proxy that the environment names for it; None if there is none, or `http` brings its own.
    """

    def __init__(
        self,
        url: str,
        key: str | None,
        timeout_s: float,
        patience_s: float,
        on_outage: OutageCallback | None,
        http: Http | None,
    ) -> None:
        self.url = str(address(url)).rstrip("/")
        self.proxy = None if http is not None else proxy_for(self.url)
        self.patience_s = patience_s
        self._on_outage = on_outage
        self._timeout_s = timeout_s
        self._headers = {} if key is None else {"Authorization": f"Bearer {key}"}

    def pauses(self) -> RetryPauses:
        """Return the pauses for a new request."""
        fault = f"{self.url} can't be reached" + (f" through {self.proxy}" if self.proxy is not None else "")
        return RetryPauses(fault, self.patience_s, self._on_outage)

    def transport(self, kind: type[T]) -> T:
        """Return the connections to the service, through its proxy if it has one. Raises ProxyUnusable."""
        if self.proxy is None:
            return kind()
        try:
            return kind(proxy=self.proxy.url)
        except (ImportError, ValueError) as error:
            socks = "install what httpx2 needs for SOCKS (pip install 'httpx2[socks]')"
            raise self.proxy.unusable(socks if isinstance(error, ImportError) else str(error)) from error

    def checked(self, response: httpx2.Response, path: str) -> httpx2.Response:
        """Return an answer that succeeded. Raises Refused."""
        if response.is_success:
            return response
        # within a connection with TLS, nobody else can answer
        sender = "" if self.proxy is None or self.url.startswith("https:") else str(self.proxy)
        retry_after = response.headers.get("Retry-After")
        raise refusal(response.status_code, response.text, path, retry_after, sender)

    def request(
        self, http: Http, method: str, path: str, content: bytes | None, headers: Mapping[str, str]
    ) -> httpx2.Request:
        """Return a request with a body of JSON, or without a body."""
        kind = {} if content is None else {"Content-Type": "application/json"}
        own = {**self._headers, **kind, **headers}
        return http.build_request(method, self.url + path, content=content, headers=own, timeout=self._timeout_s)

    def stream_request(self, http: Http, path: str, after: int) -> httpx2.Request:
        """Return the request for the events of a stream after number `after`."""
        own = {**self._headers, "Accept": "text/event-stream", "Last-Event-ID": str(after)}
        timeout = httpx2.Timeout(self._timeout_s, read=SILENCE_S)
        return http.build_request("GET", self.url + path, headers=own, timeout=timeout)


def address(url: str) -> httpx2.URL:
    """Read the address of a service, like ``http://host:port``; http is the default. Raises ValueError."""
    try:
        found = httpx2.URL(url if "://" in url else f"http://{url}")
    except httpx2.InvalidURL as error:
        raise ValueError(f"must be like http://127.0.0.1:8080, got {url!r}") from error
    if found.scheme not in ("http", "https") or not found.host:
        raise ValueError(f"must be like http://127.0.0.1:8080, got {url!r}")
    return found


def document_in(response: httpx2.Response, path: str) -> Any:
    """Return the JSON of an answer. Raises MalformedAnswer."""
    try:
        return response.json()
    except (ValueError, RecursionError):
        raise MalformedAnswer(f"the answer to {path} is not JSON") from None


def joined(response: httpx2.Response, parts: list[bytes]) -> httpx2.Response:
    """Return a streamed answer with its decoded content."""
    headers = [(name, value) for name, value in response.headers.multi_items() if name.lower() not in _TRANSFER_HEADERS]
    return httpx2.Response(response.status_code, headers=headers, content=b"".join(parts), request=response.request)


def event_number(frame: httpx2.ServerSentEvent) -> int:
    """Return the number of an event. Raises MalformedAnswer."""
    if not re.fullmatch(r"[0-9]{1,15}", frame.id):  # the values that the service accepts as Last-Event-ID
        raise MalformedAnswer("an event has no number")
    return int(frame.id)


def _as_clause(error: Exception) -> str:
    """Return the text of an error for the middle of a sentence."""
    text = re.sub(r"^\[Errno -?\d+\] ", "", str(error)) or type(error).__name__
    return text[:1].lower() + text[1:] if text[1:2].islower() and " " in text else text
