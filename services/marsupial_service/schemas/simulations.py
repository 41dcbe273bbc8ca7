"""Missions in the simulator: which scenario or map, and how it is to be explored."""

from typing import Annotated

from pydantic import RootModel

from marsupial.generators.builtin import DEFAULT_CARRIERS, DEFAULT_ROVERS
from marsupial_service.schemas.base import Maybe, Name, RequestBody, by_key, variant, within
from marsupial_service.schemas.requests import BudgetBody

DEFAULT_STRATEGY, DEFAULT_PLANNER, DEFAULT_SEED = "temporal", "auto", 1


class UploadedMapBody(RequestBody):
    """A map of nav2: its name, the text of its yaml file, and its image, PNG or PGM, in base 64.

    Where `image_name`, the image's file, is told, it has to be the one that the yaml file names; its suffix may differ.
    """

    name: Name = "map"
    yaml: str
    image_base64: str
    image_name: Maybe[Name] = None


class _Simulation(RequestBody):
    carriers: Annotated[int, within("carriers")] = DEFAULT_CARRIERS
    rovers: Annotated[int, within("rovers_per_carrier")] = DEFAULT_ROVERS
    strategy: Name = DEFAULT_STRATEGY
    planner: Name = DEFAULT_PLANNER
    seed: Annotated[int, within("seed")] = DEFAULT_SEED
    budget: Maybe[BudgetBody] = None
    speed: Maybe[Annotated[float, within("simulation_speed")]] = None


class ScenarioSimulationBody(_Simulation):
    """A built-in scenario (`/v1/scenarios` lists them), explored by so many carriers and `rovers` for each.

    `speed` is mission time over time on the clock; without it everything goes as fast as planning allows.
    """

    scenario: Name


class MapSimulationBody(_Simulation):
    """The same on a map that is sent; where robots start is drawn by the seed."""

    map: UploadedMapBody


class SimulationBody(
    RootModel[
        Annotated[
            Annotated[ScenarioSimulationBody, variant("scenario")] | Annotated[MapSimulationBody, variant("map")],
            by_key("scenario", "map"),
        ]
    ]
):
    """A mission in the service's simulator."""
