from dataclasses import replace

import numpy as np
import pytest
from support.missions.small_missions import Recorder
from support.missions.small_teams import drawn_grid

from marsupial.errors import ScenarioError, UsageError
from marsupial.generators.builtin import explorers
from marsupial.library.missions import simulate
from marsupial.model import Budget, Cause, Planned, PlanningTime, Role, Status
from marsupial.papers.alkhawaldah.experiment import HOPPER, cell_world
from marsupial.papers.alkhawaldah.rule import Bidding
from marsupial.papers.wurm2008.rules import ClosestFrontier
from marsupial.strategies.frontier.exploration import FrontierStrategy
from marsupial.strategies.frontier.rule import with_parameters
from marsupial.strategies.registry import check_suits, is_strategy, strategy


def explore(name: str, seed: int = 1) -> list[Planned]:
    watcher = Recorder()
    scenario = cell_world("cells", 9, 9, 4, 2)
    ended = simulate(scenario, strategy=name, planner="none", budget=Budget(steps=1), seed=seed, observer=watcher)
    assert (ended.status, ended.coverage) == (Status.COMPLETE, 1.0)
    return watcher.of(Planned)


def test_robots_that_decide_at_every_cell_never_drive_further_than_one() -> None:
    made = explore("bidding")
    assert {action.duration_ms for plan in made for action in plan.actions} == {1000}


def test_others_drive_on_until_they_arrive_or_their_cell_has_been_seen_through() -> None:
    made = explore("closest-frontier")
    assert max(action.duration_ms for plan in made for action in plan.actions) > 1000
    causes = {trigger.cause for plan in made for trigger in plan.trigger}
    assert causes <= {Cause.START, Cause.ROBOT_FREE, Cause.GONE, Cause.CARRIED_OUT, Cause.EXPLORED}


def test_a_step_taken_by_lot_is_still_the_same_when_the_time_for_planning_has_passed() -> None:
    for seed in range(1, 7):
        watcher = Recorder()
        scenario = replace(cell_world("cells", 10, 9, 6, 1), planning_time=PlanningTime.CHARGED)
        simulate(scenario, strategy="bidding", planner="none", budget=Budget(steps=1), seed=seed, observer=watcher)
        causes = {trigger.cause for plan in watcher.of(Planned) for trigger in plan.trigger}
        assert Cause.OVERTAKEN not in causes


def test_robots_get_different_frontiers_if_there_are_enough() -> None:
    scenario = explorers("hall", drawn_grid("...........", "...........", "..........."), HOPPER, 2)
    watcher = Recorder()
    simulate(scenario, strategy="closest-frontier", planner="none", budget=Budget(steps=1), seed=3, observer=watcher)
    actions = watcher.of(Planned)[0].actions
    assert len({action.place for action in actions}) == len(actions)


def test_the_time_of_the_rule_counts_as_planning() -> None:
    scenario = cell_world("cells", 12, 12, 4, 2)
    summary = simulate(scenario, strategy="covering", planner="none", budget=Budget(steps=1), seed=1)
    assert summary.planning_s.total > 0.2 * summary.wall_s


def test_teams_that_a_strategy_can_t_lead_are_refused() -> None:
    leader = FrontierStrategy(ClosestFrontier())
    check_suits(leader, [Role.CARRIER] * 5)
    with pytest.raises(ScenarioError, match="is for teams without rovers, this one has 2"):
        check_suits(leader, [Role.CARRIER, Role.ROVER, Role.ROVER])


def test_parameters_follow_the_name() -> None:
    assert with_parameters(Bidding, "bidding/W_n=1/W_p=0.5") == Bidding(W_n=1.0, W_p=0.5, W_c=1.0)
    assert strategy("bidding/W_c=3", planner="none", budget=Budget(steps=1)).name == "bidding/W_c=3"
    assert is_strategy("bidding/W_c=3")
    assert not is_strategy("bidder/W_c=3")


@pytest.mark.parametrize("text", ["", "W_x=1", "W_n", "W_n=", "W_n=nan", "W_n=inf", "W_n=-1", "W_n=1/W_n=2"])
def test_parameters_that_make_no_sense_are_refused(text: str) -> None:
    with pytest.raises(UsageError, match="strategy bidding"):
        with_parameters(Bidding, f"bidding/{text}")
    with pytest.raises(UsageError, match="takes no parameters"):
        with_parameters(ClosestFrontier, "closest-frontier/far=1")


def test_starts_decide_what_is_drawn_by_lot() -> None:
    first, second, other = (explore("bidding", seed) for seed in (1, 1, 2))
    assert first == second
    assert not np.array_equal(first[0].actions, other[0].actions)
