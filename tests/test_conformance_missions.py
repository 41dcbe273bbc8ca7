"""Conformance of every strategy and built-in scenario; a new one is tested as soon as it is listed."""

from functools import cache

import pytest
from support.missions.reference_missions import LogLines

from marsupial.errors import ScenarioError
from marsupial.generators.builtin import DEFAULT_CARRIERS, DEFAULT_ROVERS, SCENARIOS, builtin_scenario
from marsupial.library.choices import DEFAULT_PLANNER
from marsupial.library.metrics import Summary
from marsupial.library.missions import simulate
from marsupial.model import Budget, Status
from marsupial.strategies.registry import RULES, STRATEGIES, asks_planner, frontier_rule

PLANNERS = ("greedy", DEFAULT_PLANNER)
EVERYBODY = [(name, planner) for name in STRATEGIES for planner in (PLANNERS if asks_planner(name) else PLANNERS[:1])]
CONTENDERS = [(name, planner) for name, planner in EVERYBODY if name not in RULES]


def explore_anew(
    scenario: str,
    strategy: str,
    planner: str = "greedy",
    seed: int = 1,
    *,
    carriers: int = DEFAULT_CARRIERS,
    rovers: int = DEFAULT_ROVERS,
) -> tuple[Summary, list[str]]:
    recorder = LogLines()
    summary = simulate(
        builtin_scenario(scenario, carriers, rovers),
        strategy=strategy,
        planner=planner,
        budget=Budget(steps=1),
        seed=seed,
        observer=recorder,
    )
    return summary, recorder.lines


explore = cache(explore_anew)


@pytest.mark.parametrize("seed", [1, 2, 3])
@pytest.mark.parametrize(("strategy", "planner"), CONTENDERS)
def test_every_strategy_explores_the_lobby_and_recovers_its_rovers(strategy: str, planner: str, seed: int) -> None:
    summary, _ = explore("lobby", strategy, planner, seed)
    assert (summary.status, summary.coverage, summary.plans_invalid) == (Status.COMPLETE, 1.0, 0), summary.reason
    assert len(summary.aboard) == summary.robots - summary.carriers == 4
    assert summary.deployments == summary.retrievals > 0


@pytest.mark.parametrize(("strategy", "planner"), CONTENDERS)
def test_every_strategy_does_the_same_again(strategy: str, planner: str) -> None:
    assert explore("lobby", strategy, planner, 1)[1] == explore_anew("lobby", strategy, planner, 1)[1]


@pytest.mark.parametrize(("strategy", "planner"), EVERYBODY)
def test_every_strategy_explores_without_rovers_and_does_the_same_again(strategy: str, planner: str) -> None:
    carriers = 1 if strategy in RULES and frontier_rule(strategy).most_robots == 1 else 3
    summary, lines = explore("lobby", strategy, planner, carriers=carriers, rovers=0)
    assert (summary.status, summary.coverage, summary.plans_invalid) == (Status.COMPLETE, 1.0, 0), summary.reason
    assert lines == explore_anew("lobby", strategy, planner, carriers=carriers, rovers=0)[1]


@pytest.mark.parametrize("strategy", RULES)
def test_strategies_of_frontiers_refuse_teams_they_are_not_made_for(strategy: str) -> None:
    with pytest.raises(ScenarioError, match=f"{strategy} is for teams without rovers, this one has 4"):
        explore("lobby", strategy)
    most = frontier_rule(strategy).most_robots
    if most is not None:
        with pytest.raises(ScenarioError, match=f"{strategy} leads {most} at most, the team has {most + 1} robots"):
            explore("lobby", strategy, carriers=most + 1, rovers=0)


@pytest.mark.parametrize("name", SCENARIOS)
def test_every_built_in_scenario_can_be_explored(name: str) -> None:
    summary, _ = explore(name, "heuristic")
    assert (summary.status, summary.coverage) == (Status.COMPLETE, 1.0), summary.reason
