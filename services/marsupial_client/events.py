"""The events of streams, typed by their data.

Types that aren't listed here are skipped: a newer service may send more.
"""

import json
from collections.abc import Callable, Mapping
from typing import Any, Generic, Literal, NamedTuple, TypeAlias, TypeVar

import httpx2

from marsupial_client.documents import JobEnded, JobStateChanged, PlanFound
from marsupial_client.errors import ClientError
from marsupial_client.mission_documents import (
    Commands,
    Decision,
    FrameGrown,
    MissionEnded,
    MissionStateChanged,
    QuotaChanged,
)

K = TypeVar("K")
D = TypeVar("D")


class Event(NamedTuple, Generic[K, D]):
    """An event: its number in the stream, from 1, its type and its data.

    The data is a document, except for a mission's `log` events: there it is a line of the mission log as text.
    """

    id: int
    type: K
    data: D


JobEvent: TypeAlias = (
    Event[Literal["state"], JobStateChanged] | Event[Literal["plan"], PlanFound] | Event[Literal["end"], JobEnded]
)
MissionEvent: TypeAlias = (
    Event[Literal["log"], str]
    | Event[Literal["decision"], Decision]
    | Event[Literal["commands"], Commands]
    | Event[Literal["state"], MissionStateChanged]
    | Event[Literal["frame"], FrameGrown]
    | Event[Literal["quota"], QuotaChanged]
    | Event[Literal["end"], MissionEnded]
)

END = "end"
"""The last event of every stream."""

Readers = Mapping[str, Callable[[str], Any]]
"""How to read the data of each type of event."""

JOB_EVENTS: Readers = dict.fromkeys(("state", "plan", END), json.loads)
MISSION_EVENTS: Readers = {
    "log": str,
    **dict.fromkeys(("decision", "commands", "state", "frame", "quota", END), json.loads),
}


def event_of(number: int, frame: httpx2.ServerSentEvent, readers: Readers, path: str) -> Event[str, Any] | None:
    """Return an event of the stream at `path`; None for a type that has no reader. Raises ClientError."""
    if frame.event not in readers:
        return None
    try:
        return Event(number, frame.event, readers[frame.event](frame.data))
    except (ValueError, RecursionError) as error:
        raise ClientError(f"{path}: the data of event {number} ({frame.event}) is not JSON") from error
