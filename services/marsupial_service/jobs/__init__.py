"""Planning jobs that outlive the server: stored before they are acknowledged, run in processes that always end."""

from marsupial_service.jobs.records import (
    FINAL,
    STATE_OF,
    AnalysisRecord,
    EventRecord,
    EventType,
    JobOutcome,
    JobRecord,
    JobRequest,
    JobSettings,
    JobState,
    MapTask,
    Metrics,
    PlanRecord,
    QueueFull,
    Submitted,
    UnknownJob,
)
from marsupial_service.jobs.service import Jobs

__all__ = [
    "FINAL",
    "STATE_OF",
    "AnalysisRecord",
    "EventRecord",
    "EventType",
    "JobOutcome",
    "JobRecord",
    "JobRequest",
    "JobSettings",
    "JobState",
    "Jobs",
    "MapTask",
    "Metrics",
    "PlanRecord",
    "QueueFull",
    "Submitted",
    "UnknownJob",
]
