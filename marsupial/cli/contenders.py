"""Options of `marsupial compare` that can be wrong before anything is imported that takes long."""

from __future__ import annotations

import re
from collections.abc import Sequence

from marsupial.bench.compare.plan import Contender
from marsupial.cli.display.messages import warn
from marsupial.cli.missions import check_strategy
from marsupial.errors import UsageError
from marsupial.library.choices import DEFAULT_PLANNER, planner_for, takes_budget
from marsupial.model.bounds import Bound
from marsupial.model.planning import NO_PLANNER, Budget
from marsupial.planning.engines import mission_engine
from marsupial.strategies.clairvoyant import CLAIRVOYANT
from marsupial.strategies.registry import strategy as made


def numbers(text: str | None, option: str, bound: Bound) -> tuple[int, ...] | None:
    """Return the numbers that an option like ``1-3,6`` names, in order, all within the bound; None without it."""
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


def contenders(text: str, planner: str | None, budget: Budget) -> tuple[Contender, ...]:
    """Return the contenders that ``temporal:greedy,temporal,heuristic`` names; `planner` is for those that name none.

    Raises
    ------
    UsageError, EngineUnavailable
        If there is no such strategy or planner, or one can't be used here.
    """
    found = [_contender(part.strip(), planner or DEFAULT_PLANNER, budget) for part in text.split(",")]
    twice = [str(contender) for contender in found if found.count(contender) > 1]
    if twice:
        raise UsageError(f"--strategies: {twice[0]} is named twice")
    return tuple(found)


def warn_of_ignored(text: str, compared: Sequence[Contender], planner: str | None, limit: str | None) -> None:
    """Warn of a planner that no contender is given, and of an option `limit` that none makes anything of."""
    takers = [one for one, part in zip(compared, text.split(","), strict=True) if ":" not in part]
    if planner is not None and all(one.planner == NO_PLANNER for one in takers):
        warn(f"--planner {planner} is ignored: each strategy names its own or asks none")
    if limit is not None and not any(takes_budget(one.strategy) for one in compared):
        warn(f"{limit} is ignored: none of the strategies asks a planner")


def _contender(text: str, planner: str, budget: Budget) -> Contender:
    strategy, colon, own = text.partition(":")
    check_strategy(strategy)
    if planner_for(strategy, planner) == NO_PLANNER:
        if colon:
            raise UsageError(f"--strategies: {strategy} asks no planner, so it can't have {own!r}")
        if strategy != CLAIRVOYANT:
            made(strategy, planner=planner, budget=budget)  # refuses parameters that it does not take
        return Contender(strategy, NO_PLANNER)
    mission_engine(own if colon else planner, budget)  # refuses what can't be used before anything is started
    return Contender(strategy, own if colon else planner)
