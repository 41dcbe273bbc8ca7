"""The benches of marsupial's own speed: what they are asked for, what they say meanwhile, and where results go."""

from __future__ import annotations

import json as json_text
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from pathlib import Path
from typing import Any

from marsupial.bench.sim import MissionRow, SightRow, bench_mission, bench_sight
from marsupial.cli.display.messages import say
from marsupial.cli.display.tables import print_report
from marsupial.cli.missions import check_strategy, warn_of
from marsupial.cli.outputs import write_file
from marsupial.generators.builtin import SCENARIOS
from marsupial.library.scenarios import load_scenario
from marsupial.model.planning import Budget
from marsupial.model.scenario import Scenario
from marsupial.strategies.registry import strategy

STRATEGIES = ("heuristic", "temporal")


@dataclass(frozen=True, slots=True, kw_only=True)
class MissionChoice:
    """Which missions a bench carries out: each scenario by each strategy."""

    scenarios: tuple[Scenario, ...]
    strategies: tuple[str, ...]
    planner: str
    budget: Budget

    @classmethod
    def of(cls, sources: Sequence[str], strategies: Sequence[str], planner: str, budget: Budget) -> MissionChoice:
        """Return what is asked for; without any the built-in scenarios, and `STRATEGIES`. Maps' oddities are warned of.

        Raises
        ------
        EngineUnavailable, UsageError
            If a strategy or the planner can't be used.
        ScenarioError, MapError
            If there is no such scenario.
        """
        names = tuple(strategies or STRATEGIES)
        for name in names:
            check_strategy(name)
            strategy(name, planner=planner, budget=budget)
        loaded = [load_scenario(source) for source in sources or SCENARIOS]
        for one in loaded:
            warn_of(one)
        scenarios = tuple(one.scenario for one in loaded)
        return cls(scenarios=scenarios, strategies=names, planner=planner, budget=budget)


def missions_of_bench(chosen: MissionChoice, seed: int, repeats: int) -> list[MissionRow]:
    """Carry out all missions."""
    rows = []
    for scenario, name in product(chosen.scenarios, chosen.strategies):
        say(f"{scenario.name} by {name}")
        rows.append(bench_mission(scenario, name, chosen.planner, chosen.budget, seed, repeats))
    return rows


def sights_of_bench(sizes: Sequence[int], seed: int, repeats: int) -> list[SightRow]:
    """Take all views."""
    say(f"views on maps of {', '.join(map(str, sizes))} cells a side")
    return list(bench_sight(sizes, seed, repeats))


def show(text: str, rows: Sequence[Mapping[str, Any]], json: Path | None) -> None:
    """Print the text, and write the rows to a file if there is to be one."""
    if json is not None:
        write_file(json, json_text.dumps(rows, indent=1) + "\n")
    print_report(text)
