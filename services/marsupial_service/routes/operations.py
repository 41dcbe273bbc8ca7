"""Health, readiness and metrics, for operators."""

import asyncio
import logging
import sqlite3
import time
from importlib.metadata import version

from fastapi import APIRouter, Response
from fastapi.responses import PlainTextResponse

from marsupial.processes.jobs import JobLimits
from marsupial_service.entries.capacity import stored_bytes
from marsupial_service.http.answers import NOT_CACHED, json_answer
from marsupial_service.http.openapi import errors
from marsupial_service.http.routing import AdminRoute, Route
from marsupial_service.jobs.work import try_planning
from marsupial_service.missions.table import counts
from marsupial_service.problems import HttpProblem
from marsupial_service.routes.parameters import Service
from marsupial_service.schemas import answers
from marsupial_service.state import State
from marsupial_service.store import StoreError

router = APIRouter(route_class=Route, tags=["operations"])
admin = APIRouter(route_class=AdminRoute, tags=["operations"])

# how long a check of readiness holds: a stranger may ask, and it costs a process
FRESH_S = 2.0

_READY_S = 20.0
# how long the store may take: a disk may hang, a lock may be held
_STORE_S = 5.0

log = logging.getLogger("marsupial.service")


@router.get("/healthz", response_model=answers.HealthAnswer, responses=errors(key=False))
async def healthz() -> Response:
    """Confirm that the service is running."""
    return json_answer(answers.HealthAnswer(version=version("marsupial")))


@router.get("/readyz", response_model=answers.ReadyAnswer, responses=errors("not-ready", key=False))
async def readyz(state: Service) -> Response:
    """Check that the service can plan for a tiny situation in a separate process, and write and read the store."""
    # of many concurrent requests, the first one checks and the others get its result
    async with state.readiness.lock:
        if time.monotonic() - state.readiness.checked_s > FRESH_S:
            state.readiness.found = await _check(state)
            state.readiness.checked_s = time.monotonic()
        found = state.readiness.found
    if isinstance(found, str):
        raise HttpProblem("not-ready", found, headers={"Retry-After": "2"})
    return json_answer(found)


@admin.get("/metrics", response_class=PlainTextResponse, responses=errors())
async def metrics(state: Service) -> Response:
    """Return the metrics in Prometheus' text format."""
    values = {
        **await state.jobs.metrics(),
        **await state.missions.read(counts),
        "planning_seconds_left": await state.jobs.left_s(),
        "store_bytes": await state.jobs.read(stored_bytes),
        "store_disk_bytes": await state.jobs.disk_bytes(),
        "event_streams": sum(state.streams.values()),
    }
    return PlainTextResponse(state.metrics.text(values), headers=NOT_CACHED)


async def _check(state: State) -> answers.ReadyAnswer | str:
    started_s = time.monotonic()
    limits = JobLimits(wall_s=_READY_S, memory_bytes=state.settings.limits.memory_bytes)
    try:
        if (fault := state.runner.fault()) is not None:
            return f"planning is not available: {fault}"
        planned = await state.supervised.value_of(try_planning, None, limits, state.runner)
    except HttpProblem as error:
        return f"planning {'is not available' if error.kind == 'not-ready' else 'fails'}: {error}"
    except Exception:
        log.exception("readiness check failed")
        return "planning fails; see the server log"
    if planned is not True:
        return "planning returns no valid plan"
    took_ms = round(1000 * (time.monotonic() - started_s), 1)
    try:
        async with asyncio.timeout(_STORE_S):
            await state.jobs.write(
                lambda tx: tx.execute("UPDATE servers SET beat_s = beat_s WHERE id = ?", (tx.server,))
            )
            await state.jobs.metrics()
    except TimeoutError:
        return f"the store does not answer within {_STORE_S:g} s"
    except StoreError as error:
        return error.public_message
    except Exception:
        log.exception("readiness check failed")
        return "the store is not available; see the server log"
    return answers.ReadyAnswer(planned_in_ms=took_ms, sqlite=sqlite3.sqlite_version, version=version("marsupial"))
