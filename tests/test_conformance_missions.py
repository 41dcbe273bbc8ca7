"""What every strategy and every built-in scenario has to hold; a new one is tested as soon as it is listed."""

from __future__ import annotations

import pytest

from marsupial.formats.missionlog import encode_event
from marsupial.generators.builtin import SCENARIOS, builtin_scenario
from marsupial.library.metrics import Summary
from marsupial.library.missions import DEFAULT_PLANNER, simulate
from marsupial.mission.observer import Observer
from marsupial.model.mission import MissionEvent, Status
from marsupial.model.planning import Budget
from marsupial.model.robots import Role
from marsupial.strategies.registry import STRATEGIES


class Recorder(Observer):
    def __init__(self) -> None:
        self.lines: list[str] = []

    def event(self, event: MissionEvent) -> None:
        self.lines.append(encode_event(event))


PLANNERS = ("greedy", DEFAULT_PLANNER)


def explore(scenario: str, strategy: str, seed: int = 1, planner: str = "greedy") -> tuple[Summary, list[str]]:
    recorder = Recorder()
    summary = simulate(
        builtin_scenario(scenario),
        strategy=strategy,
        planner=planner,
        budget=Budget(steps=1),
        seed=seed,
        observer=recorder,
    )
    return summary, recorder.lines


@pytest.mark.parametrize("seed", [1, 2, 3])
@pytest.mark.parametrize("planner", PLANNERS)
@pytest.mark.parametrize("strategy", STRATEGIES)
def test_every_strategy_explores_the_lobby_and_recovers_its_rovers(strategy: str, planner: str, seed: int) -> None:
    summary, _ = explore("lobby", strategy, seed, planner)
    assert (summary.status, summary.coverage, summary.plans_invalid) == (Status.COMPLETE, 1.0, 0), summary.reason
    assert len(summary.aboard) == summary.robots - summary.carriers == 4
    assert summary.deployments == summary.retrievals > 0


@pytest.mark.parametrize("planner", PLANNERS)
@pytest.mark.parametrize("strategy", STRATEGIES)
def test_every_strategy_does_the_same_again(strategy: str, planner: str) -> None:
    assert explore("lobby", strategy, planner=planner)[1] == explore("lobby", strategy, planner=planner)[1]


@pytest.mark.parametrize("planner", PLANNERS)
@pytest.mark.parametrize("name", SCENARIOS)
def test_every_built_in_scenario_can_be_explored(name: str, planner: str) -> None:
    summary, _ = explore(name, "temporal", planner=planner)
    assert (summary.status, summary.coverage) == (Status.COMPLETE, 1.0), summary.reason


@pytest.mark.parametrize("name", SCENARIOS)
def test_every_built_in_scenario_has_carriers_that_hold_its_rovers(name: str) -> None:
    scenario = builtin_scenario(name, 1, 3)
    capacities = [kind.capacity for kind in scenario.robot_types if kind.role is Role.CARRIER]
    assert min(capacities) >= 3
