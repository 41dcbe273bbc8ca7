"""What every route does before its own code: who asks, in which form the answer is wanted, the body as strict JSON.

The order is: key (401, 403), form of the answer (406), type of the body (415), its size and time (413, 408), its
syntax (400), its shape (422). So a stranger can't make the service read anything.
"""

from __future__ import annotations

import asyncio
import time
from collections.abc import Callable, Coroutine
from typing import Any

from fastapi import Request, Response
from fastapi.routing import APIRoute

from marsupial_service.http.problems import HttpProblem
from marsupial_service.http.strict_json import parse
from marsupial_service.operations.keys import Scope
from marsupial_service.schemas.answers import ProblemDetailAnswer
from marsupial_service.state import State, state_of

LOCAL_OWNER = "local"
"""Who asks where no keys are needed."""


class Route(APIRoute):
    """A route for all clients."""

    scope: Scope | None = None

    def get_route_handler(self) -> Callable[[Request], Coroutine[Any, Any, Response]]:
        """Return the handler that checks the request first."""
        handle = super().get_route_handler()

        async def checked(request: Request) -> Response:
            request.state.owner = self._owner(request)
            _check_accept(request, self._media_type())
            self._check_query(request)
            if self.body_field is not None:
                request = await _StrictRequest.read(request)
            return await handle(request)

        return checked

    def _media_type(self) -> str:
        response_class: Any = getattr(self.response_class, "value", self.response_class)
        return str(response_class.media_type or "application/json")

    def _owner(self, request: Request) -> str:
        """Return the name of the key, if its scope is that of the route."""
        state = state_of(request.app)
        if self.scope is None or not state.settings.needs_keys:
            return LOCAL_OWNER
        scheme, _, secret = request.headers.get("authorization", "").partition(" ")
        key = state.keys.find(secret.strip(), time.time()) if scheme.lower() == "bearer" else None
        if key is None:
            said = "the key is unknown, expired or revoked" if scheme else "Authorization: Bearer <key> is missing"
            raise HttpProblem("no-key", said, headers={"WWW-Authenticate": "Bearer"})
        if self.scope not in key.scopes:
            raise HttpProblem("no-scope", f"the key's scopes are {', '.join(key.scopes)}; this needs {self.scope}")
        return key.name

    def _check_query(self, request: Request) -> None:
        known = {parameter.alias for parameter in self.dependant.query_params}
        unknown = sorted(set(request.query_params) - known)
        if unknown:
            details = [ProblemDetailAnswer(query=name, detail="unknown parameter") for name in unknown]
            raise HttpProblem("invalid", errors=details)
        for name in known:
            if len(request.query_params.getlist(name)) > 1:
                raise HttpProblem("invalid", errors=[ProblemDetailAnswer(query=name, detail="is given twice")])


class PlanRoute(Route):
    """A route for keys that may plan."""

    scope = Scope.PLAN


class AdminRoute(Route):
    """A route for operators."""

    scope = Scope.ADMIN


class _StrictRequest(Request):
    """A request whose body has been read and parsed."""

    _parsed: Any

    @classmethod
    async def read(cls, request: Request) -> _StrictRequest:
        """Read the body of `request`."""
        kind = request.headers.get("content-type", "").partition(";")[0].strip().lower()
        if kind != "application/json":
            raise HttpProblem("media-type", f"Content-Type must be application/json, got {kind[:100] or 'none'}")
        if request.headers.get("content-encoding", "identity").lower() != "identity":
            raise HttpProblem("media-type", "Content-Encoding must be identity")
        body = await _body(request, state_of(request.app))
        strict = cls(request.scope, request.receive)
        strict._body = body
        strict._parsed = strict.state.json = parse(body)
        return strict

    async def json(self) -> Any:
        """Return what the body says."""
        return self._parsed


async def _body(request: Request, state: State) -> bytes:
    limits = state.settings.limits
    length = request.headers.get("content-length", "")
    if length.isascii() and length.isdigit() and int(length[:20]) > limits.body_bytes:
        raise _too_large(limits.body_bytes)
    body = bytearray()
    try:
        async with asyncio.timeout(limits.body_s):
            async for chunk in request.stream():
                body += chunk
                if len(body) > limits.body_bytes:
                    raise _too_large(limits.body_bytes)
    except TimeoutError:
        raise HttpProblem("too-slow", headers={"Connection": "close"}) from None
    return bytes(body)


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
    raise HttpProblem("not-acceptable", f"the answer is {media_type}")
