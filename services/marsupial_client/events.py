"""Events as they come out of a stream: typed by what they tell.

What isn't listed here is passed over: a newer service may tell more.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from typing import Any, Generic, Literal, NamedTuple, TypeAlias, TypeVar

from marsupial_client.documents import JobEnded, JobMoved, PlanFound
from marsupial_client.mission_documents import Commands, Decision, FrameGrown, MissionEnded, MissionMoved, QuotaTold

K = TypeVar("K")
D = TypeVar("D")


class Event(NamedTuple, Generic[K, D]):
    """An event: its number in its stream, from 1; what it tells; and its data.

    The data is a document, but of a mission's `log`, where it is the line of the mission log as it is.
    """

    id: int
    type: K
    data: D


JobEvent: TypeAlias = (
    Event[Literal["state"], JobMoved] | Event[Literal["plan"], PlanFound] | Event[Literal["end"], JobEnded]
)
MissionEvent: TypeAlias = (
    Event[Literal["log"], str]
    | Event[Literal["decision"], Decision]
    | Event[Literal["commands"], Commands]
    | Event[Literal["state"], MissionMoved]
    | Event[Literal["frame"], FrameGrown]
    | Event[Literal["quota"], QuotaTold]
    | Event[Literal["end"], MissionEnded]
)

END = "end"
"""The last event of every stream."""

Readers = Mapping[str, Callable[[str], Any]]
JOB_EVENTS: Readers = {"state": json.loads, "plan": json.loads, END: json.loads}
MISSION_EVENTS: Readers = {
    "log": str,
    "decision": json.loads,
    "commands": json.loads,
    "state": json.loads,
    "frame": json.loads,
    "quota": json.loads,
    END: json.loads,
}
"""How the data of each event is read."""
