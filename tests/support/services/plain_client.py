"""A plain HTTP client: one request, one answer; an event stream as raw frames. It never retries."""

import http.client
import json
from collections.abc import Iterator, Mapping
from contextlib import closing
from typing import Any, NamedTuple

from support.waiting import HANG_S

BROKEN = (OSError, http.client.HTTPException)
"""Raised when the connection to the service breaks."""

ACCEPTED = (200, 202)
BUSY = (429, 503)
"""Statuses of success, and of requests worth a retry."""

HOST = "127.0.0.1"


class Refusal(OSError):
    """The request for a stream is answered with an error status."""

    def __init__(self, status: int) -> None:
        super().__init__(f"the stream answers {status}")
        self.status = status


class Reply(NamedTuple):
    """An answer: status, media type, and the JSON document or text."""

    status: int
    kind: str
    document: Any


class Frame(NamedTuple):
    """An event of a stream as sent: its number from 1, its type, and one line of JSON."""

    id: int
    type: str
    data: str


class PlainClient:
    """A persistent connection; after a break the next request opens a new one.

    Attributes
    ----------
    retry_after
        The `Retry-After` header of the last answer.
    """

    def __init__(self, port: int, timeout_s: float = HANG_S) -> None:
        self._connection = http.client.HTTPConnection(HOST, port, timeout=timeout_s)
        self.retry_after: str | None = None

    def ask(self, method: str, path: str, body: object = None, headers: Mapping[str, str] | None = None) -> Reply:
        """Send a request with a body, a value or its JSON text, and return the answer.

        Raises one of `BROKEN`.
        """
        sent = body if body is None or isinstance(body, bytes) else json.dumps(body).encode()
        headers = {**({} if body is None else {"Content-Type": "application/json"}), **(headers or {})}
        try:
            self._connection.request(method, path, sent, headers)
            answer = self._connection.getresponse()
            text, kind = answer.read().decode(), answer.headers.get_content_type()
            self.retry_after = answer.headers.get("Retry-After")
        except BROKEN:
            self._connection.close()
            raise
        return Reply(answer.status, kind, json.loads(text) if kind.endswith("json") else text)

    def close(self) -> None:
        self._connection.close()


def ask(port: int, method: str, path: str, body: object = None) -> Reply:
    """Send a request over a new connection."""
    client = PlainClient(port)
    with closing(client):
        return client.ask(method, path, body)


def frames(port: int, path: str, after: int = 0, timeout_s: float = HANG_S) -> Iterator[Frame]:
    """Yield the events of a stream after number `after` until the service ends it. Raises one of `BROKEN`."""
    connection = http.client.HTTPConnection(HOST, port, timeout=timeout_s)
    with closing(connection):
        connection.request("GET", path, headers={"Last-Event-ID": str(after), "Accept": "text/event-stream"})
        answer = connection.getresponse()
        if answer.status != 200:
            raise Refusal(answer.status)
        yield from _read(answer)


def _read(answer: http.client.HTTPResponse) -> Iterator[Frame]:
    fields: dict[str, str] = {}
    while line := answer.readline():
        name, _, value = line.decode().rstrip("\n").partition(":")
        if name:
            fields[name] = value.removeprefix(" ")
        elif "data" in fields:
            yield Frame(int(fields["id"]), fields["event"], fields["data"])
            fields = {}
