"""What passes between missions and those who ask for them: states, records, settings."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from enum import StrEnum

from marsupial_service.entries.records import EntrySettings, StoredEntry
from marsupial_service.missions.frames import MissionFrame
from marsupial_service.missions.values import Control
from marsupial_service.schemas.answers import SimulationAnswer
from marsupial_service.schemas.words import MissionPhase

MOVES: Mapping[StrEnum, frozenset[StrEnum]] = {
    MissionPhase.RUNNING: frozenset({MissionPhase.PAUSED, MissionPhase.CANCELLING, MissionPhase.ENDED}),
    MissionPhase.PAUSED: frozenset({MissionPhase.RUNNING, MissionPhase.CANCELLING, MissionPhase.ENDED}),
    MissionPhase.CANCELLING: frozenset({MissionPhase.ENDED}),
    MissionPhase.ENDED: frozenset(),
}
"""The states that may follow each state."""

STATE_AFTER: Mapping[Control, MissionPhase] = {
    Control.PAUSE: MissionPhase.PAUSED,
    Control.RESUME: MissionPhase.RUNNING,
    Control.CANCEL: MissionPhase.CANCELLING,
}
"""The state that each control leads to."""


@dataclass(frozen=True, slots=True, kw_only=True)
class MissionRecord(StoredEntry):
    """A mission as it is stored; it has a `status` if and only if it has ended.

    Parameters
    ----------
    n, t_ms
        Number and time of the last report.
    revision
        Of the plan that was made last.
    inputs, batches
        How much went in, and how many answers came out: an answer to the brief and then one to each input.
    events
        How many there are in those answers.
    frame
        That of the map after the last report; None: the one it was created with.
    term
        Counts the servers that have held it, see `marsupial_service.store.tables`.
    simulation
        How its robots are simulated; None: they are others'.
    """

    state: MissionPhase
    name: str
    strategy: str
    planner: str
    status: str | None
    reason: str
    n: int
    t_ms: int
    revision: int
    inputs: int
    batches: int
    events: int
    frame: MissionFrame | None
    term: int
    simulation: SimulationAnswer | None


@dataclass(frozen=True, slots=True, kw_only=True)
class MissionCounts:
    """Counts for operators: missions in the store by state, inputs that wait to be answered, open ones by owner."""

    states: Mapping[MissionPhase, int]
    backlog: int
    owners: Mapping[str, int]


@dataclass(frozen=True, slots=True, kw_only=True)
class MissionSettings(EntrySettings):
    """The limits that hold for missions, and who is asked and told.

    Parameters
    ----------
    may_go_on
        Whether an owner still may have missions.
    lag
        Receives how long each input has waited for its answer, in s.
    """

    may_go_on: Callable[[str], bool] = lambda owner: True
    lag: Callable[[float], None] = lambda seconds: None
