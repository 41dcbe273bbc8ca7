"""The strategies, by the name the command line and comparisons use."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from marsupial.errors import UsageError
from marsupial.model.planning import Budget
from marsupial.model.strategy import Strategy
from marsupial.planning.engines import mission_engine
from marsupial.strategies.assignment import Assignment
from marsupial.strategies.heuristic import Heuristic
from marsupial.strategies.heuristic_plus import HeuristicPlus
from marsupial.strategies.temporal import Temporal

STRATEGIES: Mapping[str, Callable[[str, Budget], Strategy]] = {
    "temporal": lambda planner, budget: Temporal(mission_engine(planner, budget), budget),
    "heuristic": lambda planner, budget: Heuristic(),
    "heuristic-plus": lambda planner, budget: HeuristicPlus(),
    "greedy": lambda planner, budget: Assignment(),
}


def strategy(name: str, *, planner: str, budget: Budget) -> Strategy:
    """Return a fresh strategy; those that ask no planner ignore `planner` and `budget`.

    Raises
    ------
    UsageError
        If there is no strategy of that name.
    """
    if name not in STRATEGIES:
        raise UsageError(f"unknown strategy {name!r}; there are {', '.join(STRATEGIES)}")
    return STRATEGIES[name](planner, budget)
