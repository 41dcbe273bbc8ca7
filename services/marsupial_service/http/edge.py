"""The outermost layer: gives each request an id, logs and counts it, and lets no exception out.

It refuses requests that httptools reads, but that a proxy or a page could read otherwise: about another host, or with
another end. It answers HEAD as GET, without the body.

Where no keys are needed, any page that a browser on this machine shows could send requests here. So only requests that
name this machine are served: a page can have a name of its own resolve to it, but can't name another host. And nothing
is changed for a page of another origin, which browsers name in every such request; programs name none.
"""

import asyncio
import logging
import re
import time
import uuid
from typing import Any

from starlette.datastructures import Headers, MutableHeaders
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from marsupial_service.http.answers import answer
from marsupial_service.problems import HttpProblem
from marsupial_service.settings import LOOPBACK
from marsupial_service.state import State

log = logging.getLogger("marsupial.service")

_METHODS = frozenset({"GET", "HEAD", "POST", "PUT", "PATCH", "DELETE", "OPTIONS"})
_SAFE_METHODS = frozenset({"GET", "HEAD", "OPTIONS"})
_OWN_SITES = frozenset({"same-origin", "none"})
_LOCAL_HOST = re.compile(
    rf"({'|'.join(re.escape(f'[{name}]' if ':' in name else name) for name in LOOPBACK)})(:[0-9]*)?", re.IGNORECASE
)
_GONE = 499  # nginx's status for a client that left before its answer
_MOST_HEAD_BYTES = 65_536
_RETRY_S = 1
_CLOSED = {"Connection": "close"}
_END = {"type": "http.response.body", "body": b"", "more_body": False}


class Edge:
    """Wraps the application."""

    def __init__(self, app: ASGIApp, state: State) -> None:
        self._app = app
        self._state = state

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return
        method, headers, request, status = scope["method"], Headers(scope=scope), uuid.uuid4().hex, None
        if method == "HEAD":  # for the routes it is GET; the server has its own scope, and sends no body
            scope = {**scope, "method": "GET"}

        async def send_tracked(message: Message) -> None:
            nonlocal status
            if message["type"] == "http.response.start":
                status = message["status"]
                sent = MutableHeaders(scope=message)
                sent["X-Request-Id"] = request
                sent["X-Content-Type-Options"] = "nosniff"
                if _leaves_http(method, headers):
                    sent["Connection"] = "close"
                await send(message)
                if method == "HEAD":  # at once: a stream has no other end, and takes this one for the client's
                    await send(_END)
            elif method != "HEAD":
                await send(message)

        started_s = time.perf_counter()
        try:
            problem = _malformed(scope, headers) or self._refusal(method, headers)
            app = self._app if problem is None else answer(problem, scope["path"])
            await app(scope, receive, send_tracked)
        except (Exception, asyncio.CancelledError) as error:
            problem = _failure(error, request, scope["path"])
            # once an answer has begun, nothing can be sent in its place
            if status is None:
                await answer(problem, scope["path"])(scope, receive, send_tracked)
        finally:
            self._log(scope, method, request, status or _GONE, time.perf_counter() - started_s)

    def _refusal(self, method: str, headers: Headers) -> HttpProblem | None:
        """Return the problem if a request comes from a page that must not send it, else None."""
        if self._state.settings.needs_keys:
            return None
        host = headers.get("host", "")
        if not _LOCAL_HOST.fullmatch(host):
            return HttpProblem("misdirected", "without API keys, only requests for localhost are accepted")
        # browsers write host and port into both headers alike; the origin "null" has none
        elsewhere = any(origin.partition("://")[2].lower() != host.lower() for origin in headers.getlist("origin"))
        if method not in _SAFE_METHODS and (elsewhere or headers.get("sec-fetch-site", "none") not in _OWN_SITES):
            text = "without API keys, only the service's own pages may send this request"
            return HttpProblem("cross-origin", text)
        return None

    def _log(self, scope: Scope, method: str, request: str, status: int, seconds: float) -> None:
        route = getattr(scope.get("route"), "path", "none")
        method = method if method in _METHODS else "other"
        self._state.metrics.request(method, route, status, seconds)
        more: dict[str, Any] = {"request": request, "method": method, "route": route, "status": status}
        about = scope.get("path_params") or {}
        more |= {"ms": round(1000 * seconds, 2)} | {key: about[key] for key in ("job", "mission") if key in about}
        log.info("request", extra=more)


def _malformed(scope: Scope, headers: Headers) -> HttpProblem | None:
    """Return the problem if servers could disagree about a request's host or end, or it has too many headers."""
    hosts, codings = headers.getlist("host"), headers.getlist("transfer-encoding")
    length = headers.get("content-length")
    text = None
    if len(hosts) > 1 or (not hosts and scope["http_version"] != "1.0"):
        text = "exactly one Host header is required"
    elif codings and length is not None:
        text = "Content-Length and Transfer-Encoding must not both be given"
    elif codings and [coding.lower() for coding in codings] != ["chunked"]:
        text = "Transfer-Encoding must be chunked"
    elif _leaves_http(scope["method"], headers) and (codings or (length or "0") != "0"):
        text = "a request with a body must not offer another protocol (Upgrade); send it as HTTP/1.1"
    elif _head_bytes(scope) > _MOST_HEAD_BYTES:
        text = f"target and headers together must have at most {_MOST_HEAD_BYTES} bytes"
    return None if text is None else HttpProblem("bad-request", text, headers=_CLOSED)


def _head_bytes(scope: Scope) -> int:
    target = len(scope["path"]) + len(scope["query_string"])
    return target + sum(len(name) + len(value) for name, value in scope["headers"])


def _leaves_http(method: str, headers: Headers) -> bool:
    """Return whether httptools reads nothing after the headers, as another protocol is offered, though not accepted."""
    connection = ",".join(headers.getlist("connection")).lower().split(",")
    return method == "CONNECT" or ("upgrade" in headers and "upgrade" in map(str.strip, connection))


def _failure(error: BaseException, request: str, path: str) -> HttpProblem:
    """Return the problem for an exception of the application; the server cancels requests only when it ends."""
    if isinstance(error, asyncio.CancelledError):
        text = "the service is shutting down; send the request again"
        return HttpProblem("not-ready", text, headers={**_CLOSED, "Retry-After": str(_RETRY_S)})
    log.error("request failed", exc_info=error, extra={"request": request, "path": path})
    return HttpProblem("internal", f"see the server log for request {request}")
