"""What the events of streams hold: `data` of each is one line of JSON, of the type that its `event` names.

Times are whole milliseconds of the client's clock: of a job since its situation, of a mission since its start. Cells
are columns and rows of the mission's frame from its lower left corner, [0, 0]; points are metres of the map frame.
"""

from collections.abc import Mapping
from typing import Annotated, Literal

from pydantic import BaseModel, Field

from marsupial.model.mission import Status
from marsupial_service.schemas.answers import ActionAnswer, OutcomeWord, StateWord
from marsupial_service.schemas.base import Absent, Answer, one_word_of
from marsupial_service.schemas.words import EventType, JobEventType

CellData = Annotated[list[int], Field(min_length=2, max_length=2, description="Column and row of a cell.")]
PointData = Annotated[list[float], Field(min_length=2, max_length=2, description="x and y in metres of the map frame.")]
TimeMs = Annotated[int, Field(ge=0, description="Milliseconds of mission time.")]
CommandId = Annotated[int, Field(ge=1, description="Of the command; reports name it when it has ended.")]
RevisionNumber = Annotated[int, Field(ge=0, description="Of the plan that it belongs to; 0 before the first.")]
Moment = Annotated[str, Field(description="RFC 3339, UTC.", json_schema_extra={"format": "date-time"})]
RobotWord = Annotated[str, Field(description="Name of the robot.")]
PlaceWord = Annotated[str, Field(description="Name of a place of the plan: target, meeting point or home.")]


class _Command(Answer):
    id: CommandId
    robot: RobotWord
    name: str
    revision: RevisionNumber


class DriveCommand(_Command):
    """The robot drives along a route that begins at the cell where it is."""

    name: Literal["drive"]
    place: PlaceWord
    route: list[CellData] = Field(description="The cells to pass, in their order, in the mission's frame.")
    route_m: list[PointData] = Field(description="Their centres.")


class StopCommand(_Command):
    """The robot stops at the next cell of its route. `id` is that of its drive, which then ends as any other."""

    name: Literal["stop"]


class DockCommand(_Command):
    """The rover gets aboard a carrier, which stands beside it."""

    name: Literal["dock"]
    carrier: RobotWord
    place: PlaceWord


class UndockCommand(_Command):
    """The carrier sets the rover down."""

    name: Literal["undock"]
    carrier: RobotWord
    place: PlaceWord
    cell: CellData
    point_m: PointData


Command = Annotated[DriveCommand | StopCommand | DockCommand | UndockCommand, Field(discriminator="name")]


class CommandsData(Answer):
    """What robots are to do after the reports so far."""

    batch: int = Field(ge=1, description="Counts the events of this type.")
    revision: RevisionNumber
    n: int = Field(ge=0, description="The last report of the team that is taken into account.")
    t_ms: TimeMs
    until_ms: int | None = Field(
        description="Mission time in ms by which to report even if nothing has happened; null: no more reports. "
        "During a pause it lies ahead."
    )
    robots: Absent[dict[str, int]] = Field(
        default=None, description="Where robots report by their own counts: the last report of each."
    )
    commands: list[Command]


class LogData(BaseModel):
    """A line of the mission log (docs/mission-log.md): which event, when, and its fields."""

    event: Literal[
        "mission", "reveal", "drive", "stand", "plan", "start", "end", "lost", "ended", "change", "frame"
    ] = Field(description="What happened.")
    t_ms: TimeMs
    robot: Absent[str] = Field(default=None, description="Whom it happened to; of `drive`, `stand` and `lost`.")
    cell: Absent[CellData] = Field(default=None, description="Where; of `drive`, `stand` and `start`.")
    steps: Absent[str] = Field(default=None, description="Of `drive`: a digit for each step, 0 is +x, 2 is +y.")
    looks: Absent[list[tuple[str, int, str]]] = Field(
        default=None, description="Of `reveal` and `change`: robot, ms after `t_ms`, and the cells as a text."
    )
    revision: Absent[RevisionNumber] = None
    reason: Absent[str] = None


class DecisionData(Answer):
    """How a plan was found, and its actions; their times are ms from the moment of the decision."""

    planner: str
    outcome: str
    wall_s: float = Field(description="Seconds that planning took by the clock on the wall.")
    first_plan_s: float | None = Field(description="Seconds to the first plan, or null.")
    refused: int = Field(ge=0, description="Invalid plans of the planner, which were not followed.")
    detail: str
    actions: list[ActionAnswer]


class MissionStateData(Answer):
    """Whether the mission goes on.

    `waiting`: for a map on which its robots can stand where they are; `reason` says which can't.
    """

    state: Literal["paused", "running", "waiting"]
    reason: Absent[str] = None
    t_ms: TimeMs


class QuotaData(Answer):
    """Whether the mission waits because the planning time of its key is used up."""

    state: Literal["waiting", "running"]
    reason: Absent[str] = None
    room_at: Absent[Moment] = Field(default=None, description="When it may go on, if no job of the key ends before.")
    t_ms: TimeMs


class FrameData(Answer):
    """The frame of the mission's map has grown: all cells are of this one from now on."""

    width: int = Field(ge=1, description="Columns of cells.")
    height: int = Field(ge=1, description="Rows of cells.")
    resolution_m: float = Field(gt=0, description="Edge of a cell in metres.")
    origin_m: list[float] = Field(
        min_length=3, max_length=3, description="Pose of the lower left corner: x and y in metres, yaw in radians."
    )
    shift: CellData = Field(description="What was cell [x, y] is cell [x, y] plus this.")
    t_ms: TimeMs


class MissionEndData(Answer):
    """How the mission ended."""

    status: Annotated[str, one_word_of(Status)]
    reason: str
    t_ms: TimeMs


class JobStateData(Answer):
    """The job has begun or goes on waiting: its state, and how often it was begun."""

    state: StateWord
    attempts: int = Field(ge=0, description="How often a worker has begun it.")
    at: Moment


class JobPlanData(Answer):
    """A better plan was found."""

    revision: int = Field(ge=1, description="Counts the plans of a job.")
    makespan_ms: int = Field(ge=0, description="How long the plan takes.")
    found_after_ms: int = Field(ge=0, description="Milliseconds by the clock on the wall since the job was begun.")
    at: Moment
    actions: list[ActionAnswer] = Field(description="Times are ms from the moment of the situation.")


class JobEndData(Answer):
    """The job is over."""

    state: StateWord
    outcome: OutcomeWord
    detail: str
    plans: int = Field(ge=0, description="How many were found.")
    lower_bound_ms: int | None = Field(description="No plan is shorter, in ms; null where nothing is known.")
    at: Moment


JOB_EVENTS: Mapping[JobEventType, type[BaseModel]] = {
    JobEventType.STATE: JobStateData,
    JobEventType.PLAN: JobPlanData,
    JobEventType.END: JobEndData,
}

MISSION_EVENTS: Mapping[EventType, type[BaseModel]] = {
    EventType.LOG: LogData,
    EventType.DECISION: DecisionData,
    EventType.COMMANDS: CommandsData,
    EventType.STATE: MissionStateData,
    EventType.END: MissionEndData,
    EventType.FRAME: FrameData,
    EventType.QUOTA: QuotaData,
}
