"""Words in the store, in answers and in events: states of jobs and missions, and types of events."""

from enum import StrEnum


class JobState(StrEnum):
    """Where a job is; the last three are final, and each job reaches exactly one of them once."""

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
    INVALID_INPUT = "invalid_input"  # what only the analysis of a map state can find; the problems are in the detail
    CANCELLED = "cancelled"


class JobEventType(StrEnum):
    """What an event of a job tells."""

    STATE = "state"
    PLAN = "plan"
    END = "end"


class MissionPhase(StrEnum):
    """Where a mission is; the last one is final."""

    RUNNING = "running"
    PAUSED = "paused"
    CANCELLING = "cancelling"
    ENDED = "ended"


class EventType(StrEnum):
    """What an event tells: a line of the log, a decision, commands, the state, the end, a frame that has grown.

    All of it follows from the inputs, but for `QUOTA`: that the mission waits as its owner may not plan now.
    """

    LOG = "log"
    DECISION = "decision"
    COMMANDS = "commands"
    STATE = "state"
    END = "end"
    FRAME = "frame"
    QUOTA = "quota"
