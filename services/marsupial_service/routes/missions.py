"""Missions with the clients' own robots: create, report, follow, pause, resume, cancel."""

import asyncio
from collections.abc import Iterable
from typing import Annotated, Any

from fastapi import APIRouter, Body, Response
from starlette.responses import PlainTextResponse

from marsupial.formats.scenario.zones import zone_fields
from marsupial.model.missionframe import MissionFrame
from marsupial.model.zones import DatedZone, ZoneChange
from marsupial_service.entries.records import Created
from marsupial_service.http.answers import NOT_CACHED, json_answer, mission_answer, text_answer
from marsupial_service.http.events import EventStream, stream
from marsupial_service.http.openapi import errors
from marsupial_service.http.routing import ServiceRoute
from marsupial_service.intake.missions import (
    MISSION_READER,
    REPORT_READER,
    ZONE_READER,
    changes_in,
    known_map_text,
)
from marsupial_service.intake.reading import ReceivedBody, read
from marsupial_service.keys import Scope
from marsupial_service.missions.records import MissionRecord
from marsupial_service.missions.values import Control
from marsupial_service.routes.parameters import (
    IdempotencyKey,
    KeyIsValid,
    LastEventId,
    Owner,
    PageLimit,
    PathMission,
    PathZone,
    ServiceState,
    headers_of,
    older_than,
    page,
    stored,
    streamed,
)
from marsupial_service.schemas import answers
from marsupial_service.schemas.base import described_by
from marsupial_service.schemas.missions import MissionBody, ReportsBody, ZoneBody

# changes from cell to cell of a map that is encoded in the server's process: 10 ms at most
_INLINE_CHANGES = 10_000


MISSION_STORED = stored(
    answers.MissionAnswer, "mission", 201, at_once="An earlier request with that key created the mission."
)


class MissionRoute(ServiceRoute):
    """A route for keys that may control missions."""

    scope = Scope.MISSION


class LogAnswer(PlainTextResponse):
    """A mission log."""

    media_type = "application/jsonl"


router = APIRouter(prefix="/v1/missions", route_class=MissionRoute, tags=["missions"])


@router.post("", status_code=201, response_model=answers.MissionAnswer, responses=MISSION_STORED)
async def create_mission(
    state: ServiceState,
    owner: Owner,
    sent: Annotated[ReceivedBody, Body(), described_by(MissionBody)],
    idempotency_key: IdempotencyKey = None,
) -> Response:
    """Create and start a mission; its first `commands` event requests the first report."""
    settings = state.settings
    brief, digest = await read(state.readers, settings.limits, sent, MISSION_READER, settings.planners)
    return created(await state.missions.create(brief, digest, owner=owner, idempotency_key=idempotency_key))


@router.get("", response_model=answers.MissionListAnswer, responses=errors())
async def list_missions(
    state: ServiceState,
    owner: Owner,
    limit: PageLimit = 50,
    before: Annotated[str | None, older_than("mission")] = None,
) -> Response:
    """List your missions, newest first."""
    found = await state.missions.list(owner, limit=limit + 1, before=before)
    missions, following = page(found, limit, router.prefix)
    shown = [mission_answer(record) for record in missions]
    return json_answer(answers.MissionListAnswer(missions=shown, next=following))


@router.get("/{mission}", response_model=answers.MissionAnswer, responses=errors("not-found"))
async def get_mission(mission: PathMission) -> Response:
    """Return a mission."""
    return json_answer(mission_answer(mission))


@router.post(
    "/{mission}/reports",
    response_model=answers.ReceiptAnswer | answers.BatchReceiptAnswer,
    responses=errors("not-found", "conflict", "too-many", "not-ready", "store-full", body=True),
)
async def report(
    state: ServiceState, mission: PathMission, sent: Annotated[ReceivedBody, Body(), described_by(ReportsBody)]
) -> Response:
    """Store a report or a batch of reports; repeating the request changes nothing.

    If one report of a batch is refused, none is stored. The answer to a batch is a batch.
    """
    missions = state.missions
    brief = await missions.brief(mission)
    frame = mission.frame or MissionFrame.of(brief.grid)
    reports, is_batch = await read(state.readers, state.settings.limits, sent, REPORT_READER, brief, frame)
    record = await missions.reports(mission, reports)
    receipts = [answers.ReceiptAnswer.of(one, revision=record.revision) for one, _ in reports]
    return json_answer(answers.BatchReceiptAnswer(reports=receipts) if is_batch else receipts[0])


@router.get("/{mission}/reports", response_model=answers.LastReportsAnswer, responses=errors("not-found"))
async def get_last_reports(state: ServiceState, mission: PathMission) -> Response:
    """Return the numbers of the last reports, from which to continue."""
    return json_answer(await state.missions.last_reports(mission))


_CONTROL_ROUTE: dict[str, Any] = {
    "response_model": answers.MissionAnswer,
    "responses": errors("not-found", "conflict", "key-reused", "not-ready"),
}


@router.post("/{mission}/pause", **_CONTROL_ROUTE)
async def pause_mission(state: ServiceState, mission: PathMission, idempotency_key: IdempotencyKey = None) -> Response:
    """Stop all driving robots, and send no commands until the mission is resumed."""
    return await _control(state, mission, Control.PAUSE, idempotency_key)


@router.post("/{mission}/resume", **_CONTROL_ROUTE)
async def resume_mission(state: ServiceState, mission: PathMission, idempotency_key: IdempotencyKey = None) -> Response:
    """Resume a paused mission."""
    return await _control(state, mission, Control.RESUME, idempotency_key)


@router.post("/{mission}/wind-down", **_CONTROL_ROUTE)
async def wind_down_mission(
    state: ServiceState, mission: PathMission, idempotency_key: IdempotencyKey = None
) -> Response:
    """End exploring: robots return as the goal says, and then the mission ends. Also ends a pause."""
    return await _control(state, mission, Control.WIND_DOWN, idempotency_key)


@router.post("/{mission}/cancel", **_CONTROL_ROUTE)
async def cancel_mission(state: ServiceState, mission: PathMission) -> Response:
    """Cancel a mission, which ends with its stop report. A mission that has ended does not change."""
    return await _control(state, mission, Control.CANCEL)


@router.get("/{mission}/zones", response_model=answers.ZonesAnswer, responses=errors("not-found"))
async def get_zones(state: ServiceState, mission: PathMission) -> Response:
    """Return the zones of a mission that hold or will."""
    return _zones_answer(await state.missions.zones(mission))


@router.put(
    "/{mission}/zones/{zone}",
    response_model=answers.ZonesAnswer,
    responses=errors("not-found", "conflict", "key-reused", "too-many", "not-ready", "store-full", body=True),
)
async def put_zone(
    state: ServiceState,
    mission: PathMission,
    zone: PathZone,
    sent: Annotated[ReceivedBody, Body(), described_by(ZoneBody)],
    idempotency_key: IdempotencyKey = None,
) -> Response:
    """Add a zone, which holds from now on, or replace the one of that name."""
    brief = await state.missions.brief(mission)
    change = await read(state.readers, state.settings.limits, sent, ZONE_READER, zone, brief)
    return _zones_answer(await state.missions.change_zone(mission, change, idempotency_key))


@router.delete(
    "/{mission}/zones/{zone}",
    response_model=answers.ZonesAnswer,
    responses=errors("not-found", "conflict", "key-reused", "too-many", "not-ready", "store-full"),
)
async def delete_zone(
    state: ServiceState, mission: PathMission, zone: PathZone, idempotency_key: IdempotencyKey = None
) -> Response:
    """Remove a zone; nothing changes if there is none of that name."""
    change = ZoneChange(name=zone, zone=None)
    return _zones_answer(await state.missions.change_zone(mission, change, idempotency_key))


@router.get(
    "/{mission}/events",
    response_class=EventStream,
    responses=streamed("Events `log`, `decision`, `commands`, `state`, `frame`, `quota` and `end`, with ids from 1."),
)
async def follow_mission(
    state: ServiceState, owner: Owner, is_valid: KeyIsValid, mission: PathMission, last_event_id: LastEventId = None
) -> Response:
    """Stream the events of a mission, first the stored ones, then new ones, up to the event `end`."""
    return await stream(state, owner, is_valid, state.missions, mission.id, last_event_id)


@router.get("/{mission}/log", response_class=LogAnswer, responses=errors("not-found"))
async def get_log(state: ServiceState, mission: PathMission) -> Response:
    """Return the mission log so far, as `marsupial replay` reads it."""
    return LogAnswer(await state.missions.log(mission), headers=NOT_CACHED)


@router.get("/{mission}/map", response_model=answers.KnownMapAnswer, responses=errors("not-found"))
async def get_known_map(state: ServiceState, owner: Owner, mission: PathMission) -> Response:
    """Return the map as known after the last report."""
    known = await state.missions.known(mission)
    if await asyncio.to_thread(changes_in, known.cells) <= _INLINE_CHANGES:
        return text_answer(known_map_text(known))
    return text_answer(await state.readers.value_of(owner, known_map_text, known))


def created(creation: Created[MissionRecord]) -> Response:
    """Return the answer for a stored mission."""
    answer = mission_answer(creation.record)
    return json_answer(answer, 200 if creation.replayed else 201, headers_of(creation, answer.links.self))


def _zones_answer(zones: Iterable[DatedZone]) -> Response:
    return json_answer(answers.ZonesAnswer(zones=[answers.ZoneAnswer(**zone_fields(zone)) for zone in zones]))


async def _control(state: ServiceState, mission: MissionRecord, control: Control, key: str | None = None) -> Response:
    return json_answer(mission_answer(await state.missions.control(mission, control, key)))
