"""Health, readiness and metrics, for operators."""

import asyncio
import logging
import sqlite3
import time
from importlib.metadata import version

from fastapi import APIRouter, Response
from fastapi.responses import PlainTextResponse

from marsupial.processes import launcher
from marsupial.processes.jobs import JobLimits
from marsupial_service.entries.capacity import stored_bytes
from marsupial_service.http.answers import NOT_CACHED, json_answer
from marsupial_service.http.openapi import errors
from marsupial_service.http.routing import AdminRoute, ServiceRoute
from marsupial_service.jobs.work import try_planning
from marsupial_service.missions.table import counts
from marsupial_service.problems import HttpProblem
from marsupial_service.routes.parameters import ServiceState
from marsupial_service.schemas import answers
from marsupial_service.state import State
from marsupial_service.store import StoreError

router = APIRouter(route_class=ServiceRoute, tags=["operations"])
admin = APIRouter(route_class=AdminRoute, tags=["operations"])

# how long a check of readiness holds: a stranger may ask, and it costs a process
FRESH_S = 2.0

# how long an answer waits for a check; after that the result of the last check is used, unless it is old
_WAIT_S = 1.0
_OLD_S = 30.0
_RETRY_S = 1

_READY_S = 20.0
# how long the store may take: a disk may hang, a lock may be held
_STORE_S = 5.0

log = logging.getLogger("marsupial.service")


@router.get("/healthz", response_model=answers.HealthAnswer, responses=errors(key=False))
async def healthz() -> Response:
    """Confirm that the service is running."""
    return json_answer(answers.HealthAnswer(version=version("marsupial")))


@router.get("/readyz", response_model=answers.ReadyAnswer, responses=errors("not-ready", key=False))
async def readyz(state: ServiceState) -> Response:
    """Check that the service can plan for a tiny situation in a separate process, and write and read the store.

    Answers within a second; while the service starts, it says how far it is.
    """
    loading = launcher.loading_now()
    found = await _checked(state) if loading is None else f"starting: {loading}"
    if isinstance(found, str):
        raise HttpProblem("not-ready", found, headers={"Retry-After": str(_RETRY_S)})
    return json_answer(found)


@admin.get("/metrics", response_class=PlainTextResponse, responses=errors())
async def metrics(state: ServiceState) -> Response:
    """Return the metrics in Prometheus' text format."""
    values = {
        **await state.jobs.metrics(),
        **await state.missions.read(lambda reader: counts(reader, state.missions.now_ms())),
        "planning_seconds_left": await state.jobs.left_s(),
        "store_bytes": await state.jobs.read(stored_bytes),
        "store_disk_bytes": await state.jobs.disk_bytes(),
        "event_streams": sum(state.streams.values()),
        "requests_waiting": {"readers": state.readers.slots.waiting(), "analyses": state.analyses.slots.waiting()},
        "store_errors": {} if state.store is None else state.store.failures,
    }
    return PlainTextResponse(state.metrics.text(values), headers=NOT_CACHED)


async def _checked(state: State) -> answers.ReadyAnswer | str:
    """Return the result of a new check, or of the last one if that is fresh or the new one takes long."""
    readiness = state.readiness
    if readiness.checking is None and time.monotonic() - readiness.checked_s > FRESH_S:
        readiness.checking = asyncio.create_task(_check_anew(state))
    if readiness.checking is not None:
        await asyncio.wait({readiness.checking}, timeout=_WAIT_S)
        if time.monotonic() - readiness.checked_s > _OLD_S:
            return f"planning and the store are being checked, which takes longer than {_WAIT_S:g} s"
    return readiness.found


async def _check_anew(state: State) -> None:
    readiness = state.readiness
    try:
        readiness.found = await _check(state)
        readiness.checked_s = time.monotonic()
    finally:
        readiness.checking = None


async def _check(state: State) -> answers.ReadyAnswer | str:
    started_s = time.monotonic()
    limits = JobLimits(wall_s=_READY_S, memory_bytes=state.settings.limits.memory_bytes)
    try:
        planned = await state.supervised.value_of(try_planning, None, limits)
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
