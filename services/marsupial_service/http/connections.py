"""Connections: their number, how long they may stay without a request, and input that is not HTTP.

uvicorn limits how long a connection stays open after a request, and refuses requests beyond a number of connections.
But it waits for ever for the first request, and for a client that doesn't read its answer, and like similar servers it
has no limit per address. So this is uvicorn's own protocol (always the one over h11, as its checks are the strictest)
with three more timers, which parse no HTTP.
"""

from __future__ import annotations

import asyncio
import logging
import resource
import time
from collections import Counter
from typing import Any

import h11
from uvicorn.protocols.http.h11_impl import H11Protocol

from marsupial_service.http.answers import answer
from marsupial_service.problems import HttpProblem
from marsupial_service.settings import ServiceLimits

# open files of a server besides the connections that it has counted
OTHER_FILES = 512

_LOG_PAUSE_S = 10.0

log = logging.getLogger("marsupial.service")


class Connections:
    """All connections of a server; if there are too many, the one that has been idle for longest is closed."""

    def __init__(self, limits: ServiceLimits) -> None:
        self.limits = limits
        soft, _ = resource.getrlimit(resource.RLIMIT_NOFILE)
        files = 1 << 30 if soft == resource.RLIM_INFINITY else max(soft, OTHER_FILES + 1)
        self._most = min(limits.connections, files - OTHER_FILES)
        self._addresses: dict[GuardedProtocol, str] = {}
        self._counts: Counter[str] = Counter()
        # an ordered set: the first has been idle for longest
        self._idle: dict[GuardedProtocol, None] = {}

    def __len__(self) -> int:
        return len(self._addresses)

    def add(self, connection: GuardedProtocol, address: str) -> bool:
        """Count a new connection; False if there is no room for it."""
        if len(self) >= self._most and not self._make_room(None):
            return False
        if self._counts[address] >= self.limits.address_connections and not self._make_room(address):
            return False
        self._addresses[connection] = address
        self._counts[address] += 1
        return True

    def remove(self, connection: GuardedProtocol) -> None:
        """Stop counting a connection."""
        self._idle.pop(connection, None)
        address = self._addresses.pop(connection, None)
        if address is not None:
            self._counts[address] -= 1
            if not self._counts[address]:
                del self._counts[address]

    def set_busy(self, connection: GuardedProtocol, *, busy: bool) -> None:
        if busy:
            self._idle.pop(connection, None)
        elif connection in self._addresses:
            self._idle.setdefault(connection)

    def _make_room(self, address: str | None) -> bool:
        """Close the connection (of that address) that has been idle for longest; False if there is none."""
        for connection in self._idle:
            if address is None or self._addresses[connection] == address:
                self.remove(connection)
                connection.transport.abort()
                return True
        return False


class GuardedProtocol(H11Protocol):
    """A connection that has to send a request in time, and to take its answer."""

    def __init__(self, connections: Connections, **more: Any) -> None:
        super().__init__(**more)
        self._connections = connections
        self._header_timer: asyncio.TimerHandle | None = None
        self._stall_timer: asyncio.TimerHandle | None = None
        self._unsent = 0
        self._has_sent = False

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]
        super().connection_made(transport)
        if self._connections.add(self, self.client[0] if self.client else ""):
            self._update_timer()
        else:
            self._refuse(HttpProblem("too-many", "too many open connections", headers={"Retry-After": "1"}))

    def connection_lost(self, exc: Exception | None) -> None:
        self._connections.remove(self)
        for timer in (self._header_timer, self._stall_timer):
            if timer is not None:
                timer.cancel()
        super().connection_lost(exc)

    def data_received(self, data: bytes) -> None:
        if not self.transport.is_closing():
            self._has_sent = True
            super().data_received(data)
            self._update_timer()

    def on_response_complete(self) -> None:
        self._has_sent = False
        super().on_response_complete()
        self._update_timer()

    def timeout_keep_alive_handler(self) -> None:
        """Close the connection, even if the client doesn't read the remaining data."""
        super().timeout_keep_alive_handler()
        self._abort_soon()

    def pause_writing(self) -> None:
        super().pause_writing()
        self._watch_unsent()

    def _watch_unsent(self) -> None:
        """Start the timer that checks whether the client has received anything."""
        self._unsent = self.transport.get_write_buffer_size()
        self._stall_timer = self.loop.call_later(self._connections.limits.stall_s, self._stalled)

    def resume_writing(self) -> None:
        if self._stall_timer is not None:
            self._stall_timer.cancel()
        super().resume_writing()

    def send_400_response(self, msg: str) -> None:
        """Answer a malformed request with an error and close; in the middle of an answer, only close."""
        if self.conn.our_state in (h11.IDLE, h11.SEND_RESPONSE):
            self._refuse(HttpProblem("bad-request", msg))
        else:
            self.transport.abort()

    def _update_timer(self) -> None:
        """Run the timer while there is no request."""
        busy = self.cycle is not None and not self.cycle.response_complete
        self._connections.set_busy(self, busy=busy)
        if busy and self._header_timer is not None:
            self._header_timer.cancel()
            self._header_timer = None
        elif not busy and self._header_timer is None:
            self._header_timer = self.loop.call_later(self._connections.limits.header_s, self._headers_late)

    def _headers_late(self) -> None:
        if self._has_sent and self.conn.our_state is h11.IDLE:
            self._refuse(HttpProblem("too-slow", "the headers did not arrive in time"))
        else:
            self.transport.abort()

    def _stalled(self) -> None:
        if self.transport.get_write_buffer_size() >= self._unsent:
            self.transport.abort()
        else:
            self._watch_unsent()

    def _refuse(self, problem: HttpProblem) -> None:
        """Answer and close, in any state of the HTTP exchange."""
        response = answer(problem, "")
        lines = [f"HTTP/1.1 {response.status_code} {problem.title}", "connection: close"]
        lines += [f"{name.decode()}: {value.decode()}" for name, value in response.raw_headers]
        self.transport.write("\r\n".join([*lines, "", ""]).encode() + bytes(response.body))
        self.transport.close()
        self._abort_soon()

    def _abort_soon(self) -> None:
        self.loop.call_later(self._connections.limits.stall_s, self.transport.abort)


class LoopErrorHandler:
    """The exception handler of an event loop: logs faults."""

    def __init__(self) -> None:
        self._logged_s = -_LOG_PAUSE_S

    def __call__(self, loop: asyncio.AbstractEventLoop, context: dict[str, Any]) -> None:
        if "socket.accept()" not in context.get("message", ""):
            loop.default_exception_handler(context)
        # the loop tries again at once, and fails again, as long as all files are in use
        elif time.monotonic() - self._logged_s >= _LOG_PAUSE_S:
            self._logged_s = time.monotonic()
            log.error("connections can't be accepted", extra={"reason": str(context.get("exception"))})


def allow_files(limits: ServiceLimits) -> None:
    """Raise the limit of open files to what all connections need, if the system allows it."""
    needed = limits.connections + OTHER_FILES
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    most = needed if hard == resource.RLIM_INFINITY else min(needed, hard)
    if soft != resource.RLIM_INFINITY and soft < most:
        resource.setrlimit(resource.RLIMIT_NOFILE, (most, hard))
    if most < needed:
        log.warning("the limit of open files allows fewer connections", extra={"connections": most - OTHER_FILES})
