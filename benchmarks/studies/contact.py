"""What short radios cost: missions in which rovers are in contact within some metres only, beside the same unlimited.

Each pair is one tuning map of the footprint suite and one start. The cost is the log ratio of times with and without
the limit; nothing goes wrong in these missions, so no robot may be lost.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from dataclasses import replace

from benchmarks.studies.losses import HEAD, Delays, run
from marsupial.bench.compare.statistics import Origin
from marsupial.bench.suite.maps import TUNING
from marsupial.library.scenarios import load_scenario
from marsupial.model import Role, Scenario

STRATEGIES = ("temporal", "assignment", "heuristic")
RANGES_M = (20.0, 10.0, 5.0)


def limited(scenario: Scenario, range_m: float) -> Scenario:
    """Return the scenario in which rovers are in contact within a range only."""
    kinds = (replace(k, radio_range_m=range_m) if k.role is Role.ROVER else k for k in scenario.robot_types)
    return replace(scenario, robot_types=tuple(kinds))


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command; return its exit code: 1 if a robot was lost."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks contact", description=__doc__)
    parser.add_argument("--pairs", type=int, default=42, help="maps, one start on each (default %(default)s)")
    parser.add_argument("--carriers", type=int, default=2, help="of two rovers each (default %(default)s)")
    chosen = parser.parse_args(arguments)
    suite = TUNING["footprint"]
    costs = {(name, range_m): Delays() for name in STRATEGIES for range_m in RANGES_M}
    for source in suite.maps[: chosen.pairs]:
        scenario, seed = load_scenario(source, chosen.carriers, 2).scenario, suite.first_seed
        for name in STRATEGIES:
            before, _ = run(scenario, name, seed)
            for range_m in RANGES_M:
                costs[name, range_m].add(Origin(source, seed), before, *run(limited(scenario, range_m), name, seed))
    print(f"{HEAD}   lost")
    for (name, range_m), cost in costs.items():
        print(f"{cost.row(f'{name} {range_m:g} m')} {cost.lost:>6}")
    return 1 if any(cost.lost for cost in costs.values()) else 0
