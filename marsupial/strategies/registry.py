"""The registry of strategies, by the names that the command line and comparisons use.

An entry holds the location of its code, as entry points do (``package.module:name``), which is imported when the
strategy is first created: listing strategies imports neither them nor numpy. Strategies of installed packages come from
the entry points `marsupial.strategies`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import replace
from pkgutil import resolve_name
from typing import TYPE_CHECKING, Any

from marsupial import extensions
from marsupial.errors import EngineUnavailable, UsageError
from marsupial.extensions import Extension
from marsupial.model.strategyinfo import StrategyInfo
from marsupial.strategies import infos
from marsupial.strategies.clairvoyant import CLAIRVOYANT
from marsupial.strategies.files import StrategyFile
from marsupial.wording import unknown_name

if TYPE_CHECKING:
    from marsupial.model import Budget, Decider, Engine, Role
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
"""The rules that send robots to frontier cells, for teams without rovers."""


def frontier_rule(name: str) -> type[FrontierRule]:
    """Return the rule of that name in `RULES`."""
    rule: type[FrontierRule] = resolve_name(RULES[name])
    return rule


STRATEGIES: Mapping[str, str] = {
    "temporal": "marsupial.strategies.temporal:Temporal",
    "wurm2010": "marsupial.papers.wurm2010.strategy:ShortestPlan",
    "heuristic": "marsupial.strategies.heuristic:Heuristic",
    "heuristic-plus": "marsupial.strategies.heuristic_plus:HeuristicPlus",
    "assignment": "marsupial.strategies.one_step:OneStep",
    **RULES,
}
"""All of marsupial's own strategies, rules included."""

PLANNING_STRATEGIES = frozenset(info.name for info in infos.OWN if info.asks_planner)
"""The strategies that ask a planner."""


def is_strategy(name: str) -> bool:
    """Return whether a strategy of that name exists; parameters in the name are ignored."""
    return name.split("/")[0] in strategy_names()


def check_strategy(name: str) -> None:
    """Raise a `UsageError` if there is no strategy of this name."""
    if name != CLAIRVOYANT and not is_strategy(name):
        raise UsageError(unknown_name("strategy", name, (*strategy_names(), CLAIRVOYANT)))


def strategy_names() -> tuple[str, ...]:
    """Return the names of all strategies: marsupial's own, then those of installed packages."""
    return (*STRATEGIES, *extensions.extension_names(extensions.STRATEGIES, STRATEGIES))


def strategy_infos() -> tuple[StrategyInfo, ...]:
    """Return descriptions of all strategies: marsupial's own, the clairvoyant, and those of installed packages.

    An installed strategy describes itself in its attribute `info`, or else by the first line of its docstring.
    """
    others = extensions.extensions(extensions.STRATEGIES, STRATEGIES)
    return (*infos.OWN, infos.CLAIRVOYANT, *map(_extension_info, others))


def asks_planner(name: str | StrategyFile) -> bool:
    """Return whether the strategy of that name, or in that file, asks a planner; False if unknown.

    Raises
    ------
    EngineUnavailable
        If the strategy belongs to an installed package and can't be loaded.
    """
    if isinstance(name, StrategyFile):
        return _asks(name.load())
    base = name.split("/")[0]
    if base in STRATEGIES:
        return base in PLANNING_STRATEGIES
    found = _extension(name)
    return found is not None and _asks(_loaded(found))


def strategy(name: str | StrategyFile, *, planner: str | Engine, budget: Budget) -> Decider:
    """Return a new strategy by its name, or of a file; strategies that ask no planner ignore `planner` and `budget`.

    Values of parameters may follow the name: ``bidding/W_n=1/W_p=0.5``.

    The object that an installed package's entry point names, or the class in a file, is called without arguments, or
    with engine and budget if it has a true attribute `asks_planner`.

    Raises
    ------
    UsageError
        If there is no strategy of that name, it has no such parameter, or lacks something.
    EngineUnavailable
        If the strategy is not one of marsupial's own and can't be used, or its planner can't.
    """
    if isinstance(name, StrategyFile):
        return _made(name, planner, budget)
    base = name.split("/")[0]
    if base in RULES:
        from marsupial.strategies.frontier.exploration import FrontierStrategy
        from marsupial.strategies.frontier.rule import with_parameters

        return FrontierStrategy(with_parameters(frontier_rule(base), name), name)
    if base == "temporal":
        from marsupial.strategies.frontier.rule import with_parameters
        from marsupial.strategies.temporal import Temporal, TemporalParts

        return Temporal(*_planning(planner, budget), with_parameters(TemporalParts, name), name)
    if name in STRATEGIES:
        make = resolve_name(STRATEGIES[name])
        made: Decider = make(*_planning(planner, budget)) if _asks(make) else make()
        return made
    found = _extension(name)
    if found is None:
        raise UsageError(unknown_name("strategy", name, strategy_names()))
    return _made(found, planner, budget)


def check_suits(decider: Any, roles: Iterable[Role]) -> None:
    """Raise a `ScenarioError` if a strategy (`Decider`) can't lead a team of robots with these roles."""
    from marsupial.model.strategy import as_strategy

    as_strategy(decider).suits(roles)


def _extension(name: str) -> Extension | None:
    return extensions.extension(extensions.STRATEGIES, name, STRATEGIES)


def _extension_info(found: Extension) -> StrategyInfo:
    # a package can't replace a strategy of marsupial's own; the listing shows both
    name = f"{found.name} ({found.package})" if found.name in STRATEGIES else found.name
    try:
        make = found.load()
    except EngineUnavailable as error:
        return StrategyInfo(name=name, summary=f"of {found.package}", missing=str(error))
    info = getattr(make, "info", None)
    if not isinstance(info, StrategyInfo):
        summary = (make.__doc__ or f"of {found.package}").strip().splitlines()[0]
        info = StrategyInfo(name=name, summary=summary)
    return replace(info, name=name, asks_planner=_asks(make))


def _planning(planner: str | Engine, budget: Budget) -> tuple[Engine, Budget]:
    """Return the arguments with which strategies are created that ask a planner."""
    from marsupial.planning.engines import mission_engine

    return mission_engine(planner, budget), budget


def _asks(make: object) -> bool:
    return bool(getattr(make, "asks_planner", False))


def _loaded(found: Extension | StrategyFile) -> Callable[..., Decider]:
    try:
        make: Callable[..., Decider] = found.load()
    except EngineUnavailable as error:
        raise EngineUnavailable(f"strategy {found.name}: {error}") from error
    return make


def _made(found: Extension | StrategyFile, planner: str | Engine, budget: Budget) -> Decider:
    from marsupial.model.strategy import checked_decider

    make = _loaded(found)
    arguments = _planning(planner, budget) if _asks(make) else ()
    try:
        made = make(*arguments)
    except Exception as error:  # code of other packages may raise anything
        fault = f"{type(error).__name__}: {error}"
        raise EngineUnavailable(f"strategy {found.name} of {found.package} can't be made: {fault}") from error
    return checked_decider(f"strategy {found.name}", made)
