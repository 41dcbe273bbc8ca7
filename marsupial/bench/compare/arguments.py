"""What a caller names, as parts of a comparison: contenders, and cases, each a scenario with a team.

All of it is checked before the comparison's own imports, which take a second.
"""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from itertools import product
from os import PathLike

from marsupial.bench.compare.plan import Case, Contender, prepared
from marsupial.errors import UsageError
from marsupial.library.choices import DEFAULT_PLANNER, planner_for
from marsupial.library.scenarios import Source, load_scenario
from marsupial.model.planning import NO_PLANNER, Budget
from marsupial.model.robots import Role
from marsupial.model.scenario import Scenario, has_fixed_starts
from marsupial.strategies.clairvoyant import CLAIRVOYANT
from marsupial.strategies.files import StrategyFile, strategy_file
from marsupial.strategies.registry import check_strategy
from marsupial.strategies.registry import strategy as made

MOST_CASES = 10_000


def named(text: str) -> tuple[str | StrategyFile, str | None]:
    """Return the strategy that a text like ``temporal:greedy`` names, and the planner behind it, if any."""
    if (found := strategy_file(text)) is not None:
        return found
    strategy, colon, own = text.partition(":")
    check_strategy(strategy)
    return strategy, own if colon else None


def contenders(texts: Iterable[str], planner: str | None, budget: Budget) -> dict[Contender, str | StrategyFile]:
    """Return the contenders that texts like ``temporal:greedy`` and ``my_rule.py:MyRule`` name, with their strategies.

    `planner` is for those that name none.
    """
    found: dict[Contender, str | StrategyFile] = {}
    for text in texts:
        strategy, own = named(text.strip())
        contender = _contender(strategy, own, planner or DEFAULT_PLANNER, budget)
        if contender in found:
            raise UsageError(f"strategies: {contender} is named twice")
        found[contender] = strategy
    return found


def _contender(strategy: str | StrategyFile, own: str | None, planner: str, budget: Budget) -> Contender:
    name = strategy if isinstance(strategy, str) else strategy.name
    chosen = NO_PLANNER
    if planner_for(strategy, planner) != NO_PLANNER:
        chosen = planner if own is None else own
    elif own is not None:
        raise UsageError(f"strategies: {name} asks no planner, so it can't have {own!r}")
    if strategy != CLAIRVOYANT:
        made(strategy, planner=chosen, budget=budget)  # raises if it, its parameters or its planner can't be used
    return Contender(name, chosen)


def cases_of(
    sources: Iterable[Source],
    carriers: Sequence[int] | None,
    rovers: Sequence[int] | None,
    warn: Callable[[str], None],
    resolution_m: float | None = None,
) -> dict[Case, Scenario]:
    """Return the scenarios of these sources by case; None keeps a number of a scenario's own team.

    `resolution_m` is for sources without the size of their cells.

    `warn` gets what looks wrong about a map or its starts.
    """
    chosen: list[Source] = []
    chosen += (one for one in sources if not (isinstance(one, str) and one in chosen))
    if len(chosen) * len(carriers or (0,)) * len(rovers or (0,)) > MOST_CASES:
        raise UsageError(f"more than {MOST_CASES} combinations of scenarios and teams")
    found: dict[Case, Scenario] = {}
    for number, source in enumerate(chosen, 1):
        of_source = _of_source(source, carriers, rovers, warn, resolution_m)
        if not found.keys().isdisjoint(of_source):  # two of the same name: tell them apart by path or place
            own = next(iter(of_source)).scenario
            name = str(source) if isinstance(source, str | PathLike) else f"{own} ({number})"
            of_source = {replace(case, scenario=name): scenario for case, scenario in of_source.items()}
        found |= of_source
    return found


def _of_source(
    source: Source,
    carriers: Sequence[int] | None,
    rovers: Sequence[int] | None,
    warn: Callable[[str], None],
    resolution_m: float | None,
) -> dict[Case, Scenario]:
    found: dict[Case, Scenario] = {}
    grid = None
    for team in product(carriers or (None,), rovers or (None,)):
        loaded = load_scenario(source, *team, resolution_m)
        if grid is None:
            for text in loaded.warnings():
                warn(text)
            grid = loaded.scenario.grid  # shared by all teams, so that it is sent to each worker once
        scenario = prepared(replace(loaded.scenario, grid=grid))
        roles = [scenario.type_of(member).role for member in scenario.team]
        count = roles.count(Role.CARRIER)
        found[Case(scenario.name, count, round(roles.count(Role.ROVER) / count))] = scenario
    if any(map(has_fixed_starts, found.values())):
        warn(f"{loaded.source}: all starts are fixed: every run of it is the same mission")
    return found
