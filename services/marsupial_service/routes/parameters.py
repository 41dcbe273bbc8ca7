"""What several routes take: who asks, headers, the job of the path."""

from __future__ import annotations

import hashlib
import json
import re
from typing import Annotated, Any

from fastapi import Depends, Header, Path, Request

from marsupial_service.jobs import JobRecord, UnknownJob
from marsupial_service.state import State, state_of

_WAIT = re.compile(r"\s*wait\s*=\s*\"?(\d{1,9})\"?\s*(?:;.*)?", re.IGNORECASE)


def _state(request: Request) -> State:
    return state_of(request.app)


def _owner(request: Request) -> str:
    owner: str = request.state.owner
    return owner


def _json(request: Request) -> Any:
    return request.state.json


Service = Annotated[State, Depends(_state)]
Owner = Annotated[str, Depends(_owner)]
Json = Annotated[Any, Depends(_json)]
"""The body as it was sent, once its shape has been checked."""

Prefer = Annotated[
    str | None,
    Header(description="`wait=5` waits up to 5 s for the job to end.", max_length=200),
]
IdempotencyKey = Annotated[
    str | None,
    Header(description="The same key and body give the same job.", pattern=r"^[\x21-\x7e]{1,200}$"),
]
LastEventId = Annotated[
    str | None,
    Header(alias="Last-Event-ID", description="The last event seen: later ones are sent.", pattern=r"^[0-9]{1,15}$"),
]


async def _job(
    state: Service, owner: Owner, job: Annotated[str, Path(description="Id of a job.", max_length=100)]
) -> JobRecord:
    found = await state.running().get(job, owner)
    if found is None:
        raise UnknownJob(job)
    return found


JobOfPath = Annotated[JobRecord, Depends(_job)]


def digest_of(sent: Any) -> bytes:
    """Return what tells requests apart: the same for bodies that say the same."""
    return hashlib.sha256(json.dumps(sent, sort_keys=True).encode()).digest()


def wait_seconds(prefer: str | None, limit: float) -> float | None:
    """Return how long a request wants to wait (RFC 7240), as far as the limit allows; None if it doesn't."""
    for preference in (prefer or "").split(","):
        match = _WAIT.fullmatch(preference)
        if match is not None:
            return min(float(match[1]), limit)
    return None
