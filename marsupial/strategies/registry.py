"""The strategies, by the name the command line and comparisons use."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from functools import partial

from marsupial import extensions
from marsupial.errors import EngineUnavailable, UsageError
from marsupial.extensions import Extension
from marsupial.model.planning import Budget, Engine
from marsupial.model.robots import Role
from marsupial.model.strategy import Strategy
from marsupial.planning.engines import mission_engine
from marsupial.strategies.frontier.bidding import Bidding, Sheng
from marsupial.strategies.frontier.closest import ClosestFrontier
from marsupial.strategies.frontier.covering import Covering
from marsupial.strategies.frontier.exploration import FrontierStrategy
from marsupial.strategies.frontier.orientation import Orientation, WidestFrontier
from marsupial.strategies.frontier.parameters import with_parameters
from marsupial.strategies.frontier.rule import FrontierRule
from marsupial.strategies.frontier.segmentation import Segments
from marsupial.strategies.heuristic import Heuristic
from marsupial.strategies.heuristic_plus import HeuristicPlus
from marsupial.strategies.one_step import OneStep
from marsupial.strategies.temporal import Temporal

RULES: Mapping[str, type[FrontierRule]] = {
    rule.name: rule for rule in (ClosestFrontier, Segments, Bidding, Sheng, Orientation, WidestFrontier, Covering)
}
"""Those that send robots to frontiers; they lead carriers without rovers."""


def _frontier(rule: type[FrontierRule], planner: str | Engine, budget: Budget) -> Strategy:
    return FrontierStrategy(rule())


STRATEGIES: Mapping[str, Callable[[str | Engine, Budget], Strategy]] = {
    "temporal": lambda planner, budget: Temporal(mission_engine(planner, budget), budget),
    "heuristic": lambda planner, budget: Heuristic(),
    "heuristic-plus": lambda planner, budget: HeuristicPlus(),
    "assignment": lambda planner, budget: OneStep(),
    **{name: partial(_frontier, rule) for name, rule in RULES.items()},
}

FORMER_NAMES: Mapping[str, str] = {"greedy": "assignment"}
"""What strategies were called once, and what they are called now; `greedy` is a planner."""

PLANNING_STRATEGIES = frozenset({"temporal"})
"""Those that ask a planner."""


def current_name(name: str) -> str:
    """Return what the strategy that has or had this name is called now."""
    return FORMER_NAMES.get(name, name)


def is_strategy(name: str) -> bool:
    """Say whether there is a strategy of that name, parameters left out."""
    return current_name(name).split("/")[0] in strategy_names()


def strategy_names() -> tuple[str, ...]:
    """Return the names of all strategies: ours first, then those that installed packages bring along."""
    return (*STRATEGIES, *extensions.extension_names(extensions.STRATEGIES, STRATEGIES))


def asks_planner(name: str) -> bool:
    """Say whether the strategy of that name asks a planner; one that doesn't exist asks none.

    Raises
    ------
    EngineUnavailable
        If it is of an installed package and can't be loaded.
    """
    name = current_name(name)
    if name in STRATEGIES:
        return name in PLANNING_STRATEGIES
    found = _extension(name)
    return found is not None and _asks(_loaded(found))


def strategy(name: str, *, planner: str | Engine, budget: Budget) -> Strategy:
    """Return a fresh strategy, by its name or former name; those that ask no planner ignore `planner` and `budget`.

    A name may be followed by values of the parameters of a paper: ``bidding/W_n=1/W_p=0.5``.

    What an installed package names is called without arguments, or with engine and budget where it has a true attribute
    `asks_planner`.

    Raises
    ------
    UsageError
        If there is no strategy of that name, or no such parameter of it.
    EngineUnavailable
        If it is of an installed package and can't be used, or its planner can't.
    """
    name = current_name(name)
    if name in STRATEGIES:
        return STRATEGIES[name](planner, budget)
    base, _, parameters = name.partition("/")
    if base in RULES:
        return FrontierStrategy(with_parameters(RULES[base], parameters), name)
    found = _extension(name)
    if found is None:
        raise UsageError(f"unknown strategy {name!r}; there are {', '.join(strategy_names())}")
    return _made(found, planner, budget)


def check_suits(strategy: object, roles: Iterable[Role]) -> None:
    """Raise a `ScenarioError` if a strategy is not made for a team of robots with these roles."""
    suits = getattr(strategy, "suits", None)
    if suits is not None:
        suits(roles)


def _extension(name: str) -> Extension | None:
    return extensions.extension(extensions.STRATEGIES, name, STRATEGIES)


def _asks(make: object) -> bool:
    return bool(getattr(make, "asks_planner", False))


def _loaded(found: Extension) -> Callable[..., Strategy]:
    try:
        make: Callable[..., Strategy] = found.load()
    except EngineUnavailable as error:
        raise EngineUnavailable(f"strategy {found.name}: {error}") from error
    return make


def _made(found: Extension, planner: str | Engine, budget: Budget) -> Strategy:
    make = _loaded(found)
    arguments = (mission_engine(planner, budget), budget) if _asks(make) else ()
    try:
        made = make(*arguments)
        if not callable(made.decide):
            raise TypeError("no strategy: `decide` must be a method")
    except Exception as error:  # other people's code
        said = f"{type(error).__name__}: {error}"
        raise EngineUnavailable(f"strategy {found.name} of {found.package} can't be made: {said}") from error
    return made
