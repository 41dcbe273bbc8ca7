"""The strategies, by the name the command line and comparisons use.

Each is named by where it is, as entry points are (``package.module:name``), and imported when it is first made: to list
them takes none of what they are made of, not even numpy.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import replace
from functools import partial
from pkgutil import resolve_name
from typing import TYPE_CHECKING

from marsupial import extensions
from marsupial.errors import EngineUnavailable, UsageError
from marsupial.extensions import Extension
from marsupial.model.strategyinfo import StrategyInfo
from marsupial.strategies import infos
from marsupial.wording import unknown_name

if TYPE_CHECKING:
    from marsupial.model.planning import Budget, Engine
    from marsupial.model.robots import Role
    from marsupial.model.strategy import Strategy
    from marsupial.strategies.frontier.rule import FrontierRule

RULES: Mapping[str, str] = {
    "closest-frontier": "marsupial.papers.wurm2008.rules:ClosestFrontier",
    "segmentation": "marsupial.papers.wurm2008.rules:Segments",
    "bidding": "marsupial.papers.alkhawaldah.rule:Bidding",
    "sheng": "marsupial.papers.sheng2006.rule:Sheng",
    "orientation": "marsupial.papers.mei2006.rules:Orientation",
    "widest-frontier": "marsupial.papers.mei2006.rules:WidestFrontier",
    "covering": "marsupial.strategies.frontier.covering:Covering",
}
"""Those that send robots to frontiers; they lead carriers without rovers."""


def frontier_rule(name: str) -> type[FrontierRule]:
    """Return the rule of that name in `RULES`."""
    rule: type[FrontierRule] = resolve_name(RULES[name])
    return rule


def _temporal(planner: str | Engine, budget: Budget) -> Strategy:
    from marsupial.planning.engines import mission_engine
    from marsupial.strategies.temporal import Temporal

    return Temporal(mission_engine(planner, budget), budget)


def _without_planner(target: str, planner: str | Engine, budget: Budget) -> Strategy:
    made: Strategy = resolve_name(target)()
    return made


def _frontier(rule: str, planner: str | Engine, budget: Budget) -> Strategy:
    from marsupial.strategies.frontier.exploration import FrontierStrategy

    return FrontierStrategy(frontier_rule(rule)())


STRATEGIES: Mapping[str, Callable[[str | Engine, Budget], Strategy]] = {
    "temporal": _temporal,
    "heuristic": partial(_without_planner, "marsupial.strategies.heuristic:Heuristic"),
    "heuristic-plus": partial(_without_planner, "marsupial.strategies.heuristic_plus:HeuristicPlus"),
    "assignment": partial(_without_planner, "marsupial.strategies.one_step:OneStep"),
    **{rule: partial(_frontier, rule) for rule in RULES},
}

PLANNING_STRATEGIES = frozenset(info.name for info in infos.OWN if info.asks_planner)
"""Those that ask a planner."""


def is_strategy(name: str) -> bool:
    """Say whether there is a strategy of that name, parameters left out."""
    return name.split("/")[0] in strategy_names()


def strategy_names() -> tuple[str, ...]:
    """Return the names of all strategies: ours first, then those that installed packages bring along."""
    return (*STRATEGIES, *extensions.extension_names(extensions.STRATEGIES, STRATEGIES))


def strategy_infos() -> tuple[StrategyInfo, ...]:
    """Return what there is to say of every strategy: ours, the clairvoyant, those of installed packages, usable or not.

    What an installed package names may say it in an attribute `info`; else it is the first line of its docstring.
    """
    others = extensions.extensions(extensions.STRATEGIES, STRATEGIES)
    return (*infos.OWN, infos.CLAIRVOYANT, *map(_extension_info, others))


def asks_planner(name: str) -> bool:
    """Say whether the strategy of that name asks a planner; one that doesn't exist asks none.

    Raises
    ------
    EngineUnavailable
        If it is of an installed package and can't be loaded.
    """
    if name in STRATEGIES:
        return name in PLANNING_STRATEGIES
    found = _extension(name)
    return found is not None and _asks(_loaded(found))


def strategy(name: str, *, planner: str | Engine, budget: Budget) -> Strategy:
    """Return a fresh strategy, by its name; those that ask no planner ignore `planner` and `budget`.

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
    if name in STRATEGIES:
        return STRATEGIES[name](planner, budget)
    base, _, parameters = name.partition("/")
    if base in RULES:
        from marsupial.strategies.frontier.exploration import FrontierStrategy
        from marsupial.strategies.frontier.rule import with_parameters

        return FrontierStrategy(with_parameters(frontier_rule(base), parameters), name)
    found = _extension(name)
    if found is None:
        raise UsageError(unknown_name("strategy", name, strategy_names()))
    return _made(found, planner, budget)


def check_suits(strategy: object, roles: Iterable[Role]) -> None:
    """Raise a `ScenarioError` if a strategy is not made for a team of robots with these roles."""
    suits = getattr(strategy, "suits", None)
    if suits is not None:
        suits(roles)


def _extension(name: str) -> Extension | None:
    return extensions.extension(extensions.STRATEGIES, name, STRATEGIES)


def _extension_info(found: Extension) -> StrategyInfo:
    name = f"{found.name} ({found.package})" if found.name in STRATEGIES else found.name
    try:
        make = found.load()
    except EngineUnavailable as error:
        return StrategyInfo(name=name, summary=f"of {found.package}", missing=str(error))
    told = getattr(make, "info", None)
    if not isinstance(told, StrategyInfo):
        summary = (make.__doc__ or f"of {found.package}").strip().splitlines()[0]
        told = StrategyInfo(name=name, summary=summary)
    return replace(told, name=name, asks_planner=_asks(make))


def _asks(make: object) -> bool:
    return bool(getattr(make, "asks_planner", False))


def _loaded(found: Extension) -> Callable[..., Strategy]:
    try:
        make: Callable[..., Strategy] = found.load()
    except EngineUnavailable as error:
        raise EngineUnavailable(f"strategy {found.name}: {error}") from error
    return make


def _made(found: Extension, planner: str | Engine, budget: Budget) -> Strategy:
    from marsupial.planning.engines import mission_engine

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
