"""The arguments of `marsupial compare`: its contenders, and its cases, each a scenario with a team.

All of them are checked before the comparison's own imports, which take a second.
"""

import re
from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import product

from marsupial.bench.compare.plan import Case, Contender, prepared
from marsupial.cli.display.messages import warn
from marsupial.cli.work.missions import warn_of
from marsupial.errors import UsageError
from marsupial.library.choices import DEFAULT_PLANNER, planner_for, takes_budget
from marsupial.library.scenarios import load_scenario
from marsupial.model.bounds import Bound
from marsupial.model.planning import NO_PLANNER, Budget
from marsupial.model.robots import Role
from marsupial.model.scenario import Scenario, has_fixed_starts
from marsupial.strategies.clairvoyant import CLAIRVOYANT
from marsupial.strategies.files import StrategyFile, strategy_file
from marsupial.strategies.registry import check_strategy
from marsupial.strategies.registry import strategy as made

MOST_CASES = 10_000


def numbers(text: str | None, option: str, bound: Bound) -> tuple[int, ...] | None:
    """Return the numbers of an option like ``1-3,6``, ascending and within the bound; None if not given."""
    if text is None:
        return None
    found: set[int] = set()
    for part in text.split(","):
        match = re.fullmatch(r"\s*(\d{1,18})\s*(?:-\s*(\d{1,18})\s*)?", part)
        if match is None or (match[2] and int(match[2]) < int(match[1])):
            raise UsageError(f"{option}: must be numbers like 2, 1-6 or 1,2,4, got {text!r}")
        first, last = int(match[1]), int(match[2] or match[1])
        if fault := bound.fault(first) or bound.fault(last):
            raise UsageError(f"{option}: {fault}")
        found |= set(range(first, last + 1))
    return tuple(sorted(found))


def contenders(text: str, planner: str | None, budget: Budget) -> dict[Contender, str | StrategyFile]:
    """Return the contenders of a text like ``temporal:greedy,my_rule.py:MyRule``, with the strategies they stand for.

    `planner` is for those that name none.
    """
    found: dict[Contender, str | StrategyFile] = {}
    for part in text.split(","):
        strategy, own = _named(part.strip())
        contender = _contender(strategy, own, planner or DEFAULT_PLANNER, budget)
        if contender in found:
            raise UsageError(f"--strategies: {contender} is named twice")
        found[contender] = strategy
    return found


def warn_of_ignored(
    text: str, compared: Mapping[Contender, str | StrategyFile], planner: str | None, limit: str | None
) -> None:
    """Warn if no contender uses `planner`, or the option `limit`."""
    takers = [one for one, part in zip(compared, text.split(","), strict=True) if _named(part.strip())[1] is None]
    if planner is not None and all(one.planner == NO_PLANNER for one in takers):
        warn(f"--planner {planner} is ignored: each strategy names its own or asks none")
    if limit is not None and not any(map(takes_budget, compared.values())):
        warn(f"{limit} is ignored: none of the strategies asks a planner")


def _named(text: str) -> tuple[str | StrategyFile, str | None]:
    """Return the strategy that a text names, and the planner behind it, if any."""
    if (found := strategy_file(text)) is not None:
        return found
    strategy, colon, own = text.partition(":")
    check_strategy(strategy)
    return strategy, own if colon else None


def _contender(strategy: str | StrategyFile, own: str | None, planner: str, budget: Budget) -> Contender:
    name = strategy if isinstance(strategy, str) else strategy.name
    chosen = NO_PLANNER
    if planner_for(strategy, planner) != NO_PLANNER:
        chosen = planner if own is None else own
    elif own is not None:
        raise UsageError(f"--strategies: {name} asks no planner, so it can't have {own!r}")
    if strategy != CLAIRVOYANT:
        made(strategy, planner=chosen, budget=budget)  # raises if it, its parameters or its planner can't be used
    return Contender(name, chosen)


def cases_of(
    sources: Sequence[str], carriers: Sequence[int] | None, rovers: Sequence[int] | None
) -> dict[Case, Scenario]:
    """Return the scenarios of these options by case; None keeps a number of a scenario's own team."""
    if len(sources) * len(carriers or (0,)) * len(rovers or (0,)) > MOST_CASES:
        raise UsageError(f"more than {MOST_CASES} combinations of scenarios and teams")
    found: dict[Case, Scenario] = {}
    for source in dict.fromkeys(sources):
        of_source = _of_source(source, carriers, rovers)
        if not found.keys().isdisjoint(of_source):  # two files of the same name: tell them apart by path
            of_source = {replace(case, scenario=source): scenario for case, scenario in of_source.items()}
        found |= of_source
    return found


def _of_source(source: str, carriers: Sequence[int] | None, rovers: Sequence[int] | None) -> dict[Case, Scenario]:
    found: dict[Case, Scenario] = {}
    grid = None
    for team in product(carriers or (None,), rovers or (None,)):
        loaded = load_scenario(source, *team)
        if grid is None:
            warn_of(loaded)
            grid = loaded.scenario.grid  # shared by all teams, so that it is sent to each worker once
        scenario = prepared(replace(loaded.scenario, grid=grid))
        roles = [scenario.type_of(member).role for member in scenario.team]
        count = roles.count(Role.CARRIER)
        found[Case(scenario.name, count, round(roles.count(Role.ROVER) / count))] = scenario
    if any(map(has_fixed_starts, found.values())):
        warn(f"{source}: all starts are fixed: every run of it is the same mission")
    return found
