"""The JSON of missions as typed dicts: briefs, reports, commands and the other events.

`MissionDocument` is what `Mission` stands for. Cells come in runs: start, length, terrain code, three by three.
"""
# Annotations are evaluated here, as in `marsupial_client.documents`.

from collections.abc import Sequence
from typing import Literal, NotRequired, TypedDict

from marsupial_client.documents import Action, Budget

MissionPhase = Literal["running", "paused", "cancelling", "ended"]


class Energy(TypedDict, total=False):
    """What a robot uses, in W and J; `turn_j` of turns by 45, 90, 135 and 180 degrees."""

    drive_w: float
    idle_w: float
    metre_j: float
    stop_j: float
    turn_j: Sequence[float]


class _RobotType(TypedDict):
    name: str
    speed_mps: float
    sensor_range_m: float
    radius_m: float
    terrains: Sequence[str]
    diagonal: NotRequired[float]
    energy: NotRequired[Energy]
    routes: NotRequired[Literal["shortest", "energy"]]


class CarrierType(_RobotType):
    """A type of carrier."""

    role: Literal["carrier"]
    capacity: int


class RoverType(_RobotType):
    """A type of rover."""

    role: Literal["rover"]
    dock_s: float
    undock_s: float


class Terrain(TypedDict):
    """A terrain class besides obstacle, floor and rough."""

    name: str
    code: NotRequired[int]
    blocks_sight: NotRequired[bool]


class Frame(TypedDict):
    """The frame of a mission's map, and what is known in it at first (runs: start, length, terrain code)."""

    width: int
    height: int
    resolution_m: float
    origin_m: NotRequired[Sequence[float]]
    known: NotRequired[Sequence[int]]


class Member(TypedDict):
    """A robot at the start: its pose in metres or its cell, or the carrier it is on; one of them."""

    name: str
    type: str
    pose_m: NotRequired[Sequence[float]]
    cell: NotRequired[Sequence[int]]
    carrier: NotRequired[str]


class Goal(TypedDict, total=False):
    """What is asked besides exploring."""

    recover_rovers: bool
    return_home: bool


class Brief(TypedDict):
    """A mission to be begun."""

    name: NotRequired[str]
    frame: Frame
    terrains: NotRequired[Sequence[Terrain]]
    robot_types: Sequence[CarrierType | RoverType]
    team: Sequence[Member]
    goal: NotRequired[Goal]
    strategy: NotRequired[str]
    planner: NotRequired[str]
    budget: NotRequired[Budget]
    planning_time: NotRequired[Literal["instant", "charged"]]
    time_limit_ms: NotRequired[int]
    area: NotRequired[Sequence[int]]
    seed: NotRequired[int]


class MissionLinks(TypedDict):
    """Where there is more about a mission."""

    self: str
    reports: str
    events: str
    log: str
    map: str
    pause: str
    resume: str
    cancel: str


class SimulationDocument(TypedDict):
    """How the robots of a mission are simulated: `speed` seconds of mission time a second, or as fast as may be."""

    speed: NotRequired[float]
    seed: int
    carriers: int
    rovers: int
    warnings: list[str]


class MissionDocument(TypedDict):
    """A mission: `status` and `reason` say how it ended, `n` and `t_ms` which report was the last.

    It has a `simulation` where the service simulates its robots.
    """

    id: str
    name: str
    state: MissionPhase
    status: str | None
    reason: str
    strategy: str
    planner: str
    n: int
    t_ms: int
    revision: int
    created_at: str
    finished_at: str | None
    simulation: NotRequired[SimulationDocument]
    links: MissionLinks


class Revealed(TypedDict):
    """Cells that a robot has seen, in runs: start, length, terrain code."""

    robot: str
    runs: Sequence[int]


class MapRuns(TypedDict):
    """All known cells of a map, in runs."""

    runs: Sequence[int]


class RobotNote(TypedDict):
    """Where a robot is; of one that drives, where and when it would stop if told to."""

    name: str
    pose_m: NotRequired[Sequence[float]]
    cell: NotRequired[Sequence[int]]
    free_at_ms: NotRequired[int]
    distance_m: NotRequired[float]
    driving_ms: NotRequired[int]


class Failed(TypedDict):
    """A command that could not be carried out."""

    id: int
    reason: NotRequired[str]


class Lost(TypedDict):
    """A robot that has failed for good."""

    robot: str
    reason: NotRequired[str]


class ReportFrame(TypedDict):
    """The frame that the cells of a report are of; the mission's grows to hold it."""

    width: int
    height: int
    resolution_m: NotRequired[float]
    origin_m: NotRequired[Sequence[float]]


class News(TypedDict):
    """What has happened up to a moment of mission time (ms): a report before it is numbered.

    With `robot` it is that robot's own, and numbered by its own count.
    """

    t_ms: int
    robot: NotRequired[str]
    frame: NotRequired[ReportFrame]
    revealed: NotRequired[Sequence[Revealed]]
    map: NotRequired[MapRuns]
    robots: NotRequired[Sequence[RobotNote]]
    finished: NotRequired[Sequence[int]]
    failed: NotRequired[Sequence[Failed]]
    lost: NotRequired[Sequence[Lost]]


class Report(News):
    """A report; `n` counts those of a mission from 1, or those of a `robot` that reports for itself."""

    n: int


class Batch(TypedDict):
    """Reports in their order: all are taken, or none."""

    reports: Sequence[Report]


class LastReports(TypedDict):
    """Number of the last report of the team, the latest time of all, and the numbers of robots by their own counts."""

    n: int
    t_ms: int
    robots: dict[str, int]


class Taken(TypedDict):
    """A report has been stored: its number, its time, and the revision of the plan that was made last."""

    n: int
    t_ms: int
    revision: int
    robot: NotRequired[str]


class KnownMap(TypedDict):
    """What is known of the map, in runs."""

    width: int
    height: int
    resolution_m: float
    origin_m: list[float]
    runs: list[int]


class Command(TypedDict):
    """What a robot is to do.

    A `drive` has a route; `dock` and `undock` name the carrier, and `undock` the cell where the rover is put.
    """

    id: int
    robot: str
    name: Literal["drive", "stop", "dock", "undock"]
    revision: int
    carrier: NotRequired[str]
    place: NotRequired[str | None]
    route: NotRequired[list[list[int]]]
    route_m: NotRequired[list[list[float]]]
    cell: NotRequired[list[int]]
    point_m: NotRequired[list[float]]


class Commands(TypedDict):
    """The event `commands`: what robots are to do after report `n`; the next report is due by `until_ms`, if any is.

    `robots` has the last report of each robot that reports for itself.
    """

    batch: int
    revision: int
    n: int
    t_ms: int
    until_ms: int | None
    robots: NotRequired[dict[str, int]]
    commands: list[Command]


class Decision(TypedDict):
    """The event `decision`: how a plan was found, and its actions."""

    planner: str
    outcome: str
    wall_s: float
    first_plan_s: float | None
    refused: int
    detail: str
    actions: list[Action]


class MissionMoved(TypedDict):
    """The event `state` of a mission: one that waits says why (`reason`)."""

    state: Literal["paused", "running", "waiting"]
    t_ms: int
    reason: NotRequired[str]


class QuotaTold(TypedDict):
    """The event `quota`: the planning time of the key is used up, so the mission waits; or it goes on."""

    state: Literal["waiting", "running"]
    t_ms: int
    reason: NotRequired[str]
    room_at: NotRequired[str]


class FrameGrown(TypedDict):
    """The event `frame`: what was cell [x, y] of the map is cell [x, y] plus `shift` from now on."""

    width: int
    height: int
    resolution_m: float
    origin_m: list[float]
    shift: list[int]
    t_ms: int


class MissionEnded(TypedDict):
    """The event `end` of a mission."""

    status: str
    reason: str
    t_ms: int
