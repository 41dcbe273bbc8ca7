"""The application: routes, error handlers, and the tasks that run as long as it does."""

import asyncio
import time
from collections.abc import AsyncIterator, Callable, Sequence
from contextlib import asynccontextmanager
from importlib.metadata import version
from typing import Any

from fastapi import FastAPI, Request, Response
from fastapi.exceptions import RequestValidationError
from fastapi.responses import HTMLResponse, JSONResponse
from starlette.exceptions import HTTPException
from starlette.routing import Match

from marsupial.errors import MarsupialError
from marsupial.processes import launcher
from marsupial_service.entries.capacity import RETRY_AFTER_S, StoreFull
from marsupial_service.entries.records import KeyReused, TooMany, UnknownEntry
from marsupial_service.entries.slots import Slots
from marsupial_service.http import docspage, livepage, openapi
from marsupial_service.http.answers import answer
from marsupial_service.http.edge import Edge
from marsupial_service.http.routing import LOCAL_OWNER
from marsupial_service.intake import jobs as job_bodies
from marsupial_service.intake import missions as mission_bodies
from marsupial_service.intake import simulations as simulation_bodies
from marsupial_service.intake.jobs import load_analysis
from marsupial_service.jobs.records import JobSettings
from marsupial_service.jobs.service import Jobs
from marsupial_service.keys import KeyFile, KeyRow
from marsupial_service.missions.records import MissionSettings
from marsupial_service.missions.service import Missions
from marsupial_service.missions.state import ReportConflict
from marsupial_service.operations.metrics import measure_delay
from marsupial_service.problems import HttpProblem, problem_of, problem_of_all
from marsupial_service.routes import analyses, catalogue, jobs, missions, operations, simulations
from marsupial_service.schemas.answers import ProblemDetailAnswer
from marsupial_service.settings import ServiceSettings
from marsupial_service.state import State, state_of
from marsupial_service.store import Store, StoreError, open_store

DESCRIPTION = (
    "Plans for teams of carriers and rovers that explore unknown maps. Fields whose names end in `_ms` are "
    "milliseconds; positions are metres in the map frame."
)

READERS = (load_analysis, mission_bodies, job_bodies, simulation_bodies)
"""Preloads for analyses, and for reading and writing large documents."""

_STORE_RETRY_S = 5
_KIND_OF_STATUS = {404: "not-found", 405: "no-method", 413: "too-large"}


def create_app(settings: ServiceSettings) -> FastAPI:
    """Return the application; it opens its store when it starts."""
    settings = settings.effective()
    app = FastAPI(
        title="marsupial",
        version=version("marsupial"),
        description=DESCRIPTION,
        lifespan=_running,
        openapi_url=None,
        docs_url=None,
        redoc_url=None,
        redirect_slashes=False,
        generate_unique_id_function=lambda route: route.name,
    )
    app.state.service = State(settings=settings, keys=KeyFile(settings.data))
    for router in (
        *(room.router for room in (missions, jobs, simulations, analyses, catalogue, operations)),
        operations.admin,
        livepage.router,
    ):
        app.include_router(router)
    document = openapi.document(app, needs_keys=settings.needs_keys)
    app.openapi = lambda: document  # type: ignore[method-assign]
    app.add_api_route("/openapi.json", lambda: JSONResponse(document), include_in_schema=False)
    page = docspage.page_of(document)
    app.add_api_route("/docs", lambda: HTMLResponse(page, headers=docspage.HEADERS), include_in_schema=False)
    for error in _PROBLEMS:
        app.add_exception_handler(error, _respond)
    app.add_middleware(Edge, state=app.state.service)
    return app


@asynccontextmanager
async def _running(app: FastAPI) -> AsyncIterator[None]:
    """Run the jobs and missions of the data folder as long as the application runs."""
    state, metrics = state_of(app), state_of(app).metrics
    limits = state.settings.limits
    store: Store = state.store if state.store is not None else await asyncio.to_thread(open_store, state.settings.place)
    state.store = store
    if state.settings.store is not None:
        state.keys = await asyncio.to_thread(KeyRow, store)
    slots = Slots(limits.slots)
    state.jobs = jobs = Jobs(
        store,
        JobSettings(
            limits=limits,
            planned=metrics.planned,
            failed=metrics.failed,
            commands=state.settings.planners,
        ),
        slots,
    )
    state.missions = missions = Missions(
        store,
        MissionSettings(
            limits=limits,
            planned=metrics.planned,
            failed=metrics.failed,
            lag=metrics.lag,
            resumed=metrics.resumed,
            commands=state.settings.planners,
            has_valid_key=lambda owner: (
                not state.settings.needs_keys or owner == LOCAL_OWNER or state.keys.has_valid_key(owner, time.time())
            ),
        ),
        slots,
    )
    state.started = True
    watch = asyncio.create_task(measure_delay(metrics.delay))
    try:
        await jobs.start()
        await asyncio.to_thread(launcher.warm_up, wait=False, preload=READERS)
        await missions.start()
        yield
    finally:
        watch.cancel()
        await asyncio.gather(jobs.stop(), missions.stop())
        await asyncio.to_thread(store.close)


def _respond(request: Request, error: Exception) -> Response:
    """Return the response for an exception; unexpected ones propagate to the edge."""
    problem = next(of(request, error) for kind, of in _PROBLEMS.items() if isinstance(error, kind))
    return answer(problem, request.url.path)


def _invalid_request(_: Request, error: RequestValidationError) -> HttpProblem:
    """Return the problem for pydantic's errors outside a body."""
    details = []
    for one in error.errors():
        place, *location = one["loc"]
        where = place if place in ("query", "header", "path") else "query"
        name = str(location[0]) if location else ""
        details.append(ProblemDetailAnswer.model_validate({where: name, "detail": str(one["msg"])}))
    return HttpProblem("invalid", errors=details)


def _http(request: Request, error: HTTPException) -> HttpProblem:
    """Return the problem for an exception of the framework: no such route, no such method."""
    kind = _KIND_OF_STATUS.get(error.status_code, "internal" if error.status_code >= 500 else "invalid")
    headers = {"Allow": ", ".join(_methods(request))} if kind == "no-method" else {}
    return HttpProblem(kind, headers=headers)


def _methods(request: Request) -> Sequence[str]:
    """Return the methods allowed at the path of the request."""

    def matches(method: str) -> bool:
        scope = {**request.scope, "method": method}
        return any(route.matches(scope)[0] is Match.FULL for route in request.app.router.routes)

    found = list(filter(matches, ("DELETE", "GET", "POST", "PUT")))
    return sorted([*found, "HEAD"]) if "GET" in found else found


def _later(kind: str, text: str, seconds: int) -> HttpProblem:
    return HttpProblem(kind, text, headers={"Retry-After": str(seconds)})


_PROBLEMS: dict[type[Exception], Callable[[Request, Any], HttpProblem]] = {
    HttpProblem: lambda _, error: error,
    MarsupialError: lambda _, error: problem_of(error, None),
    RequestValidationError: _invalid_request,
    HTTPException: _http,
    ReportConflict: lambda _, error: problem_of_all("conflict", error.problems, None),
    UnknownEntry: lambda _, error: HttpProblem("not-found", str(error)),
    StoreFull: lambda _, error: _later("store-full", str(error), RETRY_AFTER_S),
    TooMany: lambda _, error: _later("too-many", str(error), error.retry_after_s),
    KeyReused: lambda _, error: HttpProblem("key-reused", "the key was used for a different request; use a new key"),
    StoreError: lambda _, error: _later("not-ready", error.public_message, _STORE_RETRY_S),
}
