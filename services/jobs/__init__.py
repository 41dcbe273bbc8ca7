"""Planning jobs that outlive the server: stored before they are acknowledged, run in processes that always end."""

from services.jobs.records import (
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
from services.jobs.service import Jobs

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
