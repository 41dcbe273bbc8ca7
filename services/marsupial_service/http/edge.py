"""The outermost layer: gives each request an id, logs and counts it, and lets no exception out.

Where no keys are needed, any page that a browser on this machine shows could send requests here. So only requests that
name this machine are served: a page can have a name of its own resolve to it, but can't name another host. And nothing
is changed for a page of another origin, which browsers name in every such request; programs name none.
"""

import logging
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
_GONE = 499  # nginx's status for a client that left before its answer


class Edge:
    """Wraps the application."""

    def __init__(self, app: ASGIApp, state: State) -> None:
        self._app = app
        self._state = state

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return
        request, status = uuid.uuid4().hex, None

        async def send_tracked(message: Message) -> None:
            nonlocal status
            if message["type"] == "http.response.start":
                status = message["status"]
                headers = MutableHeaders(scope=message)
                headers["X-Request-Id"] = request
                headers["X-Content-Type-Options"] = "nosniff"
            await send(message)

        started_s = time.perf_counter()
        try:
            problem = self._refusal(scope["method"], Headers(scope=scope))
            app = self._app if problem is None else answer(problem, scope["path"])
            await app(scope, receive, send_tracked)
        except Exception:
            log.exception("request failed", extra={"request": request, "path": scope["path"]})
            # once an answer has begun, nothing can be sent in its place
            if status is None:
                problem = HttpProblem("internal", f"see the server log for request {request}")
                await answer(problem, scope["path"])(scope, receive, send_tracked)
        finally:
            self._log(scope, request, status or _GONE, time.perf_counter() - started_s)

    def _refusal(self, method: str, headers: Headers) -> HttpProblem | None:
        """Return the problem if a request must not reach any route, else None."""
        if "transfer-encoding" in headers and "content-length" in headers:
            return HttpProblem(
                "bad-request",
                "Content-Length and Transfer-Encoding must not both be given",
                headers={"Connection": "close"},
            )
        if self._state.settings.needs_keys:
            return None
        host = headers.get("host", "")
        name = host[1:].partition("]")[0] if host.startswith("[") else host.rpartition(":")[0] or host
        if name.lower() not in LOOPBACK:
            return HttpProblem("misdirected", "without API keys, only requests for localhost are accepted")
        # browsers write host and port into both headers alike; the origin "null" has none
        elsewhere = any(origin.partition("://")[2].lower() != host.lower() for origin in headers.getlist("origin"))
        if method not in _SAFE_METHODS and (elsewhere or headers.get("sec-fetch-site", "none") not in _OWN_SITES):
            text = "without API keys, only the service's own pages may send this request"
            return HttpProblem("cross-origin", text)
        return None

    def _log(self, scope: Scope, request: str, status: int, seconds: float) -> None:
        route = getattr(scope.get("route"), "path", "none")
        method = scope["method"] if scope["method"] in _METHODS else "other"
        self._state.metrics.request(method, route, status, seconds)
        more: dict[str, Any] = {"request": request, "method": method, "route": route, "status": status}
        about = scope.get("path_params") or {}
        more |= {"ms": round(1000 * seconds, 2)} | {key: about[key] for key in ("job", "mission") if key in about}
        log.info("request", extra=more)
