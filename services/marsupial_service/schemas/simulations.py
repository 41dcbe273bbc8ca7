"""Requests for simulated missions: the scenario or map, the team, the strategy."""

from typing import Annotated

from pydantic import RootModel

from marsupial.generators.builtin import DEFAULT_CARRIERS, DEFAULT_ROVERS
from marsupial_service.schemas.base import Name, OptionalField, RequestBody, by_key, variant, within
from marsupial_service.schemas.requests import BudgetBody

DEFAULT_STRATEGY, DEFAULT_PLANNER, DEFAULT_SEED = "temporal", "auto", 1


class UploadedMapBody(RequestBody):
    """A nav2 map: its name, the text of its yaml file, and its image (PNG or PGM) in base64.

    If `image_name` is given, it must be the file that the yaml file names; the suffix may differ.
    """

    name: Name = "map"
    yaml: str
    image_base64: str
    image_name: OptionalField[Name] = None


class _Simulation(RequestBody):
    carriers: Annotated[int, within("carriers")] = DEFAULT_CARRIERS
    rovers: Annotated[int, within("rovers_per_carrier")] = DEFAULT_ROVERS
    strategy: Name = DEFAULT_STRATEGY
    planner: Name = DEFAULT_PLANNER
    seed: Annotated[int, within("seed")] = DEFAULT_SEED
    budget: OptionalField[BudgetBody] = None
    speed: OptionalField[Annotated[float, within("simulation_speed")]] = None


class ScenarioSimulationBody(_Simulation):
    """A simulation of a built-in scenario (`/v1/scenarios` lists them); `rovers` is their number per carrier.

    `speed` is seconds of mission time per second; without it, the simulation runs as fast as planning allows.
    """

    scenario: Name


class MapSimulationBody(_Simulation):
    """A simulation on an uploaded map; the seed determines where the robots start."""

    map: UploadedMapBody


class SimulationBody(
    RootModel[
        Annotated[
            Annotated[ScenarioSimulationBody, variant("scenario")] | Annotated[MapSimulationBody, variant("map")],
            by_key("scenario", "map"),
        ]
    ]
):
    """A mission with simulated robots."""
