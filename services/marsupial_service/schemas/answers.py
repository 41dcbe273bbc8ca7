"""The bodies of answers. Moments are RFC 3339 in UTC, places on the map are metres of the map frame."""

from typing import Annotated, Any, Literal

from pydantic import Field, WithJsonSchema

from marsupial_service.schemas.base import Absent, Answer, one_word_of
from marsupial_service.schemas.words import JobOutcome, JobState, MissionPhase

StateWord = Annotated[str, one_word_of(JobState)]
OutcomeWord = Annotated[str, one_word_of(JobOutcome)]
Number = Annotated[int | float, WithJsonSchema({"type": "number"})]
"""A number as it is: whole numbers stay whole."""
Geometry = Literal["Point", "MultiPoint", "LineString", "MultiPolygon"]


class ProblemDetailAnswer(Answer):
    """One thing wrong: where (a JSON pointer into the body, or the name of a parameter) and what."""

    pointer: Absent[str] = None
    query: Absent[str] = None
    header: Absent[str] = None
    path: Absent[str] = None
    detail: str


class ProblemAnswer(Answer):
    """An error, as RFC 9457 describes it."""

    type: str
    title: str
    status: int
    detail: str
    instance: str
    errors: Absent[list[ProblemDetailAnswer]] = None


class ActionAnswer(Answer):
    """An action of a plan; times are ms from the moment of the situation."""

    name: Literal["move", "explore", "dock", "undock"]
    robot: str
    carrier: Absent[str] = None
    origin: Absent[str] = None
    place: str
    start_ms: int
    duration_ms: int


class PlanAnswer(Answer):
    """A revision of a job's plan; each is valid and better than the one before."""

    revision: int
    makespan_ms: int
    found_after_ms: int
    found_at: str
    actions: list[ActionAnswer]
    ipc: str


class PlansAnswer(Answer):
    """Every revision of a job's plan, the first one first."""

    plans: list[PlanAnswer]


class BudgetAnswer(Answer):
    """What the planner was given: seconds, or steps."""

    seconds: Absent[float] = None
    steps: Absent[int] = None


class JobLinksAnswer(Answer):
    """Where there is more about a job."""

    self: str
    plans: str
    events: str
    situation: str
    cancel: str


class JobSummaryAnswer(Answer):
    """A job without its plan."""

    id: str
    state: StateWord
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
    """Jobs, the newest first; `next` is where the older ones are."""

    jobs: list[JobSummaryAnswer]
    next: str | None


class JobSituationAnswer(Answer):
    """What the planner was asked; for a map state also the cell of every place per robot type, and its centre."""

    situation: dict[str, Any]
    places: dict[str, Any] | None


class ViolationAnswer(Answer):
    """The first thing wrong with a plan; `action` is null where the goal is not reached at the end."""

    kind: str
    time_ms: int
    action: ActionAnswer | None
    message: str


class VerdictAnswer(Answer):
    """Whether a plan is valid; `retimed` counts the actions whose times its text had rounded to hundredths."""

    valid: bool
    violation: ViolationAnswer | None
    makespan_ms: int
    actions: int
    retimed: int


class PlannerAnswer(Answer):
    """A planner: whether it can be used here, and what it can do."""

    name: str
    summary: str
    licence: str
    available: bool
    missing: str | None
    anytime: bool
    proves_optimality: bool
    deterministic_steps: bool


class PlannersAnswer(Answer):
    """Every planner."""

    planners: list[PlannerAnswer]


class GeometryAnswer(Answer):
    """A GeoJSON geometry in metres of the map frame, not in degrees."""

    type: Geometry
    coordinates: list[Any]


class FeatureAnswer(Answer):
    """A GeoJSON feature."""

    type: Literal["Feature"]
    id: str
    geometry: GeometryAnswer
    properties: dict[str, Any]


class AnalysisAnswer(Answer):
    """What was found on a map, as a GeoJSON feature collection with the situation a planner is asked."""

    type: Literal["FeatureCollection"]
    features: list[FeatureAnswer]
    situation: dict[str, Any]


class ScenarioAnswer(Answer):
    """A built-in scenario: its size in metres, and what it is."""

    name: str
    width_m: float
    height_m: float
    summary: str


class StrategyAnswer(Answer):
    """A strategy: whether it asks a planner, and whether it leads teams with rovers, and without."""

    name: str
    asks_planner: bool
    with_rovers: bool
    without_rovers: bool


class SimulationDefaultsAnswer(Answer):
    """What holds where a simulation says nothing: the team, who decides, and the budget of each planning."""

    carriers: int
    rovers: int
    strategy: str
    planner: str
    seed: int
    budget: BudgetAnswer


class ScenariosAnswer(Answer):
    """What may be simulated and how; `planners` are those that can be used here."""

    scenarios: list[ScenarioAnswer]
    strategies: list[StrategyAnswer]
    planners: list[str]
    defaults: SimulationDefaultsAnswer


class DemoItemAnswer(Answer):
    """A ready request for /v1/jobs."""

    name: str
    kind: Literal["situation", "map_state"]
    summary: str
    href: str


class DemoListAnswer(Answer):
    """What there is to try the service with."""

    demo_data: list[DemoItemAnswer]


class LimitAnswer(Answer):
    """A limit, and what it limits."""

    value: Number
    meaning: str


class LimitListAnswer(Answer):
    """Every limit of the service."""

    limits: dict[str, LimitAnswer]


class HealthAnswer(Answer):
    """That the service answers."""

    status: Literal["ok"] = "ok"
    version: str


class ReadyAnswer(Answer):
    """That the service can plan and store."""

    status: Literal["ready"] = "ready"
    planned_in_ms: float
    sqlite: str
    version: str


class DemoJobAnswer(Answer):
    """A request for /v1/jobs."""

    planner: str
    budget: dict[str, Any] = Field(default_factory=dict)
    situation: Absent[dict[str, Any]] = None
    map_state: Absent[dict[str, Any]] = None


class MissionLinksAnswer(Answer):
    """Where there is more about a mission."""

    self: str
    reports: str
    events: str
    log: str
    map: str
    pause: str
    resume: str
    cancel: str


class SimulationAnswer(Answer):
    """How the robots of a mission are simulated: `speed` seconds of mission time a second, or as fast as may be."""

    speed: Absent[float] = None
    seed: int
    carriers: int
    rovers: int
    warnings: Annotated[list[str], Field(description="What is odd about the map.")]


class MissionAnswer(Answer):
    """A mission: `status` and `reason` say how it ended, `n` and `t_ms` which report was the last."""

    id: str
    name: str
    state: Annotated[str, one_word_of(MissionPhase)]
    status: str | None
    reason: str
    strategy: str
    planner: str
    n: int
    t_ms: int
    revision: int
    created_at: str
    finished_at: str | None
    simulation: Absent[SimulationAnswer] = None
    links: MissionLinksAnswer


class MissionListAnswer(Answer):
    """Missions, the newest first; `next` is where the older ones are."""

    missions: list[MissionAnswer]
    next: str | None


class TakenAnswer(Answer):
    """A report has been stored: its number, its time, and the revision of the plan that was made last.

    `robot` is whose count `n` belongs to, if it is a robot's own.
    """

    n: int
    robot: Absent[str] = None
    t_ms: int
    revision: int


class AllTakenAnswer(Answer):
    """All reports of a request have been stored, or had been before."""

    reports: list[TakenAnswer]


class LastReportsAnswer(Answer):
    """The last report of the team (0: none yet), the latest time of all, the last of each robot by its own count."""

    n: int
    t_ms: int
    robots: dict[str, int]


class KnownMapAnswer(Answer):
    """What is known of the map: (start, length, terrain code) three by three."""

    width: int
    height: int
    resolution_m: float
    origin_m: list[float]
    runs: list[int]
