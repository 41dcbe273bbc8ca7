"""The definition of a comparison: every contender on every case with every seed.

All contenders get the same maps, teams, starts and seeds, so that missions can be compared pair by pair.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass, replace

from marsupial.bench.compare.statistics import Origin
from marsupial.model.planning import NO_PLANNER, Budget
from marsupial.model.scenario import PlanningTime, Scenario


@dataclass(frozen=True, slots=True, order=True)
class Contender:
    """A strategy with its planner."""

    strategy: str
    planner: str = NO_PLANNER

    def __str__(self) -> str:
        return self.strategy if self.planner == NO_PLANNER else f"{self.strategy} ({self.planner})"


@dataclass(frozen=True, slots=True, order=True)
class Case:
    """A scenario with a team: `rovers` for each of the `carriers`."""

    scenario: str
    carriers: int
    rovers: int

    @property
    def team(self) -> str:
        """The team in short: carriers x rovers of each."""
        return f"{self.carriers}x{self.rovers}"

    def __str__(self) -> str:
        return f"{self.scenario} {self.team}"


@dataclass(frozen=True, slots=True, order=True)
class Trial:
    """One mission of a comparison; `seed` draws the starts."""

    case: Case
    contender: Contender
    seed: int

    @property
    def origin(self) -> Origin:
        """Its map and seed."""
        return Origin(self.case.scenario, self.seed)

    def __str__(self) -> str:
        return f"{self.case}, {self.contender}, seed {self.seed}"


@dataclass(frozen=True, slots=True, kw_only=True)
class Comparison:
    """The missions of a comparison."""

    scenarios: Mapping[Case, Scenario]  # in the order of the tables
    contenders: tuple[Contender, ...]  # the last one is the base to compare the others with
    runs: int  # missions per case and contender; their seeds are `first_seed` and those that follow
    budget: Budget  # of each planning
    paper: str | None = None  # the paper of this experiment, as in `marsupial reproduce`
    suite: str | None = None  # a name in `marsupial.bench.suite.maps`; results are then grouped by kind of map
    first_seed: int = 1

    def trials(self) -> Iterator[Trial]:
        """Yield every mission, seed by seed, so that an interrupted comparison has about as many runs of every case."""
        for seed in range(self.first_seed, self.first_seed + self.runs):
            for case in self.scenarios:
                for contender in self.contenders:
                    yield Trial(case, contender, seed)


def prepared(scenario: Scenario) -> Scenario:
    """Return the scenario as comparisons use it: starts drawn by each mission's seed, instant planning."""
    # Charged planning time would make missions depend on the machine.
    return replace(scenario, start_seed=None, planning_time=PlanningTime.INSTANT)


def digest(scenario: Scenario) -> str:
    """Return a hash of everything in a scenario that a mission depends on."""
    grid = scenario.grid
    rest = {
        "shape": grid.cells.shape,
        "resolution_m": grid.resolution_m,
        "terrains": [asdict(terrain) for terrain in grid.terrains],
        "types": [asdict(kind) for kind in scenario.robot_types],
        "team": [asdict(member) for member in scenario.team],
        "goal": asdict(scenario.goal),
        "limits": asdict(scenario.limits),
        "planning_time": str(scenario.planning_time),
        "start_seed": scenario.start_seed,
    }
    if scenario.interference:
        rest["interference"] = True
    text = json.dumps(rest, default=sorted, sort_keys=True)  # sets of terrain codes become lists
    return hashlib.sha256(grid.cells.tobytes() + text.encode()).hexdigest()[:16]
