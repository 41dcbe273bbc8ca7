"""The data of streamed events: one line of JSON, whose type depends on `event`.

Times are integer milliseconds: for jobs since the time of the situation, for missions since the start on the client's
clock. Cells are column and row in the mission's frame, [0, 0] at its lower left corner; points are metres in the map
frame.
"""

from collections.abc import Mapping
from typing import Annotated, Any, Literal

from pydantic import BaseModel, Field

from marsupial.model.mission import Status
from marsupial_service.schemas.answers import ActionAnswer, JobStateWord, OutcomeWord
from marsupial_service.schemas.base import Answer, OmittedIfNone, enum_schema
from marsupial_service.schemas.enums import EventType, JobEventType

CellData = Annotated[list[int], Field(min_length=2, max_length=2, description="Column and row of a cell.")]
PointData = Annotated[list[float], Field(min_length=2, max_length=2, description="x and y in metres of the map frame.")]
TimeMs = Annotated[int, Field(ge=0, description="Milliseconds of mission time.")]
CommandId = Annotated[int, Field(ge=1, description="Id of the command; reports refer to it when it has ended.")]
RevisionNumber = Annotated[int, Field(ge=0, description="Revision of the plan; 0 before the first plan.")]
Timestamp = Annotated[str, Field(description="RFC 3339, UTC.", json_schema_extra={"format": "date-time"})]
RobotWord = Annotated[str, Field(description="Name of the robot.")]
PlaceWord = Annotated[str, Field(description="Name of a place in the plan: a target, meeting point or home.")]


class _Command(Answer):
    id: CommandId
    robot: RobotWord
    name: str
    revision: RevisionNumber


class DriveCommand(_Command):
    """Drive along a route that begins at the robot's cell."""

    name: Literal["drive"]
    place: PlaceWord
    route: list[CellData] = Field(description="Cells to pass, in order, in the mission's frame.")
    route_m: list[PointData] = Field(description="Centres of these cells.")


class StopCommand(_Command):
    """Stop at the next cell of the route. `id` is that of the drive, which then ends like any other drive."""

    name: Literal["stop"]


class DockCommand(_Command):
    """The rover boards the carrier next to it."""

    name: Literal["dock"]
    carrier: RobotWord
    place: PlaceWord


class UndockCommand(_Command):
    """The carrier sets the rover down at a cell."""

    name: Literal["undock"]
    carrier: RobotWord
    place: PlaceWord
    cell: CellData
    point_m: PointData


Command = Annotated[DriveCommand | StopCommand | DockCommand | UndockCommand, Field(discriminator="name")]


class CommandsData(Answer):
    """New commands for the robots, based on the reports so far."""

    batch: int = Field(ge=1, description="Number of this event among those of its type.")
    revision: RevisionNumber
    n: int = Field(ge=0, description="The last report of the team that was considered.")
    t_ms: TimeMs
    until_ms: int | None = Field(
        description="Mission time in ms by which the next report is due, even if nothing happens; null: no more "
        "reports. During a pause it is always in the future."
    )
    robots: OmittedIfNone[dict[str, int]] = Field(
        default=None, description="The last report of each robot that numbers its own."
    )
    commands: list[Command]


class LogData(BaseModel):
    """A line of the mission log (docs/mission-log.md): an event, its time and its fields."""

    event: Literal[
        "mission",
        "reveal",
        "change",
        "frame",
        "drive",
        "stand",
        "plan",
        "start",
        "end",
        "lost",
        "returned",
        "away",
        "contact",
        "speed",
        "zone",
        "ended",
    ] = Field(description="Type of the event.")
    t_ms: TimeMs
    robot: OmittedIfNone[str] = Field(default=None, description="The robot that sees, drives, stands or is lost.")
    cell: OmittedIfNone[CellData] = Field(default=None, description="The cell, in `drive`, `stand` and `start`.")
    steps: OmittedIfNone[str] = Field(default=None, description="In `drive`: one digit per step; 0 is +x, 2 is +y.")
    cells: OmittedIfNone[list[int]] = Field(
        default=None,
        description="In `reveal` and `change`: for each run the number of cells since the end of the run before, its "
        "length and its terrain code.",
    )
    revision: OmittedIfNone[RevisionNumber] = None
    reason: OmittedIfNone[str] = None


class DecisionData(Answer):
    """How a plan was found, and its actions; their times are in ms, relative to the decision."""

    planner: str
    outcome: str
    wall_s: float = Field(description="Wall-clock seconds of planning.")
    first_plan_s: float | None = Field(description="Seconds until the first plan; null if there is none.")
    refused: int = Field(ge=0, description="Number of invalid plans, which were discarded.")
    detail: str
    actions: list[ActionAnswer]
    reasons: OmittedIfNone[dict[str, Any]] = Field(
        default=None,
        description="Why it is this plan, for servers that go on with the mission; the log has it in `plan`.",
    )


class MissionStateData(Answer):
    """The state of the mission.

    `waiting`: the mission waits for a map on which all robots can stand; `reason` says which ones can't.
    `winding_down`: robots return as the goal says, and then the mission ends.
    """

    state: Literal["paused", "running", "waiting", "winding_down"]
    reason: OmittedIfNone[str] = None
    t_ms: TimeMs


class QuotaData(Answer):
    """Whether the mission waits because its key has used up its planning time."""

    state: Literal["waiting", "running"]
    reason: OmittedIfNone[str] = None
    room_at: OmittedIfNone[Timestamp] = Field(
        default=None, description="When it may continue, if no job of the key ends before."
    )
    t_ms: TimeMs


class FrameData(Answer):
    """The frame of the mission's map has grown; from now on all cells refer to this frame."""

    width: int = Field(ge=1, description="Number of columns.")
    height: int = Field(ge=1, description="Number of rows.")
    resolution_m: float = Field(gt=0, description="Size of a cell in metres.")
    origin_m: list[float] = Field(
        min_length=3, max_length=3, description="Pose of the lower left corner: x and y in metres, yaw in radians."
    )
    shift: CellData = Field(description="Offset to add to a cell of the old frame.")
    t_ms: TimeMs


class MissionEndData(Answer):
    """How the mission ended."""

    status: Annotated[str, enum_schema(Status)]
    reason: str
    t_ms: TimeMs


class JobStateData(Answer):
    """The new state of the job, and how often it was started."""

    state: JobStateWord
    attempts: int = Field(ge=0, description="How often it was started.")
    at: Timestamp


class JobPlanData(Answer):
    """A better plan was found."""

    revision: int = Field(ge=1, description="Number of the plan in its job.")
    makespan_ms: int = Field(ge=0, description="Duration of the plan.")
    found_after_ms: int = Field(ge=0, description="Wall-clock milliseconds since the job was started.")
    at: Timestamp
    actions: list[ActionAnswer] = Field(description="Times are in ms, relative to the time of the situation.")


class JobEndData(Answer):
    """The job has ended."""

    state: JobStateWord
    outcome: OutcomeWord
    detail: str
    plans: int = Field(ge=0, description="Number of plans found.")
    lower_bound_ms: int | None = Field(description="Lower bound on the makespan in ms; null if unknown.")
    at: Timestamp


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
