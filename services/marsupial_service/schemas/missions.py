"""Missions: the brief, and what is reported."""

from typing import Annotated, Literal

from pydantic import Field, RootModel, StringConstraints

from marsupial.model.scenario import Goal, MissionLimits
from marsupial_service.schemas.base import (
    CellXY,
    Maybe,
    Milliseconds,
    Name,
    PointM,
    RequestBody,
    RobotName,
    by_key,
    made_of,
    made_of_list,
    variant,
    within,
)
from marsupial_service.schemas.mapstates import Origin, PlacedBody, Resolution, RobotTypes, Terrains
from marsupial_service.schemas.requests import BudgetBody
from marsupial_service.schemas.situations import GoalBody

RunsBody = Annotated[
    tuple[int, ...], made_of_list(Annotated[list[Annotated[int, within("cell")]], Field(fail_fast=True)], tuple)
]
"""(start, length, terrain code) three by three, cells numbered row by row from the lowest row, in ascending order."""

Side = Annotated[int, within("side")]
Reason = Annotated[str, StringConstraints(max_length=1000)]
Identity = Annotated[int, within("command")]
Distance = Annotated[float, within("distance_m")]


class FrameBody(RequestBody):
    """The frame of the map, and what is known in it at first."""

    width: Side
    height: Side
    resolution_m: Resolution
    origin_m: Maybe[Origin] = None
    known: RunsBody = ()


class MemberBody(PlacedBody):
    """A robot at the start: its pose in metres or its cell, or the carrier it is on."""


class MissionBody(RequestBody):
    """A mission: the map frame, the team, what is asked, and who decides how."""

    name: Name = "mission"
    frame: FrameBody
    terrains: Terrains = Field(default=[])
    robot_types: RobotTypes
    team: Annotated[list[MemberBody], Field(min_length=1)]
    goal: Maybe[Annotated[Goal, made_of(GoalBody, Goal)]] = None
    strategy: Name = "temporal"
    planner: Name = "auto"
    budget: Maybe[BudgetBody] = None
    planning_time: Literal["instant", "charged"] = "instant"
    time_limit_ms: Annotated[int, within("time_limit_ms")] = MissionLimits().time_ms
    area: Maybe[RunsBody] = None
    seed: Annotated[int, within("seed")] = 0


class RevealedBody(RequestBody):
    """Cells that a robot has seen, new or changed; code 255 for those that are not known any more."""

    robot: RobotName
    runs: RunsBody


class MapRunsBody(RequestBody):
    """All known cells of a map; the others are unknown, also those that were known."""

    runs: RunsBody


class ReportFrameBody(RequestBody):
    """The frame that the cells of a report are of. The mission's frame grows to hold it; it never shrinks.

    `origin_m` is the pose of the lower left corner: any, but not turned against the mission's frame. `resolution_m` is
    the mission's, given or not.
    """

    width: Side
    height: Side
    origin_m: Maybe[Origin] = None
    resolution_m: Maybe[Resolution] = None


class RobotNoteBody(RequestBody):
    """Where a robot is; for a driving robot, where and when it would stop if told to."""

    name: RobotName
    pose_m: Maybe[PointM] = None
    cell: Maybe[CellXY] = None
    free_at_ms: Maybe[Milliseconds] = None
    distance_m: Maybe[Distance] = None
    driving_ms: Maybe[Milliseconds] = None


class FailedBody(RequestBody):
    """A command that could not be carried out."""

    id: Identity
    reason: Reason = ""


class LostBody(RequestBody):
    """A robot that has failed for good."""

    robot: RobotName
    reason: Reason = ""


class ReportBody(RequestBody):
    """What happened up to a moment of mission time.

    `n` counts a mission's reports from 1 or, where `robot` is given, that robot's own. Cells are of `frame`, or else of
    the mission's frame as it is when the report comes.
    """

    n: Annotated[int, within("report")]
    robot: Maybe[RobotName] = None
    t_ms: Milliseconds
    frame: Maybe[ReportFrameBody] = None
    revealed: list[RevealedBody] = Field(default=[])
    map: Maybe[MapRunsBody] = None
    robots: list[RobotNoteBody] = Field(default=[])
    finished: list[Identity] = Field(default=[])
    failed: list[FailedBody] = Field(default=[])
    lost: list[LostBody] = Field(default=[])


# most reports of one request: more than a large team has at once
MOST_REPORTS = 1000


class BatchBody(RequestBody):
    """Reports in their order: all are taken, or none. Those that were taken before change nothing."""

    reports: Annotated[list[ReportBody], Field(min_length=1, max_length=MOST_REPORTS)]


class ReportsBody(
    RootModel[
        Annotated[
            Annotated[ReportBody, variant("n")] | Annotated[BatchBody, variant("reports")], by_key("n", "reports")
        ]
    ]
):
    """A report, or several of them."""
