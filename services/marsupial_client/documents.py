"""The JSON of jobs and errors as typed dicts: what is sent, what is answered, what events hold.

The fields are those of the service's OpenAPI document, which a test holds them against; docs/service.md says what they
mean. `JobDocument` is what `Job` stands for. Map states and situations have formats of their own and are plain dicts
here. Those of missions are in `marsupial_client.mission_documents`.
"""
# Annotations are evaluated here: written as texts, they would hide from tools at run time which fields are required.

from collections.abc import Mapping, Sequence
from typing import Any, Literal, NotRequired, TypedDict

JobState = Literal["queued", "running", "succeeded", "failed", "cancelled"]
JobOutcome = Literal[
    "optimal",
    "satisficing",
    "unsolvable",
    "no_plan",
    "timeout",
    "out_of_memory",
    "unsupported",
    "engine_failed",
    "invalid_input",
    "cancelled",
]


class ProblemDetail(TypedDict):
    """One thing wrong: where (a JSON pointer into the body, or the name of a parameter) and what."""

    pointer: NotRequired[str]
    query: NotRequired[str]
    header: NotRequired[str]
    path: NotRequired[str]
    detail: str


class Problem(TypedDict):
    """An error, as RFC 9457 describes it."""

    type: str
    title: str
    status: int
    detail: str
    instance: str
    errors: NotRequired[list[ProblemDetail]]


class Budget(TypedDict, total=False):
    """What a planner may use: seconds, or steps; one of them."""

    seconds: float
    steps: int


class JobRequest(TypedDict):
    """A job to be done: for a situation or for a map state, one of them."""

    planner: NotRequired[str]
    budget: NotRequired[Budget]
    situation: NotRequired[Mapping[str, Any]]
    map_state: NotRequired[Mapping[str, Any]]


class Action(TypedDict):
    """An action of a plan; times are ms from the moment of the situation, or of the decision."""

    name: Literal["move", "explore", "dock", "undock"]
    robot: str
    carrier: NotRequired[str]
    origin: NotRequired[str]
    place: str
    start_ms: int
    duration_ms: int


class Plan(TypedDict):
    """A revision of a job's plan, as the job has it."""

    revision: int
    makespan_ms: int
    found_after_ms: int
    found_at: str
    actions: list[Action]
    ipc: str


class PlanFound(TypedDict):
    """The event `plan` of a job: a revision of its plan."""

    revision: int
    makespan_ms: int
    found_after_ms: int
    at: str
    actions: list[Action]


class JobMoved(TypedDict):
    """The event `state` of a job."""

    state: JobState
    attempts: int
    at: str


class JobEnded(TypedDict):
    """The event `end` of a job."""

    state: JobState
    outcome: JobOutcome
    detail: str
    plans: int
    lower_bound_ms: int | None
    at: str


class JobLinks(TypedDict):
    """Where there is more about a job."""

    self: str
    plans: str
    events: str
    situation: str
    cancel: str


class JobDocument(TypedDict):
    """A job with its best plan so far; `outcome` is null until it is over."""

    id: str
    state: JobState
    outcome: JobOutcome | None
    detail: str
    planner: str
    budget: Budget
    attempts: int
    created_at: str
    queued_at: str
    started_at: str | None
    first_plan_at: str | None
    finished_at: str | None
    plans: int
    makespan_ms: int | None
    lower_bound_ms: int | None
    gap: float | None
    links: JobLinks
    best: Plan | None


class Geometry(TypedDict):
    """A GeoJSON geometry in metres of the map frame, not in degrees."""

    type: Literal["Point", "MultiPoint", "LineString", "MultiPolygon"]
    coordinates: list[Any]


class Feature(TypedDict):
    """A GeoJSON feature."""

    type: Literal["Feature"]
    id: str
    geometry: Geometry
    properties: dict[str, Any]


class Analysis(TypedDict):
    """What was found on a map, and the situation a planner is asked."""

    type: Literal["FeatureCollection"]
    features: list[Feature]
    situation: dict[str, Any]


class Violation(TypedDict):
    """The first thing wrong with a plan; `action` is null where the goal is not reached at the end."""

    kind: str
    time_ms: int
    action: Action | None
    message: str


class Verdict(TypedDict):
    """Whether a plan is valid."""

    valid: bool
    violation: Violation | None
    makespan_ms: int
    actions: int
    retimed: int


class ActionsPlan(TypedDict):
    """A plan to be checked."""

    actions: Sequence[Action]


class TextPlan(TypedDict):
    """A plan to be checked, in the format of the planning competitions."""

    ipc: str


class Ready(TypedDict):
    """That the service can plan and store."""

    status: NotRequired[Literal["ready"]]
    planned_in_ms: float
    sqlite: str
    version: str
