"""The checks of every route before its own code: the caller's key, the requested form of the answer, the body.

The order is: key (401, 403), form of the answer (406), type of the body (415), its size and time (413, 408), its
syntax (400), its shape (422).
"""

import asyncio
import time
from collections.abc import Callable, Coroutine
from typing import Any

from fastapi import Request, Response
from fastapi.routing import APIRoute
from starlette.requests import ClientDisconnect

from marsupial.wording import suggestion
from marsupial_service.intake.reading import ReceivedBody
from marsupial_service.keys import Scope
from marsupial_service.problems import HttpProblem
from marsupial_service.schemas.answers import ProblemDetailAnswer
from marsupial_service.state import state_of

# the owner of all requests if no keys are needed
LOCAL_OWNER = "local"


class ServiceRoute(APIRoute):
    """A route for all clients."""

    scope: Scope | None = None

    def get_route_handler(self) -> Callable[[Request], Coroutine[Any, Any, Response]]:
        """Return the handler that checks the request first."""
        handle = super().get_route_handler()
        response_class: Any = getattr(self.response_class, "value", self.response_class)
        media_type = str(response_class.media_type or "application/json")

        async def checked(request: Request) -> Response:
            # in this order, so that a stranger can't make the service read anything
            request.state.owner = self._owner(request)
            _check_accept(request, media_type)
            self._check_query(request)
            if self.body_field is None:
                return await handle(request)
            read = _BodyRequest(request.scope, request.receive)
            try:
                await read.receive_body()
                return await handle(read)
            finally:
                read.release()

        return checked

    def _owner(self, request: Request) -> str:
        """Return the name of the key, if its scope is that of the route."""
        state = state_of(request.app)
        request.state.key = None
        if self.scope is None or not state.settings.needs_keys:
            return LOCAL_OWNER
        scheme, _, secret = request.headers.get("authorization", "").partition(" ")
        key = state.keys.find(secret.strip(), time.time()) if scheme.lower() == "bearer" else None
        if key is None:
            text = (
                "the key is unknown, expired or revoked"
                if scheme
                else "the header Authorization: Bearer <key> is missing"
            )
            raise HttpProblem("no-key", text, headers={"WWW-Authenticate": "Bearer"})
        if self.scope not in key.scopes:
            raise HttpProblem("no-scope", f"requires scope {self.scope}; the key has {', '.join(key.scopes)}")
        request.state.key = key
        return key.name

    def _check_query(self, request: Request) -> None:
        known = {parameter.alias for parameter in self.dependant.query_params}
        unknown = sorted(set(request.query_params) - known)
        if unknown:
            told = [(name, f"unknown parameter{suggestion(name, known)}") for name in unknown]
            raise HttpProblem("invalid", errors=[ProblemDetailAnswer(query=name, detail=text) for name, text in told])
        for name in known:
            if len(request.query_params.getlist(name)) > 1:
                raise HttpProblem("invalid", errors=[ProblemDetailAnswer(query=name, detail="is given more than once")])


class PlanRoute(ServiceRoute):
    """A route for keys that may plan."""

    scope = Scope.PLAN


class AdminRoute(ServiceRoute):
    """A route for operators."""

    scope = Scope.ADMIN


class _BodyRequest(Request):
    """A request that receives its body, whose bytes count among those that the service holds, for `intake.reading`."""

    _sent: ReceivedBody
    _held = 0

    async def receive_body(self) -> None:
        """Receive the body, which has to come at a rate; `body_s` are for what is slow at first."""
        kind = self.headers.get("content-type", "").partition(";")[0].strip().lower()
        if kind != "application/json":
            raise HttpProblem("media-type", f"Content-Type must be application/json, got {kind[:100] or 'none'}")
        if self.headers.get("content-encoding", "identity").lower() != "identity":
            raise HttpProblem("media-type", "Content-Encoding must be identity")
        limits = state_of(self.app).settings.limits
        length = self.headers.get("content-length", "")
        # refuse the body before reading a byte of it
        if length.isascii() and length.isdigit() and int(length[:20]) > limits.body_bytes:
            raise _too_large(limits.body_bytes)
        body = bytearray()
        due_s = asyncio.get_running_loop().time() + limits.body_s
        try:
            async with asyncio.timeout_at(due_s) as timeout:
                async for chunk in self.stream():
                    self._count_bytes(len(chunk))
                    body += chunk
                    timeout.reschedule(due_s + len(body) / limits.body_rate)
        except TimeoutError:
            raise HttpProblem("too-slow", headers={"Connection": "close"}) from None
        except ClientDisconnect:  # nobody reads the answer; its status is for the log and the metrics
            raise HttpProblem("bad-request", "the body is incomplete") from None
        self._sent = ReceivedBody(bytes(body), self.state.owner)

    def _count_bytes(self, count: int) -> None:
        """Count received bytes. Raises HttpProblem if there are too many for this body or in all."""
        state = state_of(self.app)
        limits = state.settings.limits
        self._held += count
        state.held_bytes += count
        if self._held > limits.body_bytes:
            raise _too_large(limits.body_bytes)
        if state.held_bytes > limits.bodies_bytes:
            text = "too many request bodies in progress"
            raise HttpProblem("too-many", text, headers={"Connection": "close", "Retry-After": "1"})

    def release(self) -> None:
        """Stop counting its bytes."""
        state_of(self.app).held_bytes -= self._held

    async def body(self) -> bytes:
        return b"{}"  # the framework asks for `json` only if there is a body

    async def json(self) -> Any:
        return self._sent


def _too_large(limit: int) -> HttpProblem:
    return HttpProblem("too-large", f"the body must have at most {limit} bytes", headers={"Connection": "close"})


def _check_accept(request: Request, media_type: str) -> None:
    """Refuse what the client doesn't accept; without the header it accepts everything."""
    accepted = ",".join(request.headers.getlist("accept"))
    if not accepted.strip():
        return
    ranges = {media_type, media_type.partition("/")[0] + "/*", "*/*"}
    for part in accepted.split(","):
        kind, *parameters = (word.strip().lower() for word in part.split(";"))
        if kind in ranges and not any(p.replace(" ", "") in ("q=0", "q=0.0", "q=0.00", "q=0.000") for p in parameters):
            return
    raise HttpProblem("not-acceptable", f"Accept must allow {media_type}")
