"""A plain client: one request, one answer; the frames of an event stream as they are. Nothing is tried again."""

import http.client
import json
from collections.abc import Iterator, Mapping
from contextlib import closing
from typing import Any, NamedTuple

from patience import HANG_S

BROKEN = (OSError, http.client.HTTPException)
"""What is raised where the way to the service breaks."""

ACCEPTED = (200, 202)
BUSY = (429, 503)
"""Statuses of what was done, and of what is worth another try."""

HOST = "127.0.0.1"


class Refusal(OSError):
    """A stream that is asked for is answered by a `status` of failure."""

    def __init__(self, status: int) -> None:
        super().__init__(f"the stream answers {status}")
        self.status = status


class Reply(NamedTuple):
    """What a request is answered: status, media type, and the document, or the text of what is not JSON."""

    status: int
    kind: str
    document: Any


class Frame(NamedTuple):
    """An event of a stream as it was sent: its number, from 1, its type, and one line of JSON."""

    id: int
    type: str
    data: str


class Talk:
    """A connection that is kept open; after a break the next request opens another one.

    Attributes
    ----------
    retry_after
        The header of that name in the last answer.
    """

    def __init__(self, port: int, timeout_s: float = HANG_S) -> None:
        self._connection = http.client.HTTPConnection(HOST, port, timeout=timeout_s)
        self.retry_after: str | None = None

    def ask(self, method: str, path: str, body: object = None, headers: Mapping[str, str] | None = None) -> Reply:
        """Send a request with a body, JSON text or what becomes that, and return the answer.

        Raises what is in `BROKEN`.
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
    """Send a request over a connection of its own."""
    talk = Talk(port)
    with closing(talk):
        return talk.ask(method, path, body)


def frames(port: int, path: str, after: int = 0, timeout_s: float = HANG_S) -> Iterator[Frame]:
    """Yield the events of a stream after number `after` until the service ends it. Raises what is in `BROKEN`."""
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
