import pytest
from support.missions.small_missions import run
from support.missions.small_teams import carrier_at, drawn_grid, kinds_of

from marsupial.generators.builtin import builtin_scenario
from marsupial.library.metrics import Summary
from marsupial.library.missions import simulate
from marsupial.model import Budget, Scenario, Status
from marsupial.papers.alkhawaldah.experiment import cell_world
from marsupial.strategies.registry import strategy


def explored(scenario: Scenario, name: str, seed: int = 1) -> Summary:
    summary = simulate(scenario, strategy=name, planner="anytime", budget=Budget(steps=2), seed=seed)
    assert (summary.status, summary.coverage, summary.plans_invalid) == (Status.COMPLETE, 1.0, 0), summary.reason
    return summary


@pytest.mark.parametrize(("obstacles", "most"), [(0, 58), (12, 72)])
def test_two_robots_see_hardly_anything_twice(obstacles: int, most: float) -> None:
    summary = explored(cell_world("cells", 18, 18, obstacles, 2), "covering/rounds=1")
    assert summary.exploration_time_s is not None
    assert summary.exploration_time_s <= most  # 54 steps at three new cells each


def test_temporal_planning_covers_ground_that_robots_see_no_farther_than_the_next_cells_of() -> None:
    scenario = cell_world("cells", 12, 12, 6, 2)
    ways = explored(scenario, "covering/rounds=1")
    assert explored(scenario, "temporal").exploration_time_s == ways.exploration_time_s
    assert explored(scenario, "temporal").planner == "anytime"


@pytest.mark.parametrize("effort", ["rounds=0", "seconds=0", "rounds=2/seconds=0"])
def test_ways_that_are_not_improved_at_all_still_see_everything(effort: str) -> None:
    assert explored(cell_world("cells", 8, 8, 4, 2), f"covering/{effort}").coverage == 1.0


@pytest.mark.parametrize("name", ["temporal", "covering"])
def test_robots_that_see_one_cell_far_explore_two_areas_with_a_wall_between(name: str) -> None:
    grid = drawn_grid("#######", "#...#.#", "#...#.#", "#######")
    leader = strategy(name, planner="anytime", budget=Budget(steps=1))
    ended, _ = run(grid, [carrier_at(1, 1, 1), carrier_at(5, 1, 2)], leader, kinds=kinds_of(carrier_range_m=1.1))
    assert (ended.status, ended.coverage) == (Status.COMPLETE, 1.0)


def test_robots_that_see_farther_are_sent_to_frontiers() -> None:
    scenario = builtin_scenario("lobby", 2, 0)
    ways = explored(scenario, "covering/rounds=1")
    assert explored(scenario, "temporal").exploration_time_s != ways.exploration_time_s
