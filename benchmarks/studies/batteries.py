"""Missions with batteries: robots stranded, and what batteries cost, beside the same missions without.

Each pair of a map of the suite of small mazes, rooms and caves and a start is run with batteries that make it tight
(rovers last for some drives only, and in half of the pairs carriers have to recharge at the start of the first), and
with batteries so large that they never bind. A robot is stranded if its battery runs empty.
"""

from __future__ import annotations

import argparse
import random
from collections import Counter
from collections.abc import Sequence
from dataclasses import replace

from marsupial.bench.suite.maps import PLANNER, PROOF
from marsupial.library.metrics import Summary
from marsupial.library.missions import simulate
from marsupial.library.recording import Recorder
from marsupial.library.scenarios import load_scenario
from marsupial.mission.placement import place_team
from marsupial.model import Battery, Budget, Role, Scenario
from marsupial.model.mission import RobotLost

LARGE_J = 1e9
ROVER_J, CARRIER_J = (400.0, 2000.0), (15_000.0, 60_000.0)  # least and most of the tight batteries
ROVER_W, CARRIER_W = 60.0, 400.0  # charging

SEEDS = 7  # starts on each map


def with_batteries(scenario: Scenario, seed: int, rover_j: float | None, carrier_j: float | None) -> Scenario:
    """Return the scenario with batteries (None: without limit); carriers charge where the first of them starts."""
    sizes = {Role.ROVER: (rover_j, ROVER_W), Role.CARRIER: (carrier_j, CARRIER_W)}
    batteries = {
        role: None if size is None else Battery(capacity_j=size, charge_w=power)
        for role, (size, power) in sizes.items()
    }
    kinds = tuple(replace(kind, battery=batteries[kind.role]) for kind in scenario.robot_types)
    starts = tuple(robot.cell for robot in place_team(scenario, seed) if robot.cell is not None)
    return replace(scenario, robot_types=kinds, grid=replace(scenario.grid, chargers=starts[:1]))


def run(scenario: Scenario, strategy: str, seed: int) -> tuple[Summary, list[str]]:
    """Carry out one mission; return its summary and the robots whose batteries ran empty."""
    recorder, budget = Recorder(), Budget(steps=8)
    summary = simulate(scenario, strategy=strategy, planner=PLANNER, budget=budget, seed=seed, observer=recorder)
    return summary, [event.robot for event in recorder.events if isinstance(event, RobotLost)]


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command; return its exit code."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks batteries", description=__doc__)
    parser.add_argument("--missions", type=int, default=200, help="missions with tight batteries (default %(default)s)")
    parser.add_argument("--strategy", default="temporal")
    chosen = parser.parse_args(arguments)
    suite, ends, longest, stranded = PROOF["footprint"], Counter[str](), 0.0, 0
    pairs = [(source, suite.first_seed + i) for i in range(SEEDS) for source in suite.maps]
    for number, (source, seed) in enumerate(pairs[: chosen.missions]):
        scenario, rng = load_scenario(source, 2, 2).scenario, random.Random(f"{source} {seed}")
        carrier_j = rng.uniform(*CARRIER_J) if rng.random() < 0.5 else None
        tight = with_batteries(scenario, seed, rng.uniform(*ROVER_J), carrier_j)
        summary, lost = run(tight, chosen.strategy, seed)
        stranded += bool(lost)
        ends[f"{summary.status}: no battery suffices" if "no battery" in summary.reason else str(summary.status)] += 1
        if lost or summary.status == "failed":
            print(f"{source} {seed}: {summary.status}, {summary.reason}; stranded: {', '.join(lost) or 'none'}")
        if number % 10 == 0:
            free, _ = run(scenario, chosen.strategy, seed)
            large, _ = run(with_batteries(scenario, seed, LARGE_J, LARGE_J), chosen.strategy, seed)
            longest = max(longest, large.mission_time_s / free.mission_time_s - 1)
    print(f"{sum(ends.values())} missions with tight batteries, {stranded} with stranded robots")
    for end, count in ends.most_common():
        print(f"  {count:4} {end}")
    print(f"batteries that don't bind: at most {100 * longest:.1f} % longer than without, in every tenth mission")
    return 0
