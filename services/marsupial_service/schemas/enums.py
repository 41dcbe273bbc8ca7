"""Enumerations in the store, in answers and in events: states of jobs and missions, types of events."""

from enum import StrEnum


class JobState(StrEnum):
    """The state of a job; the last three are final, and each job reaches exactly one of them."""

    QUEUED = "queued"
    RUNNING = "running"
    SUCCEEDED = "succeeded"
    FAILED = "failed"
    CANCELLED = "cancelled"


class JobOutcome(StrEnum):
    """How a job ended."""

    OPTIMAL = "optimal"
    SATISFICING = "satisficing"
    UNSOLVABLE = "unsolvable"
    NO_PLAN = "no_plan"
    TIMEOUT = "timeout"
    OUT_OF_MEMORY = "out_of_memory"
    UNSUPPORTED = "unsupported"
    ENGINE_FAILED = "engine_failed"
    INVALID_INPUT = "invalid_input"  # found only by the analysis of a map state; the detail has the problems
    CANCELLED = "cancelled"


class JobEventType(StrEnum):
    """The type of a job's event."""

    STATE = "state"
    PLAN = "plan"
    END = "end"


class MissionPhase(StrEnum):
    """The state of a mission; the last one is final."""

    RUNNING = "running"
    PAUSED = "paused"
    WINDING_DOWN = "winding_down"
    CANCELLING = "cancelling"
    ENDED = "ended"


class EventType(StrEnum):
    """The type of a mission's event.

    The inputs determine all events but `QUOTA`: the mission waits until its owner may plan again, or continues.
    """

    LOG = "log"
    DECISION = "decision"
    COMMANDS = "commands"
    STATE = "state"
    END = "end"
    FRAME = "frame"
    QUOTA = "quota"
