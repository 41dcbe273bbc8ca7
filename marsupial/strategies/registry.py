"""The strategies, by the name the command line and comparisons use."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from marsupial.errors import UsageError
from marsupial.model.planning import Budget
from marsupial.model.strategy import Strategy
from marsupial.planning.engines import mission_engine
from marsupial.strategies.heuristic import Heuristic
from marsupial.strategies.heuristic_plus import HeuristicPlus
from marsupial.strategies.one_step import OneStep
from marsupial.strategies.temporal import Temporal

STRATEGIES: Mapping[str, Callable[[str, Budget], Strategy]] = {
    "temporal": lambda planner, budget: Temporal(mission_engine(planner, budget), budget),
    "heuristic": lambda planner, budget: Heuristic(),
    "heuristic-plus": lambda planner, budget: HeuristicPlus(),
    "assignment": lambda planner, budget: OneStep(),
}

FORMER_NAMES: Mapping[str, str] = {"greedy": "assignment"}
"""What strategies were called once, and what they are called now; `greedy` is a planner."""


def strategy(name: str, *, planner: str, budget: Budget) -> Strategy:
    """Return a fresh strategy, by its name or former name; those that ask no planner ignore `planner` and `budget`.

    Raises
    ------
    UsageError
        If there is no strategy of that name.
    """
    name = FORMER_NAMES.get(name, name)
    if name not in STRATEGIES:
        raise UsageError(f"unknown strategy {name!r}; there are {', '.join(STRATEGIES)}")
    return STRATEGIES[name](planner, budget)
