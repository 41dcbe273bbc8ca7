"""Planning jobs that outlive the server: stored before they are acknowledged, run in processes that always end."""

from marsupial_service.jobs.records import (
    FINAL,
    STATE_OF,
    AnalysisRecord,
    JobEventType,
    JobOutcome,
    JobRecord,
    JobRequest,
    JobSettings,
    JobState,
    MapTask,
    Metrics,
    PlanRecord,
)
from marsupial_service.jobs.service import Jobs

__all__ = [
    "FINAL",
    "STATE_OF",
    "AnalysisRecord",
    "JobEventType",
    "JobOutcome",
    "JobRecord",
    "JobRequest",
    "JobSettings",
    "JobState",
    "Jobs",
    "MapTask",
    "Metrics",
    "PlanRecord",
]
