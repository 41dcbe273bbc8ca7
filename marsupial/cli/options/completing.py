"""Shell completion of the names of scenarios, strategies and planners, and of files where these are allowed.

Imports are made on demand and must be quick: a person waits at each TAB.
"""

from collections.abc import Iterable
from glob import escape
from pathlib import Path


def scenario_or_file(incomplete: str) -> list[str]:
    """Return matching built-in scenarios and files of this folder; the shell completes files elsewhere."""
    from marsupial.generators.builtin import SCENARIOS

    names = _starting(incomplete, SCENARIOS)
    if not incomplete or "/" in incomplete:
        return names
    return names + sorted(str(path) for path in Path().glob(f"{escape(incomplete)}*") if path.is_file())


def strategy(incomplete: str) -> list[str]:
    from marsupial.strategies.clairvoyant import CLAIRVOYANT
    from marsupial.strategies.registry import strategy_names

    return _starting(incomplete, (*strategy_names(), CLAIRVOYANT))


def strategies(incomplete: str) -> list[str]:
    """Complete the last of several comma-separated strategies, or the planner after its colon."""
    before, comma, last = incomplete.rpartition(",")
    name, colon, asked = last.partition(":")
    found = [f"{name}:{one}" for one in planner(asked)] if colon else strategy(last)
    return [f"{before}{comma}{one}" for one in found]


def paper(incomplete: str) -> list[str]:
    from marsupial.papers import PAPERS

    return _starting(incomplete, PAPERS)


def suite(incomplete: str) -> list[str]:
    from marsupial.bench.suite.maps import SUITES

    return _starting(incomplete, SUITES)


def planner(incomplete: str) -> list[str]:
    from marsupial.planning.names import engine_names

    return _starting(incomplete, engine_names())


def _starting(incomplete: str, names: Iterable[str]) -> list[str]:
    return [name for name in names if name.startswith(incomplete)]
