"""What passes between missions and those who ask for them: states, records, settings."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum

from marsupial_service.entries.records import Entry, EntrySettings
from marsupial_service.missions.values import Wish


class MissionState(StrEnum):
    """Where a mission is; the last one is final."""

    RUNNING = "running"
    PAUSED = "paused"
    CANCELLING = "cancelling"
    ENDED = "ended"


MOVES: Mapping[StrEnum, frozenset[StrEnum]] = {
    MissionState.RUNNING: frozenset({MissionState.PAUSED, MissionState.CANCELLING, MissionState.ENDED}),
    MissionState.PAUSED: frozenset({MissionState.RUNNING, MissionState.CANCELLING, MissionState.ENDED}),
    MissionState.CANCELLING: frozenset({MissionState.ENDED}),
    MissionState.ENDED: frozenset(),
}
"""The states that may follow each state."""

WISHED: Mapping[Wish, MissionState] = {
    Wish.PAUSE: MissionState.PAUSED,
    Wish.RESUME: MissionState.RUNNING,
    Wish.CANCEL: MissionState.CANCELLING,
}
"""The state that each wish asks for."""


@dataclass(frozen=True, slots=True, kw_only=True)
class MissionRecord(Entry):
    """A mission as it is stored; it has a `status` if and only if it has ended.

    Parameters
    ----------
    n, t_ms
        Number and time of the last report.
    revision
        Of the plan that was made last.
    inputs, turns
        How much went in, and how many answers came out: an answer to the brief and then one to each input.
    """

    state: MissionState
    name: str
    strategy: str
    planner: str
    status: str | None
    reason: str
    n: int
    t_ms: int
    revision: int
    inputs: int
    turns: int


@dataclass(frozen=True, slots=True, kw_only=True)
class MissionSettings(EntrySettings):
    """What missions may use.

    Parameters
    ----------
    missions
        How many may be open at a time.
    backlog
        How many reports of one mission may wait for its process.
    """

    missions: int = 20
    backlog: int = 1000
    kept: int = 1000
