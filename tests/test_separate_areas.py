"""Every strategy on small random maps with separate areas and short-sighted robots.

Whether a robot reaches a cell is a question about that robot: another one of its type may stand behind a wall.
"""

import random

import numpy as np
import pytest
from support.missions.small_missions import Watcher
from support.missions.small_teams import drawn_grid, kinds_of

from marsupial.library.missions import simulate
from marsupial.mission.placement import place_team
from marsupial.model import FLOOR, Budget, Cell, Goal, Scenario, Status, TeamMember
from marsupial.strategies.clairvoyant import CLAIRVOYANT
from marsupial.strategies.registry import RULES, STRATEGIES, frontier_rule

SEEDS = [1, 27, 38, *(pytest.param(seed, marks=pytest.mark.slow) for seed in range(40, 80))]


def drawn_scenario(seed: int, *, rovers: bool, most_robots: int | None) -> Scenario:
    """Return carriers, some with a rover, on a map cut by one or two walls from side to side."""
    rng = random.Random(seed)
    width, height = rng.randint(6, 10), rng.randint(5, 8)
    rows = [[rng.choices("#.,", (15, 68, 17))[0] for _ in range(width)] for _ in range(height)]
    for row in rows:
        row[0] = row[-1] = "#"
    rows[0] = rows[-1] = ["#"] * width
    for x in rng.sample(range(2, width - 2), rng.choice((1, 1, 2))):
        for row in rows:
            row[x] = "#"
    grid = drawn_grid(*("".join(row) for row in rows))
    floor = [Cell(int(x), int(y)) for y, x in np.argwhere(grid.cells == FLOOR)]
    starts = rng.sample(floor, min(most_robots or 3, len(floor)))
    team = [TeamMember(name=f"c{i}", type="carrier", start=cell) for i, cell in enumerate(starts)]
    if rovers and seed % 2:
        team += [TeamMember(name=f"r{i}", type="rover", carrier=f"c{i}") for i in range(len(starts))]
    kinds = kinds_of(carrier_range_m=rng.choice((1.1, 1.1, 1.5)), rover_range_m=rng.choice((1.1, 1.5)))
    return Scenario(
        name="separate areas",
        grid=grid,
        robot_types=tuple(kinds.values()),
        team=tuple(team),
        goal=Goal(return_home=rng.random() < 0.3),
    )


@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize("name", [*STRATEGIES, CLAIRVOYANT])
def test_every_strategy_explores_separate_areas_with_short_sighted_robots(name: str, seed: int) -> None:
    most = frontier_rule(name).most_robots if name in RULES else None
    scenario = drawn_scenario(seed, rovers=name not in RULES, most_robots=most)
    kinds = {kind.name: kind for kind in scenario.robot_types}
    watcher = Watcher(scenario.grid, kinds, place_team(scenario, 1))
    simulate(scenario, strategy=name, planner="anytime", budget=Budget(steps=1), seed=1, observer=watcher)
    ended = watcher.events[-1]
    assert (ended.status, ended.coverage) == (Status.COMPLETE, 1.0), ended.reason
    # the clairvoyant may drive over unseen cells
    assert watcher.faults == [] or name == CLAIRVOYANT
