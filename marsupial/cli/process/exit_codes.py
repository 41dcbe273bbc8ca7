"""All exit codes, as literal tables for errors, missions and planning runs.

Missions and planning runs are keyed by the values of `marsupial.model.mission.Status` and
`marsupial.model.planning.Outcome`, so that this module imports nothing heavy.
"""

from collections.abc import Mapping

from marsupial import errors

DONE = 0
USAGE = 2
INVALID_INPUT = 3
UNSOLVABLE = 4
LIMIT = 5
INVALID_PLAN = 6
INTERNAL = 70
INTERRUPTED = 130

# The reader of stdout or stderr has gone (`| head`): the code that shells give commands ended by SIGPIPE.
READER_LEFT = 141

_OF_FILES = (errors.MapError, errors.ScenarioError, errors.SituationError, errors.PlanTextError, errors.LogError)

ERROR_CODES: Mapping[type[errors.MarsupialError], int] = {
    **dict.fromkeys((errors.InputError, *_OF_FILES), INVALID_INPUT),
    **dict.fromkeys((errors.UsageError, errors.EngineUnavailable), USAGE),
    errors.InvalidPlanError: INVALID_PLAN,
    errors.InternalError: INTERNAL,
}

MISSION_CODES: Mapping[str, int] = {
    "complete": DONE,
    **dict.fromkeys(("stalled", "time_limit", "failed"), LIMIT),
    "cancelled": INTERRUPTED,
}
"""An incomplete mission is never 0; `run --json` has its `status`."""

PLANNING_CODES: Mapping[str, int] = {
    **dict.fromkeys(("optimal", "satisficing"), DONE),
    "unsolvable": UNSOLVABLE,
    **dict.fromkeys(("no_plan", "timeout", "memory", "crashed", "killed", "unsupported"), LIMIT),
}
"""Codes for runs without a plan; a run with a plan that the checker accepts is 0, however the engine ended."""
