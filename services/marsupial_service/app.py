"""The application: routes, errors, and what runs as long as it does."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Callable, Sequence
from contextlib import asynccontextmanager
from functools import partial
from importlib.metadata import version
from typing import Any

from fastapi import FastAPI, Request, Response
from fastapi.exceptions import RequestValidationError
from fastapi.responses import JSONResponse
from starlette.exceptions import HTTPException
from starlette.routing import Match

from marsupial.errors import MarsupialError
from marsupial.processes import launcher as processes
from marsupial_service import openapi
from marsupial_service.edge import Edge
from marsupial_service.entries import KeyReused, TooMany, UnknownEntry
from marsupial_service.jobs import Jobs, JobSettings
from marsupial_service.jobs import service as jobs_service
from marsupial_service.keys import KeyFile
from marsupial_service.missions import service as missions_service
from marsupial_service.missions.ledger import Conflict
from marsupial_service.missions.records import MissionSettings
from marsupial_service.missions.service import Missions
from marsupial_service.pointers import of_location, of_path
from marsupial_service.problems import KINDS, Detail, HttpProblem, answer, kind_of
from marsupial_service.routes import analyses, catalogue, jobs, missions, operations
from marsupial_service.settings import Settings
from marsupial_service.state import State, state_of
from marsupial_service.store import Store, StoreError

DESCRIPTION = (
    "Plans for teams of carriers and rovers that explore unknown maps. Times are milliseconds where a name ends in "
    "`_ms`; places on the map are metres of the map frame."
)

PRELOAD = (*jobs_service.PRELOAD, *missions_service.PRELOAD, "marsupial_service.warm")
"""What workers need besides planners' libraries, loaded before they are forked."""

_KIND_OF_STATUS = {404: "not-found", 405: "no-method", 413: "too-large"}


def create_app(settings: Settings) -> FastAPI:
    """Return the application; it opens its store when it starts."""
    app = FastAPI(
        title="marsupial",
        version=version("marsupial"),
        description=DESCRIPTION,
        lifespan=_running,
        openapi_url=None,
        redoc_url=None,
        redirect_slashes=False,
        generate_unique_id_function=lambda route: route.name,
    )
    limits = settings.limits
    app.state.service = State(
        settings=settings, keys=KeyFile(settings.data), analyses=asyncio.Semaphore(limits.analyses)
    )
    for router in (
        jobs.router,
        missions.router,
        analyses.router,
        catalogue.router,
        operations.router,
        operations.admin,
    ):
        app.include_router(router)
    document = openapi.document(app, needs_keys=settings.needs_keys)
    app.openapi = lambda: document  # type: ignore[method-assign]
    app.add_api_route("/openapi.json", lambda: JSONResponse(document), include_in_schema=False)
    for error, handle in _HANDLERS.items():
        app.add_exception_handler(error, handle)
    app.add_middleware(Edge, state=app.state.service)
    return app


@asynccontextmanager
async def _running(app: FastAPI) -> AsyncIterator[None]:
    """Run the jobs and missions of the data folder as long as the application runs."""
    state = state_of(app)
    limits = state.settings.limits
    store: Store = state.store if state.store is not None else await asyncio.to_thread(Store, state.settings.data)
    state.jobs = Jobs(
        store,
        JobSettings(
            slots=limits.slots,
            queue=limits.queue,
            retention_s=limits.retention_s,
            kept=limits.kept_jobs,
            memory_bytes=limits.memory_bytes,
            steps_limit_s=limits.steps_s,
            commands=state.settings.planners,
        ),
    )
    state.missions = Missions(
        store,
        MissionSettings(
            missions=limits.missions,
            backlog=limits.backlog,
            memory_bytes=limits.memory_bytes,
            retention_s=limits.retention_s,
            kept=limits.kept_missions,
        ),
    )
    try:
        await asyncio.to_thread(partial(processes.warm_up, wait=False, preload=PRELOAD))
        await state.jobs.start()
        await state.missions.start()
        yield
    finally:
        state.leaving.set()
        await asyncio.gather(state.jobs.stop(), state.missions.stop())
        await asyncio.to_thread(store.close)


def _problem(request: Request, error: Exception) -> Response:
    assert isinstance(error, HttpProblem)
    return answer(error, request.url.path)


def _refused(request: Request, error: Exception) -> Response:
    """Answer what the library raises."""
    assert isinstance(error, MarsupialError)
    kind = kind_of(error)
    if KINDS[kind].status >= 500:
        raise error
    return answer(HttpProblem(kind, str(error)), request.url.path)


def _misshaped(request: Request, error: Exception) -> Response:
    """Answer what pydantic finds wrong."""
    assert isinstance(error, RequestValidationError)
    body = getattr(request.state, "json", None)
    return answer(HttpProblem("invalid", errors=[_detail(one, body) for one in error.errors()]), request.url.path)


def _detail(error: dict[str, Any], body: object) -> Detail:
    place, *location = error["loc"]
    text = str(error["msg"])
    if place == "body":
        return Detail(where="pointer", name=of_location(location, body), text=text)
    name = str(location[0]) if location else ""
    return Detail(where=place if place in ("query", "header", "path") else "query", name=name, text=text)


def _http(request: Request, error: Exception) -> Response:
    """Answer what the framework raises: no such route, no such method."""
    assert isinstance(error, HTTPException)
    kind = _KIND_OF_STATUS.get(error.status_code, "internal" if error.status_code >= 500 else "invalid")
    headers = {"Allow": ", ".join(_methods(request))} if kind == "no-method" else {}
    return answer(HttpProblem(kind, headers=headers), request.url.path)


def _methods(request: Request) -> Sequence[str]:
    """Return what can be done at the path of the request."""
    found: set[str] = set()
    for method in ("DELETE", "GET", "POST"):
        scope = {**request.scope, "method": method}
        if any(route.matches(scope)[0] is Match.FULL for route in request.app.router.routes):
            found.add(method)
    return sorted(found)


def _unknown(request: Request, error: Exception) -> Response:
    return answer(HttpProblem("not-found", str(error)), request.url.path)


def _conflicts(request: Request, error: Exception) -> Response:
    """Answer what contradicts a mission, with pointers into the body where there is one."""
    assert isinstance(error, Conflict)
    body = getattr(request.state, "json", {})
    details = [Detail(where="pointer", name=of_path(one.path, body), text=one.message) for one in error.problems]
    return answer(HttpProblem("conflict", errors=details), request.url.path)


def _too_many(request: Request, error: Exception) -> Response:
    assert isinstance(error, TooMany)
    headers = {"Retry-After": str(error.retry_after_s)}
    return answer(HttpProblem("too-many", str(error), headers=headers), request.url.path)


def _key_reused(request: Request, error: Exception) -> Response:
    return answer(HttpProblem("key-reused", "send another key, or the same request"), request.url.path)


def _store_fails(request: Request, error: Exception) -> Response:
    return answer(HttpProblem("not-ready", str(error), headers={"Retry-After": "5"}), request.url.path)


_HANDLERS: dict[type[Exception], Callable[[Request, Exception], Response]] = {
    HttpProblem: _problem,
    MarsupialError: _refused,
    RequestValidationError: _misshaped,
    HTTPException: _http,
    UnknownEntry: _unknown,
    Conflict: _conflicts,
    TooMany: _too_many,
    KeyReused: _key_reused,
    StoreError: _store_fails,
}
