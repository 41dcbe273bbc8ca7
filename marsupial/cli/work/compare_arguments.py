"""The arguments of `marsupial compare` that are texts: numbers, and several strategies."""

import re
from collections.abc import Mapping

from marsupial.bench.compare.arguments import contenders as contenders_of
from marsupial.bench.compare.arguments import named
from marsupial.bench.compare.plan import Contender
from marsupial.cli.display.messages import warn
from marsupial.errors import UsageError
from marsupial.library.choices import takes_budget
from marsupial.model.bounds import Bound
from marsupial.model.planning import NO_PLANNER, Budget
from marsupial.strategies.files import StrategyFile


def numbers(text: str | None, option: str, bound: Bound) -> tuple[int, ...] | None:
    """Return the numbers of an option like ``1-3,6``, ascending and within the bound; None if not given."""
    if text is None:
        return None
    found: set[int] = set()
    for part in text.split(","):
        ends = [end.strip() for end in part.split("-", 1)]
        for end in ends:
            if not re.fullmatch(r"\d{1,18}", end):
                raise UsageError(
                    f"{option}: {end!r} in {text!r} is not a whole number; write numbers like 2, 1-6 or 1,2,4"
                )
        first, last = int(ends[0]), int(ends[-1])
        if last < first:
            raise UsageError(f"{option}: {part.strip()!r} descends; write {last}-{first}")
        if fault := bound.fault(first) or bound.fault(last):
            raise UsageError(f"{option}: {fault}")
        found |= set(range(first, last + 1))
    return tuple(sorted(found))


def contenders(text: str, planner: str | None, budget: Budget) -> dict[Contender, str | StrategyFile]:
    """Return the contenders of a text like ``temporal:greedy,heuristic``, with their strategies."""
    return contenders_of(text.split(","), planner, budget)


def warn_of_ignored(
    text: str, compared: Mapping[Contender, str | StrategyFile], planner: str | None, limit: str | None
) -> None:
    """Warn if no contender uses `planner`, or the option `limit`."""
    takers = [one for one, part in zip(compared, text.split(","), strict=True) if named(part.strip())[1] is None]
    if planner is not None and all(one.planner == NO_PLANNER for one in takers):
        warn(f"--planner {planner} is ignored: each strategy names its own or asks none")
    if limit is not None and not any(map(takes_budget, compared.values())):
        warn(f"{limit} is ignored: none of the strategies asks a planner")
