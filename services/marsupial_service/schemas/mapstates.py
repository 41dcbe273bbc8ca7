"""A map state: the known map, the robots on it with their current actions, and the goal.

Fields have the names of scenario files; a position is a point in metres of the map frame, or a cell of the grid.
"""

from typing import Annotated, Literal, Self

from pydantic import ConfigDict, Field, StringConstraints, model_validator
from pydantic_core import PydanticCustomError

from marsupial.formats.mapfiles.nav2 import MAX_YAML_BYTES
from marsupial.model.bounds import BOUNDS, LONGEST_NAME
from marsupial.model.grid import UNKNOWN
from marsupial.model.mission import MapMeeting
from marsupial.model.robots import SQRT2
from marsupial.model.sizes import MOST_TYPES
from marsupial_service.schemas.base import (
    CellXY,
    Metres,
    OptionalField,
    PointM,
    Power,
    RequestBody,
    RobotName,
    SeatsByType,
    at_most,
    by_key,
    converted,
    described_by,
    one_of,
    variant,
    within,
)
from marsupial_service.schemas.situations import SituationGoalField

_TERRAINS = UNKNOWN  # the most terrains: codes are one byte, and one of them means unknown

Base64 = Annotated[
    str, StringConstraints(min_length=4, pattern=r"^[A-Za-z0-9+/]*={0,2}$"), at_most("body_bytes", "characters")
]
YamlText = Annotated[str, StringConstraints(min_length=1, max_length=MAX_YAML_BYTES)]
Resolution = Annotated[float, within("resolution_m")]
MapOrigin = Annotated[
    tuple[float, float, float], converted(Annotated[list[Metres], Field(min_length=3, max_length=3)], tuple)
]
Share = Annotated[float, within("share")]
Grey = Annotated[int, within("grey")]
Seconds = Annotated[float, within("remaining_s")]
Joules = Annotated[float, within("energy_j")]
TurnsJ = Annotated[list[Joules], Field(min_length=4, max_length=4)]
DockingSeconds = Annotated[float, within("dock_s")]


_Greys = Annotated[
    list[int],
    converted(
        Grey | Annotated[list[Grey], at_most(256, "greys")],
        lambda given: given if isinstance(given, list) else [given],
    ),
]


class MaskBody(RequestBody):
    """An image of the map's size that paints terrains onto it; `greys` has the grey values of each terrain."""

    image: Base64
    greys: Annotated[dict[str, _Greys], at_most(_TERRAINS, "terrains")]


class _MapFields(RequestBody):
    mask: OptionalField[MaskBody] = None


class RowsMapBody(_MapFields):
    """A map as rows of characters, top row first: ``#`` obstacle, ``.`` floor, ``~`` rough, ``?`` unknown."""

    rows: Annotated[
        list[Annotated[str, StringConstraints(min_length=1, max_length=int(BOUNDS["side"].most))]],
        Field(min_length=1, fail_fast=True),
        at_most("cells", "rows"),
    ]
    resolution_m: Resolution
    origin_m: OptionalField[MapOrigin] = None
    legend: OptionalField[
        Annotated[
            dict[str, Annotated[str, StringConstraints(max_length=LONGEST_NAME)]], at_most(_TERRAINS, "characters")
        ]
    ] = None


class ImageMapBody(_MapFields):
    """A map as a PNG or PGM image in base64, interpreted as nav2's map server does."""

    image: Base64
    resolution_m: Resolution
    origin_m: OptionalField[MapOrigin] = None
    negate: bool = False
    free_thresh: Share = 0.25
    occupied_thresh: Share = 0.65
    mode: Literal["trinary", "scale", "raw"] = "trinary"


class Nav2Body(RequestBody):
    """The two files of a nav2 map: the text of ``map.yaml`` (its image name is ignored), and the image in base64."""

    yaml: YamlText
    image: Base64


class Nav2MapBody(_MapFields):
    """A nav2 map."""

    nav2: Nav2Body


MapBody = Annotated[
    Annotated[RowsMapBody, variant("rows")]
    | Annotated[ImageMapBody, variant("image")]
    | Annotated[Nav2MapBody, variant("nav2")],
    by_key("rows", "image", "nav2"),
]


class TerrainBody(RequestBody):
    """A terrain class in addition to obstacle, floor and rough."""

    name: RobotName
    code: OptionalField[Annotated[int, within("terrain_code")]] = None
    blocks_sight: bool = False


class EnergyBody(RequestBody):
    """Idle power, additional power while driving, and energy per metre, stop, and turn of 45 to 180 degrees."""

    idle_w: Power = 0
    drive_w: Power = 0
    metre_j: Joules = 0.0
    stop_j: Joules = 0.0
    turn_j: TurnsJ = Field(default=[0.0, 0.0, 0.0, 0.0])


class BatteryBody(RequestBody):
    """The battery of a robot type, and the power with which it charges: at charging places, and rovers aboard."""

    capacity_j: Annotated[float, within("battery_j")]
    charge_w: Power = 0


class _RobotTypeFields(RequestBody):
    name: RobotName
    speed_mps: Annotated[float, within("speed_mps")]
    sensor_range_m: Annotated[float, within("sensor_range_m")]
    radius_m: Annotated[float, within("radius_m")]
    terrains: Annotated[list[RobotName], Field(min_length=1), at_most(_TERRAINS, "terrains")]
    energy: OptionalField[EnergyBody] = None
    diagonal: Annotated[float, within("diagonal")] = SQRT2
    routes: Literal["shortest", "energy"] = "shortest"
    battery: OptionalField[BatteryBody] = None
    sensor_angle_deg: OptionalField[Annotated[float, within("sensor_angle_deg")]] = None


class CarrierTypeBody(_RobotTypeFields):
    """A carrier type: how many rovers it carries in all, and of each type; where there are no `seats`, any types fit.

    Without `capacity` it carries as many as it has seats.
    """

    model_config = ConfigDict(json_schema_extra={"anyOf": [{"required": ["capacity"]}, {"required": ["seats"]}]})

    role: Literal["carrier"]
    capacity: OptionalField[Annotated[int, within("capacity")]] = None
    seats: OptionalField[Annotated[SeatsByType, at_most(MOST_TYPES, "robot types")]] = None


class RoverTypeBody(_RobotTypeFields):
    """A rover type."""

    role: Literal["rover"]
    dock_s: DockingSeconds
    undock_s: DockingSeconds
    radio_range_m: OptionalField[Annotated[float, within("radio_range_m")]] = None


RobotTypeBody = Annotated[CarrierTypeBody | RoverTypeBody, Field(discriminator="role")]

# `marsupial.formats.scenario` reads both: they are those of scenario files
Terrains = Annotated[object, described_by(Annotated[list[TerrainBody], at_most(_TERRAINS, "terrains")])]
RobotTypes = Annotated[
    object,
    described_by(Annotated[list[RobotTypeBody], Field(min_length=1), at_most(MOST_TYPES, "robot types")]),
]


class DockBody(RequestBody):
    """The rover is docking on its `carrier`; both are busy for `remaining_s`."""

    name: Literal["dock"]
    remaining_s: Seconds


class UndockBody(RequestBody):
    """A carrier is setting the rover down; both are busy for `remaining_s`."""

    name: Literal["undock"]
    carrier: RobotName
    remaining_s: Seconds


class DriveBody(RequestBody):
    """The robot is driving, and will be free at its pose after `remaining_s`."""

    name: Literal["drive"]
    remaining_s: Seconds


ActionInProgressBody = Annotated[DockBody | UndockBody | DriveBody, Field(discriminator="name")]


def _check_place(body: RequestBody, *keys: str) -> None:
    """Raise an error unless exactly one of these fields is given."""
    given = [key for key in keys if getattr(body, key) is not None]
    if len(given) != 1:
        raise PydanticCustomError("one_place", f"needs one of {', '.join(keys)}, got {' and '.join(given) or 'none'}")


class PlacedBody(RequestBody):
    """A robot and its place."""

    model_config = ConfigDict(json_schema_extra=one_of("pose_m", "cell", "carrier"))

    name: RobotName
    type: RobotName
    pose_m: OptionalField[PointM] = None
    cell: OptionalField[CellXY] = None
    carrier: OptionalField[RobotName] = None

    @model_validator(mode="after")
    def _has_one_place(self) -> Self:
        _check_place(self, "pose_m", "cell", "carrier")
        return self


class RobotBody(PlacedBody):
    """A robot and where it will be free: a point in metres, a cell, or the carrier it is aboard.

    `charge` is the share of its battery's capacity that it will have then, or has now if it is aboard; by default 1.
    """

    charge: OptionalField[Share] = None
    action: OptionalField[ActionInProgressBody] = None
    home_m: OptionalField[PointM] = None
    home_cell: OptionalField[CellXY] = None


class ChargerBody(RequestBody):
    """A charging place: a point in metres, or a cell. Batteries of robots that stand there charge."""

    model_config = ConfigDict(json_schema_extra=one_of("at_m", "cell"))

    at_m: OptionalField[PointM] = None
    cell: OptionalField[CellXY] = None

    @model_validator(mode="after")
    def _has_one_place(self) -> Self:
        _check_place(self, "at_m", "cell")
        return self


Chargers = Annotated[list[ChargerBody], at_most("places", "charging places")]


class MeetingBody(RequestBody):
    """A meeting point in use, which the analysis keeps: the cells and types of its carrier and rover."""

    name: RobotName
    carrier_cell: CellXY
    rover_cell: CellXY
    carrier_type: RobotName
    rover_type: RobotName


class MapStateBody(RequestBody):
    """The known map, and the robots on it."""

    map: MapBody
    terrains: Terrains = Field(default=[])
    robot_types: RobotTypes
    robots: Annotated[list[RobotBody], Field(min_length=1), at_most("robots", "robots")]
    meetings: Annotated[
        list[Annotated[MapMeeting, converted(MeetingBody, MapMeeting)]], at_most("places", "meeting points")
    ] = Field(default_factory=list)
    goal: OptionalField[SituationGoalField] = None
    chargers: Chargers = Field(default=[])
