"""What a mission or a plan is made with where little is asked for: the budget, the planner.

It imports no compiled code, so that a wrong option is refused at once.
"""

from __future__ import annotations

from marsupial.model.planning import NO_PLANNER, Budget, Engine
from marsupial.model.strategy import Decider
from marsupial.strategies.clairvoyant import CLAIRVOYANT
from marsupial.strategies.registry import asks_planner

DEFAULT_PLANNER = "auto"

DEFAULT_BUDGET_S = 1.0
"""For each planning."""


def budget_of(seconds: float | None, steps: int | None, *, default_s: float = DEFAULT_BUDGET_S) -> Budget:
    """Return the budget for each planning; `default_s` seconds where neither is given.

    Raises
    ------
    UsageError
        If both are given, or one that is no number, or not positive and finite.
    """
    if seconds is None and steps is None:
        return Budget(seconds=default_s)
    return Budget(seconds=seconds, steps=steps)


def takes_budget(strategy: str) -> bool:
    """Say whether what the strategy does depends on the budget: it asks a planner, or is the clairvoyant."""
    return strategy == CLAIRVOYANT or asks_planner(strategy)


def planner_for(strategy: str | Decider, planner: str | Engine) -> str | Engine:
    """Return the planner that a strategy asks: `planner`, or `NO_PLANNER` if it asks none by that way.

    Raises
    ------
    EngineUnavailable
        If the strategy is of an installed package and can't be loaded.
    """
    return planner if isinstance(strategy, str) and asks_planner(strategy) else NO_PLANNER
