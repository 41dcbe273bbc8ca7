"""The values that missions exchange with their callers: states, records, settings."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from enum import StrEnum

from marsupial.model.missionframe import MissionFrame
from marsupial_service.entries.records import EntrySettings, StoredEntry
from marsupial_service.missions.codeversion import code_version
from marsupial_service.missions.values import Control
from marsupial_service.schemas.answers import SimulationAnswer
from marsupial_service.schemas.enums import MissionPhase

_OPEN = frozenset(MissionPhase)

# the states that may follow each state
TRANSITIONS: Mapping[StrEnum, frozenset[StrEnum]] = {
    MissionPhase.RUNNING: _OPEN - {MissionPhase.RUNNING},
    MissionPhase.PAUSED: _OPEN - {MissionPhase.PAUSED},
    MissionPhase.WINDING_DOWN: frozenset({MissionPhase.PAUSED, MissionPhase.CANCELLING, MissionPhase.ENDED}),
    MissionPhase.CANCELLING: frozenset({MissionPhase.ENDED}),
    MissionPhase.ENDED: frozenset(),
}
STATE_AFTER: Mapping[Control, MissionPhase] = {
    Control.PAUSE: MissionPhase.PAUSED,
    Control.RESUME: MissionPhase.RUNNING,
    Control.WIND_DOWN: MissionPhase.WINDING_DOWN,
    Control.CANCEL: MissionPhase.CANCELLING,
}


@dataclass(frozen=True, slots=True, kw_only=True)
class MissionRecord(StoredEntry):
    """A stored mission; it has a `status` if and only if it has ended.

    An open mission has a `reason` if a server could not continue it, and no other has done so since.
    """

    state: MissionPhase
    name: str
    strategy: str
    planner: str
    status: str | None
    reason: str
    n: int  # number of the last report; `t_ms` is its time
    t_ms: int
    revision: int  # of the latest plan
    inputs: int
    batches: int  # stored answers: one to the brief, then one to each input
    events: int  # in those answers
    frame: MissionFrame | None  # of the map after the last report; None: the one it was created with
    version: str  # of the code that runs it; empty if that is unknown
    term: int  # counts the takeovers by servers, see `marsupial_service.store.tables`
    simulation: SimulationAnswer | None  # of its robots; None: the robots are the client's


@dataclass(frozen=True, slots=True, kw_only=True)
class MissionSettings(EntrySettings):
    """The limits of missions, and callbacks: may an owner still have missions; how long an input waited.

    `resumed` is called when a mission gets another process: this server restarts it, or has taken over the mission.
    `commands` map the names of external planners to their engine names (``cmd:...``), `version` is that of this code.
    """

    has_valid_key: Callable[[str], bool] = lambda owner: True
    lag: Callable[[float], None] = lambda seconds: None
    resumed: Callable[[str], None] = lambda why: None
    commands: Mapping[str, str] = field(default_factory=dict)
    version: str = field(default_factory=code_version)
