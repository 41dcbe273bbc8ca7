"""What dying rovers cost: missions in which half of all rovers fail at random times, beside the same without faults.

Each pair is one proof map of the footprint suite and one start. The rovers that fail and the times, uniform over the
baseline's mission on that map, are drawn by the pair and the same for all strategies. The cost is the log ratio of
times with and without the losses.
"""

from __future__ import annotations

import argparse
import math
import random
from collections.abc import Sequence
from dataclasses import replace

from marsupial.bench.compare.statistics import Origin, estimate
from marsupial.bench.suite.maps import PLANNER, PROOF
from marsupial.library.metrics import Summary
from marsupial.library.missions import simulate
from marsupial.library.scenarios import load_scenario
from marsupial.model import Budget, Role, Scenario
from marsupial.model.faults import Fault, FaultKind

STRATEGIES = ("temporal", "assignment", "heuristic-plus", "heuristic")


def run(scenario: Scenario, strategy: str, seed: int) -> Summary:
    """Carry out one mission."""
    return simulate(scenario, strategy=strategy, planner=PLANNER, budget=Budget(steps=8), seed=seed)


def half_lost(scenario: Scenario, seed: int, until_s: float) -> tuple[Fault, ...]:
    """Return the losses of half of the rovers."""
    rng = random.Random(f"{scenario.name} {seed}")
    rovers = [member.name for member in scenario.team if scenario.type_of(member).role is Role.ROVER]
    drawn = rng.sample(rovers, len(rovers) // 2)
    return tuple(Fault(kind=FaultKind.LOST, robot=name, at_ms=round(1000 * rng.uniform(0, until_s))) for name in drawn)


def _cost(after_s: float | None, before_s: float | None) -> float:
    """Return the log ratio of two times; NaN if a mission left something unexplored."""
    return math.log(after_s / before_s) if after_s and before_s else math.nan


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command; return its exit code."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks losses", description=__doc__)
    parser.add_argument("--pairs", type=int, default=30, help="maps, one start on each (default %(default)s)")
    chosen = parser.parse_args(arguments)
    suite = PROOF["footprint"]
    costs: dict[str, list[tuple[Origin, tuple[float, float]]]] = {name: [] for name in STRATEGIES}
    ends: dict[str, list[str]] = {name: [] for name in STRATEGIES}
    maps = suite.maps[: chosen.pairs]
    for source in maps:
        scenario, seed = load_scenario(source, 2, 2).scenario, suite.first_seed
        whole = {name: run(scenario, name, seed) for name in STRATEGIES}
        faulty = replace(scenario, faults=half_lost(scenario, seed, whole["heuristic"].mission_time_s))
        for name, before in whole.items():
            after = run(faulty, name, seed)
            ends[name].append(str(after.status))
            explored = _cost(after.exploration_time_s, before.exploration_time_s)
            costs[name].append((Origin(source, seed), (explored, _cost(after.mission_time_s, before.mission_time_s))))
    print("strategy        exploration, % later   mission, % later   complete")
    for name, rows in costs.items():
        print(f"{name:15} {_mean(rows, 0):>20} {_mean(rows, 1):>18} {ends[name].count('complete'):>6} of {len(maps)}")
    return 0


def _mean(rows: Sequence[tuple[Origin, tuple[float, float]]], column: int) -> str:
    """Return the mean of a column over complete missions, with its interval, in per cent."""
    known = [(origin, 100 * values[column]) for origin, values in rows if math.isfinite(values[column])]
    found = estimate([origin for origin, _ in known], [value for _, value in known])
    return "none" if found is None else f"{found.mean:+.1f}" + ("" if found.half is None else f" ± {found.half:.1f}")
