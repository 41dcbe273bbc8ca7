"""Defaults for missions and plans: the planner and its budget.

This module imports no compiled code, so that a wrong option is refused at once.
"""

from marsupial.model.planning import NO_PLANNER, Budget, Engine
from marsupial.model.strategy import Decider
from marsupial.strategies.clairvoyant import CLAIRVOYANT
from marsupial.strategies.registry import asks_planner

DEFAULT_PLANNER = "auto"

DEFAULT_BUDGET_S = 1.0  # seconds per planning call


def budget_of(seconds: float | None, steps: int | None, *, default_s: float = DEFAULT_BUDGET_S) -> Budget:
    """Return the budget of a planning call, `default_s` seconds if neither is given; raise a `UsageError` for both."""
    if seconds is None and steps is None:
        return Budget(seconds=default_s)
    return Budget(seconds=seconds, steps=steps)


def takes_budget(strategy: str) -> bool:
    """Return whether a strategy depends on the budget: it asks a planner, or is the clairvoyant."""
    return strategy == CLAIRVOYANT or asks_planner(strategy)


def planner_for(strategy: str | Decider, planner: str | Engine) -> str | Engine:
    """Return `planner`, or `NO_PLANNER` if the strategy is an object or asks no planner."""
    return planner if isinstance(strategy, str) and asks_planner(strategy) else NO_PLANNER
