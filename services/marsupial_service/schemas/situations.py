"""A ready situation, as `marsupial export` writes it: its shape for the OpenAPI document.

`marsupial.formats.situation` reads and checks it; these models validate nothing.
"""

from typing import Annotated, Literal

from pydantic import ConfigDict, Field

from marsupial.model.situation import SituationGoal
from marsupial_service.schemas.base import (
    Milliseconds,
    Name,
    OptionalField,
    Power,
    RequestBody,
    SeatsByType,
    at_most,
    converted,
    one_of,
    within,
)

_TYPES, _PLACES = at_most("robots", "robot types"), at_most("places", "places")
_PlaceNames = Annotated[list[Name], _PLACES]


class PlanningBatteryBody(RequestBody):
    """The battery of a robot type, and the power that it uses standing and driving, and with which it charges."""

    capacity_j: Annotated[float, within("battery_j")]
    stand_w: Power = 0
    drive_w: Power = 0
    charge_w: Power = 0


class PlanningTypeBody(RequestBody):
    """The properties of a robot type that matter for planning."""

    name: Name
    role: Literal["carrier", "rover"]
    capacity: Annotated[int, within("capacity")] = 0
    dock_ms: Milliseconds = 0
    undock_ms: Milliseconds = 0
    battery: OptionalField[PlanningBatteryBody] = None
    seats: OptionalField[Annotated[SeatsByType, _TYPES]] = None
    seats_as: OptionalField[Name] = None


class RobotStateBody(RequestBody):
    """Where a robot will be free: at a place, or aboard a carrier."""

    model_config = ConfigDict(json_schema_extra=one_of("place", "carrier"))

    name: Name
    type: Name
    place: OptionalField[Name] = None
    carrier: OptionalField[Name] = None
    free_at_ms: Milliseconds = 0
    home: OptionalField[Name] = None
    charge_j: OptionalField[Annotated[float, within("charge_j")]] = None


class TargetBody(RequestBody):
    """A target, and the robot types that can explore it."""

    name: Name
    explorers: Annotated[list[Name], _TYPES]
    reveal_m2: Annotated[float, within("reveal_m2")] = 0
    priority: Annotated[float, within("zone_weight")] = 1


class GoalBody(RequestBody):
    """The goal besides exploring all targets."""

    recover_rovers: bool = False
    return_home: bool = False


SituationGoalField = Annotated[SituationGoal, converted(GoalBody, SituationGoal)]


class SituationBody(RequestBody):
    """Robots, places, travel times and the goal at one time."""

    format: Literal["marsupial situation"] = "marsupial situation"
    version: Annotated[int, Field(ge=1, le=1)] = 1
    types: Annotated[list[PlanningTypeBody], _TYPES]
    robots: Annotated[list[RobotStateBody], at_most("robots", "robots")]
    targets: Annotated[list[TargetBody], at_most("targets", "targets")]
    meetings: _PlaceNames
    homes: _PlaceNames = Field(default_factory=list)
    chargers: _PlaceNames = Field(default_factory=list)
    goal: OptionalField[GoalBody] = None
    places: OptionalField[_PlaceNames] = None
    travel_ms: Annotated[
        dict[str, Annotated[list[Annotated[list[Milliseconds | None], _PLACES]], _PLACES]],
        _TYPES,
    ]
