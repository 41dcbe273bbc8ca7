"""What simulations may be made of: scenarios, strategies, planners, defaults and room."""

from marsupial_service.schemas.answers import BudgetAnswer
from marsupial_service.schemas.base import Answer


class ScenarioAnswer(Answer):
    """A built-in scenario: its size in metres, and a summary."""

    name: str
    width_m: float
    height_m: float
    summary: str


class StrategyAnswer(Answer):
    """A strategy: its idea, whether it uses a planner, and whether it supports teams with rovers and teams without."""

    name: str
    summary: str
    asks_planner: bool
    with_rovers: bool
    without_rovers: bool


class SimulationDefaultsAnswer(Answer):
    """The default values of a request for a simulation."""

    carriers: int
    rovers: int
    strategy: str
    planner: str
    seed: int
    budget: BudgetAnswer


class SimulationRoomAnswer(Answer):
    """How many simulated missions may be open, and how many more you may start now."""

    limit: int
    free: int


class ScenariosAnswer(Answer):
    """The options for simulations; `planners` are those available on this server."""

    scenarios: list[ScenarioAnswer]
    strategies: list[StrategyAnswer]
    planners: list[str]
    defaults: SimulationDefaultsAnswer
    simulations: SimulationRoomAnswer
