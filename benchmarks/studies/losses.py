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
from dataclasses import dataclass, field, replace

from marsupial.bench.compare.statistics import Origin, estimate
from marsupial.bench.compare.tables import mean_text
from marsupial.bench.suite.maps import PLANNER, PROOF
from marsupial.library.metrics import Summary
from marsupial.library.missions import simulate
from marsupial.library.scenarios import load_scenario
from marsupial.mission.observer import Observer
from marsupial.model import Budget, MissionEvent, Role, Scenario
from marsupial.model.faults import Fault, FaultKind
from marsupial.model.mission import RobotLost

STRATEGIES = ("temporal", "assignment", "heuristic-plus", "heuristic")


@dataclass
class Delays:
    """What a change of the scenario costs a strategy: log ratios of times with and without it, mission by mission."""

    times: list[tuple[Origin, tuple[float, float]]] = field(default_factory=list)  # of exploration, and of the mission
    explored: int = 0  # missions without targets left; where lost rovers stay outside, none is complete
    lost: int = 0  # robots

    def add(self, origin: Origin, before: Summary, after: Summary, lost: int) -> None:
        explored = _cost(after.exploration_time_s, before.exploration_time_s)
        self.times.append((origin, (explored, _cost(after.mission_time_s, before.mission_time_s))))
        self.explored += after.exploration_time_s is not None
        self.lost += lost

    def row(self, name: str) -> str:
        """Return a row of a table below `HEAD`."""
        explored, whole = _mean(self.times, 0), _mean(self.times, 1)
        return f"{name:15} {explored:>20} {whole:>18} {self.explored:>6} of {len(self.times)}"


HEAD = "strategy        exploration, % later   mission, % later   explored"


class _Losses(Observer):
    """Counts the robots that are lost."""

    def __init__(self) -> None:
        self.count = 0

    def event(self, event: MissionEvent) -> None:
        self.count += isinstance(event, RobotLost)


def run(scenario: Scenario, strategy: str, seed: int) -> tuple[Summary, int]:
    """Carry out one mission; return its summary, and how many robots were lost."""
    losses, budget = _Losses(), Budget(steps=8)
    summary = simulate(scenario, strategy=strategy, planner=PLANNER, budget=budget, seed=seed, observer=losses)
    return summary, losses.count


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
    costs = {name: Delays() for name in STRATEGIES}
    for source in suite.maps[: chosen.pairs]:
        scenario, seed = load_scenario(source, 2, 2).scenario, suite.first_seed
        whole = {name: run(scenario, name, seed)[0] for name in STRATEGIES}
        faulty = replace(scenario, faults=half_lost(scenario, seed, whole["heuristic"].mission_time_s))
        for name, before in whole.items():
            costs[name].add(Origin(source, seed), before, *run(faulty, name, seed))
    print(HEAD, *(cost.row(name) for name, cost in costs.items()), sep="\n")
    return 0


def _mean(rows: Sequence[tuple[Origin, tuple[float, float]]], column: int) -> str:
    """Return the mean of a column over complete missions, with its interval, in per cent."""
    known = [(origin, 100 * values[column]) for origin, values in rows if math.isfinite(values[column])]
    found = estimate([origin for origin, _ in known], [value for _, value in known])
    return mean_text(found, 1, len(known), "+")
