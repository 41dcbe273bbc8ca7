"""Parameters (owner, headers, the entry in the path) and responses (an entry, a page of a list) of several routes."""

import re
import time
from collections.abc import Callable, Sequence
from typing import Annotated, Any
from urllib.parse import urlencode

from fastapi import Depends, Header, Path, Query, Request

from marsupial_service.entries.records import Created, E
from marsupial_service.http.openapi import errors
from marsupial_service.jobs.records import JobRecord
from marsupial_service.keys import Key
from marsupial_service.missions.records import MissionRecord
from marsupial_service.schemas.base import Answer, RobotName
from marsupial_service.state import State, state_of

_WAIT = re.compile(r"\s*wait\s*=\s*\"?(\d{1,9})\"?\s*(?:;.*)?", re.IGNORECASE)


async def _state(request: Request) -> State:
    return state_of(request.app)


async def _owner(request: Request) -> str:
    owner: str = request.state.owner
    return owner


async def _key_is_valid(state: Annotated[State, Depends(_state)], request: Request) -> Callable[[], bool]:
    key: Key | None = request.state.key
    return lambda: key is None or state.keys.is_still_valid(key, time.time())


ServiceState = Annotated[State, Depends(_state)]
Owner = Annotated[str, Depends(_owner)]
KeyIsValid = Annotated[Callable[[], bool], Depends(_key_is_valid)]
"""A function that returns whether the key of the request is still valid."""

Prefer = Annotated[str | None, Header(description="`wait=5` waits up to 5 s for the job to end.", max_length=200)]
IdempotencyKey = Annotated[
    str | None, Header(description="Repeating a key and request changes nothing.", pattern=r"^[\x21-\x7e]{1,200}$")
]
LastEventId = Annotated[
    str | None,
    Header(
        alias="Last-Event-ID",
        description="Id of the last event received; later events are sent.",
        pattern=r"^[0-9]{1,15}$",
    ),
]


PageLimit = Annotated[int, Query(ge=1, le=200)]


def older_than(noun: str) -> Any:
    """Return the parameter of a list that begins after one of its entries."""
    return Query(description=f"Id of a {noun}; only older ones are listed.", max_length=100)


_JobId = Annotated[str, Path(description="Id of a job.", max_length=100)]
_MissionId = Annotated[str, Path(description="Id of a mission.", max_length=100)]


async def _job(state: ServiceState, owner: Owner, job: _JobId) -> JobRecord:
    return await state.jobs.of(owner, job)


async def _mission(state: ServiceState, owner: Owner, mission: _MissionId) -> MissionRecord:
    return await state.missions.of(owner, mission)


PathJob = Annotated[JobRecord, Depends(_job)]
PathMission = Annotated[MissionRecord, Depends(_mission)]
PathZone = Annotated[RobotName, Path(description="Name of a zone.")]


def wait_seconds(prefer: str | None, limit: float) -> float | None:
    """Return how long a request wants to wait (RFC 7240), at most `limit`; None if it doesn't."""
    for preference in (prefer or "").split(","):
        match = _WAIT.fullmatch(preference)
        if match is not None:
            return min(float(match[1]), limit)
    return None


def stored(model: type[Answer], noun: str, status: int, at_once: str) -> dict[int | str, dict[str, Any]]:
    """Return the responses of a route that stores an entry; it may answer 200 instead, `at_once`."""
    answer = {"model": model, "headers": {"Location": {"schema": {"type": "string"}}}}
    return {
        **errors("key-reused", "too-many", "not-ready", "store-full", body=True),
        200: {**answer, "description": at_once},
        status: {**answer, "description": f"The {noun} is stored; its URL is in Location."},
    }


def streamed(events: str) -> dict[int | str, dict[str, Any]]:
    """Return the responses of a route that streams these events."""
    return {
        **errors("not-found", "too-many"),
        204: {"description": "No more events follow the one of `Last-Event-ID`."},
        200: {"description": events},
    }


def headers_of(created: Created[E], path: str) -> dict[str, str]:
    """Return the headers with the location of an entry, and whether an earlier request created it."""
    return {"Location": path} | ({"Idempotency-Replayed": "true"} if created.replayed else {})


def page(found: Sequence[E], limit: int, path: str, **query: str | None) -> tuple[Sequence[E], str | None]:
    """Return the page of a list, and where the next one is; `found` has one entry more if there is one."""
    if len(found) <= limit:
        return found, None
    words = {"limit": limit, **query, "before": found[limit - 1].id}
    return found[:limit], f"{path}?{urlencode({name: word for name, word in words.items() if word is not None})}"
