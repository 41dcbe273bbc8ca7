"""What passes between missions and those who ask for them: records, settings, refusals."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

from marsupial_service.missions.values import EventType


class MissionState(StrEnum):
    """Where a mission is; the last one is final."""

    RUNNING = "running"
    PAUSED = "paused"
    CANCELLING = "cancelling"
    ENDED = "ended"


@dataclass(frozen=True, slots=True, kw_only=True)
class MissionRecord:
    """A mission as it is stored; `status` and `finished_at_ms` are there if and only if it has ended.

    Parameters
    ----------
    n, t_ms
        Number and time of the last report.
    revision
        Of the plan that was made last.
    inputs, turns
        How much went in, and how many answers came out: an answer to the brief and then one to each input.
    """

    number: int
    id: str
    owner: str
    name: str
    strategy: str
    planner: str
    state: MissionState
    status: str | None
    reason: str
    n: int
    t_ms: int
    revision: int
    inputs: int
    turns: int
    created_at_ms: int
    finished_at_ms: int | None


@dataclass(frozen=True, slots=True, kw_only=True)
class MissionEventRecord:
    """An event of a mission: `seq` counts from 1, `data` is one line of JSON."""

    seq: int
    type: EventType
    data: str


@dataclass(frozen=True, slots=True, kw_only=True)
class MissionSettings:
    """What missions may use.

    Parameters
    ----------
    missions
        How many may be open at a time.
    backlog
        How many reports of one mission may wait for its process.
    memory_bytes
        Of all processes of one mission together.
    retention_s, kept_missions
        Missions that ended are removed when they are that old, or when there are more than that many.
    """

    missions: int = 20
    backlog: int = 1000
    memory_bytes: int = 2 << 30
    retention_s: float = 24 * 3600.0
    kept_missions: int = 1000


class TooMany(Exception):
    """No more missions, or no more reports, are taken at the moment."""


class UnknownMission(Exception):
    """There is no such mission, or no longer."""
