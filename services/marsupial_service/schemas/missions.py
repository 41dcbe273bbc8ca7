"""Missions: briefs and reports."""

from typing import Annotated, Literal

from pydantic import Field, RootModel, StringConstraints

from marsupial.model.scenario import Goal, MissionLimits
from marsupial.model.zones import MOST_CORNERS, MOST_ZONES, ZoneKind
from marsupial_service.schemas.base import (
    CellXY,
    Milliseconds,
    Name,
    OptionalField,
    PointM,
    RequestBody,
    RobotName,
    at_most,
    by_key,
    converted,
    converted_list,
    enum_schema,
    variant,
    within,
)
from marsupial_service.schemas.mapstates import (
    Chargers,
    MapOrigin,
    PlacedBody,
    Resolution,
    RobotTypes,
    Share,
    Terrains,
)
from marsupial_service.schemas.requests import BudgetBody
from marsupial_service.schemas.situations import GoalBody

RunsBody = Annotated[
    tuple[int, ...],
    converted_list(
        Annotated[
            list[Annotated[int, within("cell")]], Field(fail_fast=True, strict=False), at_most("runs", "numbers")
        ],
        tuple,
    ),
]
"""Triples of start, length and terrain code, in ascending order; cells are numbered row by row from the lowest row."""

Side = Annotated[int, within("side")]
Reason = Annotated[str, StringConstraints(max_length=1000)]
Identity = Annotated[int, within("command")]
Distance = Annotated[float, within("distance_m")]


class FrameBody(RequestBody):
    """The frame of the map, and its initially known cells."""

    width: Side
    height: Side
    resolution_m: Resolution
    origin_m: OptionalField[MapOrigin] = None
    known: RunsBody = ()


class MemberBody(PlacedBody):
    """A robot and where it starts: a point in metres, a cell, or the carrier it is aboard."""


class ZoneBody(RequestBody):
    """A polygon where robots must not go, where targets are worth more, or that alone is explored.

    `weight`, by which targets are worth more, belongs to zones `priority`.
    """

    kind: Annotated[str, enum_schema(ZoneKind)]
    polygon_m: Annotated[list[PointM], Field(min_length=3), at_most(MOST_CORNERS, "corners")]
    weight: OptionalField[Annotated[float, within("zone_weight")]] = None


class DatedZoneBody(ZoneBody):
    """A zone, by default for the whole mission; times are seconds of mission time."""

    name: RobotName
    from_s: Annotated[float, within("dock_s")] = 0.0
    until_s: OptionalField[Annotated[float, within("dock_s")]] = None


DatedZones = Annotated[list[DatedZoneBody], at_most(MOST_ZONES, "zones")]


class MissionGoalBody(GoalBody):
    """The goal of a mission: `least_ground` is the new ground behind a frontier, in footprints of a robot; 0: any."""

    least_ground: Annotated[float, within("least_ground")] = Goal().least_ground


class MissionBody(RequestBody):
    """A mission: the map frame, the team, the goal, the strategy and the planner."""

    name: Name = "mission"
    frame: FrameBody
    terrains: Terrains = Field(default=[])
    robot_types: RobotTypes
    team: Annotated[list[MemberBody], Field(min_length=1), at_most("robots", "robots")]
    goal: OptionalField[Annotated[Goal, converted(MissionGoalBody, Goal)]] = None
    strategy: Name = "temporal"
    planner: Name = "auto"
    budget: OptionalField[BudgetBody] = None
    planning_time: Literal["instant", "charged"] = "instant"
    time_limit_ms: Annotated[int, within("time_limit_ms")] = MissionLimits().time_ms
    area: OptionalField[RunsBody] = None
    coverage: Annotated[float, within("coverage")] = MissionLimits().coverage
    zones: DatedZones = Field(default=[])
    chargers: Chargers = Field(default=[])
    map_may_grow: bool = True
    seed: Annotated[int, within("seed")] = 0


class RevealedBody(RequestBody):
    """New or changed cells that a robot has seen; code 255 is for cells that are no longer known."""

    robot: RobotName
    runs: RunsBody


class MapRunsBody(RequestBody):
    """All known cells of a map; all other cells become unknown."""

    runs: RunsBody


class ReportFrameBody(RequestBody):
    """The frame of the cells in a report. The mission's frame grows to contain it, and never shrinks.

    `origin_m` is the pose of the lower left corner, with the yaw of the mission's frame. `resolution_m`, if given, is
    that of the mission.
    """

    width: Side
    height: Side
    origin_m: OptionalField[MapOrigin] = None
    resolution_m: OptionalField[Resolution] = None


class RobotNoteBody(RequestBody):
    """The position of a robot; for a driving robot, where and when it would stop if commanded now.

    `charge` is the share of its battery's capacity that it has now. Without it, the mission estimates the charge.
    """

    name: RobotName
    pose_m: OptionalField[PointM] = None
    cell: OptionalField[CellXY] = None
    free_at_ms: OptionalField[Milliseconds] = None
    distance_m: OptionalField[Distance] = None
    driving_ms: OptionalField[Milliseconds] = None
    speed_share: OptionalField[Annotated[float, within("speed_share")]] = None
    charge: OptionalField[Share] = None


class FailedBody(RequestBody):
    """A command that failed, or that its robot declined."""

    id: Identity
    reason: Reason = ""


class LostBody(RequestBody):
    """A robot that has failed, until it is reported as returned.

    With `returns`, that is expected: a mission that can't be complete without the robot waits for it.
    """

    robot: RobotName
    reason: Reason = ""
    returns: bool = False


class PartedBody(RequestBody):
    """A rover that can be told nothing until it is in contact again.

    If it `returns`, it drives back to where it was set down, by itself, once it has ended its last command.
    """

    robot: RobotName
    returns: bool = False


_PER_ROBOT, _PER_COMMAND = at_most("robots", "robots"), at_most("actions", "commands")


class ReportFields(RequestBody):
    """What a report says, as it is sent (`ReportBody`) and as it is stored and applied (`MissionReport`)."""

    n: Annotated[int, within("report")]
    robot: OptionalField[RobotName] = None
    t_ms: Milliseconds
    revealed: Annotated[list[RevealedBody], _PER_ROBOT] = Field(default=[])
    map: OptionalField[MapRunsBody] = None
    robots: Annotated[list[RobotNoteBody], _PER_ROBOT] = Field(default=[])
    finished: Annotated[list[Identity], _PER_COMMAND] = Field(default=[])
    failed: Annotated[list[FailedBody], _PER_COMMAND] = Field(default=[])
    declined: Annotated[list[FailedBody], _PER_COMMAND] = Field(default=[])
    lost: Annotated[list[LostBody], _PER_ROBOT] = Field(default=[])
    returned: Annotated[list[RobotName], _PER_ROBOT] = Field(default=[])
    out_of_contact: Annotated[list[PartedBody], _PER_ROBOT] = Field(default=[])
    in_contact: Annotated[list[RobotName], _PER_ROBOT] = Field(default=[])

    def ended(self) -> list[tuple[str, int]]:
        """Return the commands that have ended, each with its path in the report."""
        ended = [(f"finished[{i}]", number) for i, number in enumerate(self.finished)]
        ended += [(f"failed[{i}].id", failed.id) for i, failed in enumerate(self.failed)]
        return ended + [(f"declined[{i}].id", declined.id) for i, declined in enumerate(self.declined)]


class ReportBody(ReportFields):
    """What has happened up to a mission time.

    `n` numbers the reports of the mission from 1; with `robot`, those of that robot. Cells refer to `frame`; without
    it, to the mission's frame when the report arrives. Rovers `out_of_contact` get no command until they are
    `in_contact` again.
    """

    frame: OptionalField[ReportFrameBody] = None


# most reports of one request: more than a large team has at once
MOST_REPORTS = 1000


class BatchBody(RequestBody):
    """Several reports, in order: all are accepted, or none. Repeated reports change nothing."""

    reports: Annotated[list[ReportBody], Field(min_length=1), at_most(MOST_REPORTS, "reports")]


class ReportsBody(RootModel[object]):
    """A report, or a batch of reports."""

    root: Annotated[
        Annotated[ReportBody, variant("n")] | Annotated[BatchBody, variant("reports")], by_key("n", "reports")
    ]
