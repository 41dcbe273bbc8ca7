"""Requests for simulated missions: the scenario or map, the team, the strategy."""

from typing import Annotated, Any, Literal

from pydantic import Field, RootModel

from marsupial.formats.scenario.faults import MOST_FAULTS
from marsupial.generators.builtin import DEFAULT_CARRIERS, DEFAULT_ROVERS
from marsupial.model.faults import FaultKind
from marsupial.model.scenario import MissionLimits
from marsupial_service.schemas.base import (
    Metres,
    Name,
    OptionalField,
    PointM,
    RequestBody,
    RobotName,
    at_most,
    by_key,
    described_by,
    enum_schema,
    variant,
    within,
)
from marsupial_service.schemas.mapstates import Base64, BatteryBody, Chargers, DockingSeconds, Share, YamlText
from marsupial_service.schemas.missions import DatedZones
from marsupial_service.schemas.requests import BudgetBody

MOST_COARSER = 4

DEFAULT_STRATEGY, DEFAULT_PLANNER, DEFAULT_SEED = "temporal", "auto", 1


class UploadedMapBody(RequestBody):
    """A nav2 map: its name, the text of its yaml file, and its image (PNG or PGM) in base64.

    If `image_name` is given, it must be the file that the yaml file names; the suffix may differ. With `coarser`,
    blocks of so many pixels a side become one cell: walls stay closed, and narrow gaps stay open where they can.
    """

    name: Name = "map"
    yaml: YamlText
    image_base64: Base64
    image_name: OptionalField[Name] = None
    coarser: Annotated[int, Field(ge=1, le=MOST_COARSER)] = 1


class FaultBody(RequestBody):
    """A fault, as in a scenario file."""

    fault: Annotated[FaultKind, enum_schema(FaultKind)]
    robot: OptionalField[RobotName] = None
    role: OptionalField[Literal["carrier", "rover"]] = None
    at_s: OptionalField[DockingSeconds] = None
    rate_per_h: OptionalField[Annotated[float, within("rate_per_h")]] = None
    seen_m: OptionalField[PointM] = None
    seed: OptionalField[Annotated[int, within("seed")]] = None
    speed_share: OptionalField[Annotated[float, within("speed_share")]] = None
    reported: OptionalField[bool] = None
    share: OptionalField[Share] = None
    for_s: OptionalField[DockingSeconds] = None
    area_m: OptionalField[Annotated[list[Metres], Field(min_length=4, max_length=4)]] = None
    terrain: OptionalField[RobotName] = None


class BatteriesBody(RequestBody):
    """The batteries of all carriers and of all rovers; without one, robots have no limit."""

    carrier: OptionalField[BatteryBody] = None
    rover: OptionalField[BatteryBody] = None


class _Simulation(RequestBody):
    carriers: Annotated[int, within("carriers")] = DEFAULT_CARRIERS
    rovers: Annotated[int, within("rovers_per_carrier")] = DEFAULT_ROVERS
    strategy: Name = DEFAULT_STRATEGY
    planner: Name = DEFAULT_PLANNER
    seed: Annotated[int, within("seed")] = DEFAULT_SEED
    budget: OptionalField[BudgetBody] = None
    speed: OptionalField[Annotated[float, within("simulation_speed")]] = None
    coverage: Annotated[float, within("coverage")] = MissionLimits().coverage
    starts_m: Annotated[list[PointM], at_most("robots", "points")] = Field(default=[])
    zones: DatedZones = Field(default=[])
    faults: Annotated[list[Any], described_by(Annotated[list[FaultBody], at_most(MOST_FAULTS, "faults")])] = Field(
        default=[]
    )
    batteries: OptionalField[BatteriesBody] = None
    chargers: Chargers = Field(default=[])
    radio_range_m: OptionalField[Annotated[float, within("radio_range_m")]] = None


class ScenarioSimulationBody(_Simulation):
    """A simulation of a built-in scenario (`/v1/scenarios` lists them); `rovers` is their number per carrier.

    `speed` is seconds of mission time per second; without it, the simulation runs as fast as planning allows.
    `starts_m` are where the first carriers start; the seed determines where the others do. `radio_range_m` is that of
    the rovers.
    """

    scenario: Name


class MapSimulationBody(_Simulation):
    """A simulation on an uploaded map; the seed determines where the robots start."""

    map: UploadedMapBody


class SimulationBody(RootModel[object]):
    """A mission with simulated robots."""

    root: Annotated[
        Annotated[ScenarioSimulationBody, variant("scenario")] | Annotated[MapSimulationBody, variant("map")],
        by_key("scenario", "map"),
    ]
