"""A ready situation, as `marsupial export` writes it (`marsupial.formats.situation`)."""

from typing import Annotated, Literal

from pydantic import ConfigDict, Field

from marsupial.model.robots import Role
from marsupial.model.situation import PlanningType, RobotState, SituationGoal, TargetInfo
from marsupial_service.schemas.base import Maybe, Milliseconds, Name, RequestBody, made_of, one_of, within


class PlanningTypeBody(RequestBody):
    """What planning knows of a robot type."""

    name: Name
    role: Annotated[Role, made_of(Literal["carrier", "rover"], Role)]
    capacity: Annotated[int, within("capacity")] = 0
    dock_ms: Milliseconds = 0
    undock_ms: Milliseconds = 0


class RobotStateBody(RequestBody):
    """Where a robot is free next: at a place, or aboard a carrier."""

    model_config = ConfigDict(json_schema_extra=one_of("place", "carrier"))

    name: Name
    type: Name
    place: Maybe[Name] = None
    carrier: Maybe[Name] = None
    free_at_ms: Milliseconds = 0
    home: Maybe[Name] = None


class TargetBody(RequestBody):
    """A target and the robot types that can explore it."""

    name: Name
    explorers: Annotated[frozenset[str], made_of(list[Name], frozenset)]
    reveal_m2: Annotated[float, within("reveal_m2")] = 0


class GoalBody(RequestBody):
    """What is asked besides exploring every target."""

    recover_rovers: bool = False
    return_home: bool = False


Goal = Annotated[SituationGoal, made_of(GoalBody, SituationGoal)]


class SituationBody(RequestBody):
    """Robots, places, travel times and goal at one moment."""

    format: Literal["marsupial situation"] = "marsupial situation"
    version: Annotated[int, Field(ge=1, le=1)] = 1
    types: list[Annotated[PlanningType, made_of(PlanningTypeBody, PlanningType)]]
    robots: list[Annotated[RobotState, made_of(RobotStateBody, RobotState)]]
    targets: list[Annotated[TargetInfo, made_of(TargetBody, TargetInfo)]]
    meetings: list[Name]
    homes: list[Name] = Field(default_factory=list)
    goal: Maybe[Goal] = None
    places: Maybe[list[Name]] = None
    travel_ms: dict[str, list[list[Milliseconds | None]]]
