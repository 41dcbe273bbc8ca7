"""Missions with robots that are not ours: created, reported to, followed, paused, resumed, cancelled."""

from __future__ import annotations

import asyncio
from typing import Annotated, Any

from fastapi import APIRouter, Response
from starlette.responses import PlainTextResponse

from marsupial_service.answers import json_answer
from marsupial_service.events import EventStream, stream
from marsupial_service.keys import Scope
from marsupial_service.missions.reading import read_brief, read_report
from marsupial_service.missions.records import MissionRecord
from marsupial_service.missions.values import Wish, runs_in
from marsupial_service.moments import timestamp, timestamp_if_any
from marsupial_service.openapi import errors
from marsupial_service.routes.parameters import (
    IdempotencyKey,
    Json,
    LastEventId,
    MissionOfPath,
    Owner,
    PageLimit,
    Service,
    digest_of,
    older_than,
)
from marsupial_service.routes.stored import headers_of, page, stored
from marsupial_service.routing import Route
from marsupial_service.schemas.base import Answer
from marsupial_service.schemas.missions import MissionBody, ReportBody


class MissionRoute(Route):
    """A route for keys that may steer missions."""

    scope = Scope.MISSION


class LogAnswer(PlainTextResponse):
    """A mission log."""

    media_type = "application/jsonl"


class MissionLinks(Answer):
    """Where there is more about a mission."""

    self: str
    reports: str
    events: str
    log: str
    map: str
    pause: str
    resume: str
    cancel: str


class Mission(Answer):
    """A mission: `status` and `reason` say how it ended, `n` and `t_ms` which report was the last."""

    id: str
    name: str
    state: str
    status: str | None
    reason: str
    strategy: str
    planner: str
    n: int
    t_ms: int
    revision: int
    created_at: str
    finished_at: str | None
    links: MissionLinks


class MissionList(Answer):
    """Missions, the newest first; `next` is where the older ones are."""

    missions: list[Mission]
    next: str | None


class Taken(Answer):
    """A report has been stored: its number, its time, and the revision of the plan that was made last."""

    n: int
    t_ms: int
    revision: int


class KnownMap(Answer):
    """What is known of the map: (start, length, terrain code) three by three."""

    width: int
    height: int
    resolution_m: float
    origin_m: list[float]
    runs: list[int]


router = APIRouter(prefix="/v1/missions", route_class=MissionRoute, tags=["missions"])


@router.post(
    "",
    status_code=201,
    response_model=Mission,
    responses=stored(Mission, "mission", 201, at_once="An earlier request with that key has made the mission."),
)
async def create_mission(
    state: Service, owner: Owner, sent: Json, body: MissionBody, idempotency_key: IdempotencyKey = None
) -> Response:
    """Store a mission and begin it: its first commands ask for the first report."""
    settings = state.settings
    brief = await asyncio.to_thread(read_brief, sent, settings.limits, settings.planners)
    created = await state.flying().create(brief, digest_of(sent), owner=owner, idempotency_key=idempotency_key)
    record, replayed = created
    return json_answer(_document(record), 200 if replayed else 201, headers_of(created, _path(record)))


@router.get("", response_model=MissionList, responses=errors())
async def list_missions(
    state: Service,
    owner: Owner,
    limit: PageLimit = 50,
    before: Annotated[str | None, older_than("mission")] = None,
) -> Response:
    """List one's missions, the newest first."""
    found = await state.flying().list(owner, limit=limit + 1, before=before)
    missions, following = page(found, limit, router.prefix)
    return json_answer({"missions": [_document(record) for record in missions], "next": following})


@router.get("/{mission}", response_model=Mission, responses=errors("not-found"))
async def get_mission(mission: MissionOfPath) -> Response:
    """Return a mission."""
    return json_answer(_document(mission))


@router.post(
    "/{mission}/reports",
    response_model=Taken,
    responses=errors("not-found", "conflict", "too-many", "not-ready", body=True),
)
async def report(state: Service, mission: MissionOfPath, sent: Json, body: ReportBody) -> Response:
    """Take in what has happened. A report that is sent again changes nothing; one that is refused neither."""
    missions = state.flying()
    read = await asyncio.to_thread(read_report, sent, await missions.brief(mission))
    taken = await missions.report(mission, read, digest_of(sent))
    return json_answer({"n": read.n, "t_ms": read.t_ms, "revision": taken.revision})


@router.post("/{mission}/pause", response_model=Mission, responses=errors("not-found", "conflict", "not-ready"))
async def pause_mission(state: Service, mission: MissionOfPath) -> Response:
    """Let the robots that drive stop, and give no commands until the mission is resumed."""
    return await _wish(state, mission, Wish.PAUSE)


@router.post("/{mission}/resume", response_model=Mission, responses=errors("not-found", "conflict", "not-ready"))
async def resume_mission(state: Service, mission: MissionOfPath) -> Response:
    """Let a paused mission go on."""
    return await _wish(state, mission, Wish.RESUME)


@router.post("/{mission}/cancel", response_model=Mission, responses=errors("not-found", "conflict", "not-ready"))
async def cancel_mission(state: Service, mission: MissionOfPath) -> Response:
    """End a mission, with its stop report. One that is over stays as it is."""
    return await _wish(state, mission, Wish.CANCEL)


@router.get(
    "/{mission}/events",
    response_class=EventStream,
    responses={
        **errors("not-found", "too-many"),
        200: {"description": "Events `log`, `decision`, `commands`, `state` and `end`, with ids from 1."},
    },
)
async def follow_mission(
    state: Service, owner: Owner, mission: MissionOfPath, last_event_id: LastEventId = None
) -> Response:
    """Stream what a mission commands and decides as it comes, what is stored first; ends after `end`."""
    return stream(state, owner, state.flying(), mission.id, last_event_id)


@router.get("/{mission}/log", response_class=LogAnswer, responses=errors("not-found"))
async def get_log(state: Service, mission: MissionOfPath) -> Response:
    """Return the mission log so far, as `marsupial replay` reads it; of a changed map, since the change."""
    return LogAnswer(await state.flying().log(mission), headers={"Cache-Control": "no-store"})


@router.get("/{mission}/map", response_model=KnownMap, responses=errors("not-found"))
async def get_known_map(state: Service, mission: MissionOfPath) -> Response:
    """Return what is known of the map after the last report."""
    missions = state.flying()
    grid, ledger = (await missions.brief(mission)).grid, await missions.ledger(mission)
    return json_answer(
        {
            "width": grid.width,
            "height": grid.height,
            "resolution_m": grid.resolution_m,
            "origin_m": list(grid.origin_m),
            "runs": list(runs_in(ledger.cells)),
        }
    )


async def _wish(state: Service, mission: MissionRecord, wish: Wish) -> Response:
    return json_answer(_document(await state.flying().wish(mission, wish)))


def _path(record: MissionRecord) -> str:
    return f"/v1/missions/{record.id}"


def _document(record: MissionRecord) -> dict[str, Any]:
    path = _path(record)
    words = ("reports", "events", "log", "map", "pause", "resume", "cancel")
    return {
        "id": record.id,
        "name": record.name,
        "state": record.state.value,
        "status": record.status,
        "reason": record.reason,
        "strategy": record.strategy,
        "planner": record.planner,
        "n": record.n,
        "t_ms": record.t_ms,
        "revision": record.revision,
        "created_at": timestamp(record.created_at_ms),
        "finished_at": timestamp_if_any(record.finished_at_ms),
        "links": {"self": path, **{word: f"{path}/{word}" for word in words}},
    }
