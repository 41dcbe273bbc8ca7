"""Defaults for missions and plans: the planner and its budget.

This module imports no compiled code, so that a wrong option is refused at once.
"""

from marsupial.model.planning import NO_PLANNER, Budget, Engine
from marsupial.model.strategy import Decider
from marsupial.strategies.clairvoyant import CLAIRVOYANT
from marsupial.strategies.files import StrategyFile
from marsupial.strategies.registry import asks_planner
from marsupial.strategies.registry import strategy as made

AnyStrategy = str | StrategyFile | Decider
"""A name or a class in a file, of which each mission gets a new object, or an object."""

DEFAULT_PLANNER = "auto"

DEFAULT_BUDGET_S = 1.0  # seconds per planning call


def budget_of(seconds: float | None, steps: int | None, *, default_s: float = DEFAULT_BUDGET_S) -> Budget:
    """Return the budget of a planning call, `default_s` seconds if neither is given; raise a `UsageError` for both."""
    if seconds is None and steps is None:
        return Budget(seconds=default_s)
    return Budget(seconds=seconds, steps=steps)


def decider_of(strategy: AnyStrategy, planner: str | Engine, budget: Budget) -> Decider:
    """Return a new strategy of a name or file, or the object itself; see `registry.strategy`."""
    if isinstance(strategy, str | StrategyFile):
        return made(strategy, planner=planner, budget=budget)
    return strategy


def takes_budget(strategy: AnyStrategy) -> bool:
    """Return whether a strategy depends on the budget: it asks a planner, or is the clairvoyant."""
    return strategy == CLAIRVOYANT or planner_for(strategy, DEFAULT_PLANNER) != NO_PLANNER


def planner_for(strategy: AnyStrategy, planner: str | Engine) -> str | Engine:
    """Return `planner`, or `NO_PLANNER` if the strategy is an object or asks no planner."""
    return planner if isinstance(strategy, str | StrategyFile) and asks_planner(strategy) else NO_PLANNER
