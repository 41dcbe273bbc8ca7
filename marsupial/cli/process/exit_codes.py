"""All exit codes, as literal tables for errors, missions and planning runs.

Missions and planning runs are keyed by the values of `marsupial.model.mission.Status` and
`marsupial.model.planning.Outcome`, so that this module imports nothing heavy.
"""

from __future__ import annotations

from collections.abc import Mapping

from marsupial.errors import (
    EngineUnavailable,
    InputError,
    InternalError,
    InvalidPlanError,
    LogError,
    MapError,
    MarsupialError,
    PlanTextError,
    ScenarioError,
    SituationError,
    UsageError,
)

DONE = 0
USAGE = 2
INVALID_INPUT = 3
UNSOLVABLE = 4
LIMIT = 5
INVALID_PLAN = 6
INTERNAL = 70
INTERRUPTED = 130

READER_LEFT = 141
"""The reader of stdout or stderr has gone (`| head`): the code that shells give commands ended by SIGPIPE."""

ERROR_CODES: Mapping[type[MarsupialError], int] = {
    InputError: INVALID_INPUT,
    MapError: INVALID_INPUT,
    ScenarioError: INVALID_INPUT,
    SituationError: INVALID_INPUT,
    PlanTextError: INVALID_INPUT,
    LogError: INVALID_INPUT,
    UsageError: USAGE,
    EngineUnavailable: USAGE,
    InvalidPlanError: INVALID_PLAN,
    InternalError: INTERNAL,
}

MISSION_CODES: Mapping[str, int] = {
    "complete": DONE,
    "stalled": LIMIT,
    "time_limit": LIMIT,
    "failed": LIMIT,
    "cancelled": INTERRUPTED,
}
"""An incomplete mission is never 0; `run --json` has its `status`."""

PLANNING_CODES: Mapping[str, int] = {
    "optimal": DONE,
    "satisficing": DONE,
    "unsolvable": UNSOLVABLE,
    "no_plan": LIMIT,
    "timeout": LIMIT,
    "memory": LIMIT,
    "crashed": LIMIT,
    "killed": LIMIT,
    "unsupported": LIMIT,
}
"""Codes for runs without a plan; a run with a plan that the checker accepts is 0, however the engine ended."""
