"""The bodies of answers. Timestamps are RFC 3339 in UTC; positions are metres in the map frame."""

from typing import Annotated, Any, Literal

from pydantic import Field, WithJsonSchema

from marsupial.model.robots import Role
from marsupial.model.zones import ZoneKind
from marsupial_service.schemas.base import Answer, OmittedIfNone, enum_schema
from marsupial_service.schemas.enums import JobOutcome, JobState, MissionPhase

JobStateWord = Annotated[str, enum_schema(JobState)]
OutcomeWord = Annotated[str, enum_schema(JobOutcome)]
Number = Annotated[int | float, WithJsonSchema({"type": "number"})]
"""A number; integers stay integers."""
Geometry = Literal["Point", "MultiPoint", "LineString", "MultiPolygon"]


class ProblemDetailAnswer(Answer):
    """One error in a request: its detail, and its place (a JSON pointer into the body, or the name of a parameter)."""

    pointer: OmittedIfNone[str] = None
    query: OmittedIfNone[str] = None
    header: OmittedIfNone[str] = None
    path: OmittedIfNone[str] = None
    detail: str


class ProblemAnswer(Answer):
    """An error in the format of RFC 9457."""

    type: str
    title: str
    status: int
    detail: str
    instance: str
    errors: OmittedIfNone[list[ProblemDetailAnswer]] = None


class ActionAnswer(Answer):
    """An action of a plan; times are in ms, relative to the time of the situation."""

    name: Literal["move", "explore", "dock", "undock"]
    robot: str
    carrier: OmittedIfNone[str] = None
    origin: OmittedIfNone[str] = None
    place: str
    start_ms: int
    duration_ms: int


class PlanAnswer(Answer):
    """A revision of a job's plan; every revision is valid and better than the previous one."""

    revision: int
    makespan_ms: int
    found_after_ms: int
    found_at: str
    actions: list[ActionAnswer]
    ipc: str


class PlansAnswer(Answer):
    """All revisions of a job's plan, oldest first."""

    plans: list[PlanAnswer]


class BudgetAnswer(Answer):
    """The budget of the planner, in seconds or in steps."""

    seconds: OmittedIfNone[float] = None
    steps: OmittedIfNone[int] = None


class JobLinksAnswer(Answer):
    """Links to the resources of a job."""

    self: str
    plans: str
    events: str
    situation: str
    cancel: str


class JobSummaryAnswer(Answer):
    """A job without its plan."""

    id: str
    state: JobStateWord
    outcome: OutcomeWord | None
    detail: str
    planner: str
    budget: BudgetAnswer
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
    links: JobLinksAnswer


class JobAnswer(JobSummaryAnswer):
    """A job with its best plan so far."""

    best: PlanAnswer | None


class JobListAnswer(Answer):
    """Jobs, newest first; `next` is the link to the next page."""

    jobs: list[JobSummaryAnswer]
    next: str | None


class JobSituationAnswer(Answer):
    """The situation for the planner; for a map state also the cell and centre of every place, per robot type."""

    situation: dict[str, Any]
    places: dict[str, Any] | None


class ViolationAnswer(Answer):
    """The first violation of a plan; `action` is null if the plan ends without reaching the goal."""

    kind: str
    time_ms: int
    action: ActionAnswer | None
    message: str


class VerdictAnswer(Answer):
    """Whether a plan is valid; `retimed` is the number of actions whose times, rounded in its text, were corrected."""

    valid: bool
    violation: ViolationAnswer | None
    makespan_ms: int
    actions: int
    retimed: int


class PlannerAnswer(Answer):
    """A planner, its capabilities, and whether it is available on this server."""

    name: str
    summary: str
    licence: str
    available: bool
    missing: str | None
    anytime: bool
    proves_optimality: bool
    deterministic_steps: bool


class PlannersAnswer(Answer):
    """All planners."""

    planners: list[PlannerAnswer]


class GeometryAnswer(Answer):
    """A GeoJSON geometry; coordinates are metres in the map frame, not degrees."""

    type: Geometry
    coordinates: list[Any]


class FeatureAnswer(Answer):
    """A GeoJSON feature."""

    type: Literal["Feature"]
    id: str
    geometry: GeometryAnswer
    properties: dict[str, Any]


class AnalysisAnswer(Answer):
    """The analysis of a map: a GeoJSON feature collection, and the situation for the planner."""

    type: Literal["FeatureCollection"]
    features: list[FeatureAnswer]
    situation: dict[str, Any]
    warnings: Annotated[list[str], Field(description="Warnings about the map.")]


class DemoItemAnswer(Answer):
    """A ready-made request for /v1/jobs."""

    name: str
    kind: Literal["situation", "map_state"]
    summary: str
    href: str


class DemoListAnswer(Answer):
    """Ready-made requests to try the service with."""

    demo_data: list[DemoItemAnswer]


class LimitAnswer(Answer):
    """A limit and its meaning."""

    value: Number
    meaning: str


class LimitListAnswer(Answer):
    """All limits of the service."""

    limits: dict[str, LimitAnswer]


class HealthAnswer(Answer):
    """The service is running."""

    status: Literal["ok"] = "ok"
    version: str


class ReadyAnswer(Answer):
    """The service can plan and store jobs."""

    status: Literal["ready"] = "ready"
    planned_in_ms: float
    sqlite: str
    version: str


class DemoJobAnswer(Answer):
    """A request body for /v1/jobs."""

    planner: str
    budget: dict[str, Any] = Field(default_factory=dict)
    situation: OmittedIfNone[dict[str, Any]] = None
    map_state: OmittedIfNone[dict[str, Any]] = None


class MissionLinksAnswer(Answer):
    """Links to the resources of a mission."""

    self: str
    reports: str
    events: str
    log: str
    map: str
    pause: str
    resume: str
    cancel: str


class SimulationAnswer(Answer):
    """The simulation of a mission's robots.

    `speed` is seconds of mission time per second; without it, the simulation runs as fast as planning allows.
    """

    speed: OmittedIfNone[float] = None
    seed: int
    carriers: int
    rovers: int
    warnings: Annotated[list[str], Field(description="Warnings about the map.")]


class PreviewRobotAnswer(Answer):
    """A robot that is not aboard another at the start."""

    name: str
    role: Annotated[str, enum_schema(Role)]
    point_m: list[float]


class PreviewAnswer(Answer):
    """How the map of a simulation is understood, and where its robots would start.

    The picture may be coarser than the map. `runs` are triples of start, length and class: 0 obstacle, 1 ground for
    carriers, 2 for rovers only, 3 too narrow for all, 4 cut off from the rest, 5 free at the border. `errors` are what
    keeps the mission from being created.
    """

    width: int
    height: int
    resolution_m: float
    origin_m: list[float]
    runs: list[int]
    robots: list[PreviewRobotAnswer]
    warnings: list[str]
    errors: list[ProblemDetailAnswer]


class MissionAnswer(Answer):
    """A mission. `status` and `reason` say how it ended; `n` and `t_ms` are those of the last report.

    An open mission has a `reason` if no server can continue it at the moment: it can be cancelled.
    """

    id: str
    name: str
    state: Annotated[str, enum_schema(MissionPhase)]
    status: str | None
    reason: str
    strategy: str
    planner: str
    n: int
    t_ms: int
    revision: int
    created_at: str
    finished_at: str | None
    simulation: OmittedIfNone[SimulationAnswer] = None
    links: MissionLinksAnswer


class MissionListAnswer(Answer):
    """Missions, newest first; `next` is the link to the next page."""

    missions: list[MissionAnswer]
    next: str | None


class ReceiptAnswer(Answer):
    """A stored report: its number and time, and the revision of the latest plan.

    `robot` is given if that robot numbers its own reports.
    """

    n: int
    robot: OmittedIfNone[str] = None
    t_ms: int
    revision: int


class BatchReceiptAnswer(Answer):
    """All reports of a request are stored, now or by an earlier request."""

    reports: list[ReceiptAnswer]


class LastReportsAnswer(Answer):
    """The last report of the team (0: none), the latest time, and the last report of each robot that numbers them."""

    n: int
    t_ms: int
    robots: dict[str, int]


class ZoneAnswer(Answer):
    """A zone; `weight` is given for zones `priority`, times (seconds of mission time) if they limit it."""

    name: str
    kind: Annotated[str, enum_schema(ZoneKind)]
    polygon_m: list[list[float]]
    weight: OmittedIfNone[float] = None
    from_s: OmittedIfNone[float] = None
    until_s: OmittedIfNone[float] = None


class ZonesAnswer(Answer):
    """The zones of a mission that hold or will, in order."""

    zones: list[ZoneAnswer]


class KnownMapAnswer(Answer):
    """The known map; `runs` are triples of start, length and terrain code."""

    width: int
    height: int
    resolution_m: float
    origin_m: list[float]
    runs: list[int]
