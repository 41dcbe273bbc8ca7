"""The bodies of answers. Moments are RFC 3339 in UTC, places on the map are metres of the map frame."""

from __future__ import annotations

from typing import Any, Literal

from pydantic import Field

from marsupial_service.schemas.base import Answer, Maybe

StateWord = Literal["queued", "running", "succeeded", "failed", "cancelled"]
OutcomeWord = Literal[
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


class ProblemDetail(Answer):
    """One thing wrong: where (a JSON pointer into the body, or the name of a parameter) and what."""

    pointer: Maybe[str] = None
    query: Maybe[str] = None
    header: Maybe[str] = None
    path: Maybe[str] = None
    detail: str


class Problem(Answer):
    """An error, as RFC 9457 describes it."""

    type: str
    title: str
    status: int
    detail: str
    instance: str
    errors: Maybe[list[ProblemDetail]] = None


class Action(Answer):
    """An action of a plan; times in ms from the moment that was sent."""

    name: Literal["move", "explore", "dock", "undock"]
    robot: str
    carrier: Maybe[str] = None
    origin: Maybe[str] = None
    place: str
    start_ms: int
    duration_ms: int


class Plan(Answer):
    """A revision of a job's plan; each is valid and better than the one before."""

    revision: int
    makespan_ms: int
    found_after_ms: int
    found_at: str
    actions: list[Action]
    ipc: str


class Plans(Answer):
    """Every revision of a job's plan, the first one first."""

    plans: list[Plan]


class Budget(Answer):
    """What the planner was given: seconds, or steps."""

    seconds: Maybe[float] = None
    steps: Maybe[int] = None


class JobLinks(Answer):
    """Where there is more about a job."""

    self: str
    plans: str
    events: str
    situation: str
    cancel: str


class JobSummary(Answer):
    """A job without its plan."""

    id: str
    state: StateWord
    outcome: OutcomeWord | None
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


class Job(JobSummary):
    """A job with its best plan so far."""

    best: Plan | None


class JobList(Answer):
    """Jobs, the newest first; `next` is where the older ones are."""

    jobs: list[JobSummary]
    next: str | None


class JobSituation(Answer):
    """What the planner was asked; for a map state also the cell of every place per robot type, and its centre."""

    situation: dict[str, Any]
    places: dict[str, Any] | None


class Violation(Answer):
    """The first thing wrong with a plan; `action` is null where the goal is not reached at the end."""

    kind: str
    time_ms: int
    action: Action | None
    message: str


class Verdict(Answer):
    """Whether a plan is valid."""

    valid: bool
    violation: Violation | None
    makespan_ms: int
    actions: int


class Planner(Answer):
    """A planner: whether it can be used here, and what it can do."""

    name: str
    summary: str
    licence: str
    available: bool
    missing: str | None
    anytime: bool
    proves_optimality: bool
    deterministic_steps: bool


class Planners(Answer):
    """Every planner."""

    planners: list[Planner]


class Geometry(Answer):
    """A GeoJSON geometry in metres of the map frame, not in degrees."""

    type: Literal["Point", "MultiPoint", "LineString", "MultiPolygon"]
    coordinates: list[Any]


class Feature(Answer):
    """A GeoJSON feature."""

    type: Literal["Feature"]
    id: str
    geometry: Geometry
    properties: dict[str, Any]


class Analysis(Answer):
    """What was found on a map, as a GeoJSON feature collection with the situation a planner is asked."""

    type: Literal["FeatureCollection"]
    features: list[Feature]
    situation: dict[str, Any]


class DemoItem(Answer):
    """A ready request for /v1/jobs."""

    name: str
    kind: Literal["situation", "map_state"]
    summary: str
    href: str


class DemoList(Answer):
    """What there is to try the service with."""

    demo_data: list[DemoItem]


class Limit(Answer):
    """A limit, and what it limits."""

    value: float
    meaning: str


class LimitList(Answer):
    """Every limit of the service."""

    limits: dict[str, Limit]


class Health(Answer):
    """That the service answers."""

    status: Literal["ok"] = "ok"
    version: str


class Ready(Answer):
    """That the service can plan and store."""

    status: Literal["ready"] = "ready"
    planned_in_ms: float
    sqlite: str
    version: str


class DemoJob(Answer):
    """A request for /v1/jobs."""

    planner: str
    budget: dict[str, Any] = Field(default_factory=dict)
    situation: Maybe[dict[str, Any]] = None
    map_state: Maybe[dict[str, Any]] = None
