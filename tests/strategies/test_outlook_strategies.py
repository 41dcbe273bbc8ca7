"""Common rules of `heuristic-plus` and `assignment`: exploration times of targets, and standing by.

Positions are in seconds at the carriers' speed; rovers take twice as long.
"""

from collections.abc import Mapping
from dataclasses import replace

import pytest
from hypothesis import given
from strategy_briefings import assert_possible, brief, briefings, robot_by_robot, torn_briefings
from support.planning.situations import relay
from support.planning.spots import carrier, door, hall, room, rover, situation_of

from marsupial.generators.builtin import builtin_scenario
from marsupial.library.missions import simulate
from marsupial.model import Briefing, Budget, Plan, Situation, Status, Strategy
from marsupial.planning.greedy import serve
from marsupial.planning.schedule.timeline import retime
from marsupial.strategies.heuristic_plus import HeuristicPlus
from marsupial.strategies.one_step import OneStep

pytestmark = pytest.mark.parametrize("strategy", [HeuristicPlus(), OneStep()], ids=lambda strategy: strategy.name)


def decide(
    strategy: Strategy, situation: Situation, previous: Plan | None = None, deployed_at: Mapping[str, str] | None = None
) -> list[str]:
    return robot_by_robot(strategy, brief(situation, previous=previous, deployed_at=deployed_at))


@pytest.mark.parametrize(("far", "explorer"), [(18, "c1"), (20, "r1")])
def test_undocking_and_the_rovers_drive_count(strategy: Strategy, far: int, explorer: str) -> None:
    # the rover would be at its target after 10 + 5 + 4 seconds
    situation = situation_of(
        [carrier(), rover(on="c1")], {"in": room(12), "out": hall(far)}, {"m1": door(10)}, {"c1_start": hall(0)}
    )
    explorers = [action.split()[1] for action in decide(strategy, situation) if action.startswith("(explore")]
    assert explorers == [explorer]


def test_a_rover_is_set_down_where_it_gets_to_the_target_soonest_not_at_the_nearest_meeting(strategy: Strategy) -> None:
    situation = situation_of(
        [carrier(), rover(on="c1")], {"t1": room(20)}, {"near": door(5), "far": door(19)}, {"c1_start": hall(0)}
    )
    then = {"heuristic-plus": ["(move r1 t1 far)"], "assignment": []}[strategy.name]
    assert decide(strategy, situation) == [
        "(move c1 c1_start far)", "(undock r1 c1 far)", "(explore r1 far t1)", *then
    ]  # fmt: skip


def test_a_target_that_takes_two_rides_is_explored_when_there_is_no_other(strategy: Strategy) -> None:
    assert decide(strategy, relay())[-1] == "(explore r1 m3 t1)"


@pytest.mark.parametrize("target", ["t1", "t2"])
def test_between_equals_a_robot_keeps_its_target(strategy: Strategy, target: str) -> None:
    situation = situation_of([carrier()], {"t1": hall(10), "t2": hall(-10)}, {}, {"c1_start": hall(0)})
    whole, _ = serve(situation)
    previous = retime(situation, [replace(whole.actions[0], origin="c1_start", place=target)])
    assert decide(strategy, situation, previous) == [f"(explore c1 c1_start {target})"]


def test_a_carrier_without_a_target_goes_where_another_explores(strategy: Strategy) -> None:
    situation = situation_of(
        [carrier(1), carrier(2)], {"t1": hall(30)}, {}, {"c1_start": hall(0), "c2_start": hall(10)}
    )
    assert decide(strategy, situation) == ["(explore c1 c1_start t1)", "(explore c2 c2_start t1)"]


def test_a_carrier_without_a_target_waits_where_it_would_set_its_rover_down(strategy: Strategy) -> None:
    team = [carrier(1), carrier(2), rover(1, "c1"), rover(2, "c2")]
    situation = situation_of(team, {"t1": room(32)}, {"m1": door(30)}, {"c1_start": hall(0), "c2_start": hall(10)})
    then = {"heuristic-plus": ["(move r2 t1 m1)"], "assignment": []}[strategy.name]
    assert decide(strategy, situation) == [
        "(move c1 c1_start m1)", "(move c2 c2_start m1)", "(undock r2 c2 m1)", "(explore r2 m1 t1)", *then
    ]  # fmt: skip


@pytest.mark.parametrize("set_down", [{}, {"r1": "m1"}])
def test_a_rover_without_a_target_waits_at_the_nearest_meeting_not_where_it_was_set_down(
    strategy: Strategy, set_down: Mapping[str, str]
) -> None:
    team, targets, meetings = [carrier(), rover()], {"t1": hall(30)}, {"m1": door(10), "m2": door(2)}
    situation = situation_of(team, targets, meetings, {"c1_start": hall(20), "r1_start": room(5)})
    assert decide(strategy, situation, deployed_at=set_down) == ["(explore c1 c1_start t1)", "(move r1 r1_start m2)"]
    there = situation_of(team, targets, {"m1": door(10)}, {"c1_start": hall(20), "r1_start": room(10)})
    assert decide(strategy, there, deployed_at=set_down) == ["(explore c1 c1_start t1)"]


@given(briefings() | torn_briefings())
def test_every_plan_can_be_carried_out_even_where_ways_lead_in_one_direction_only(
    strategy: Strategy, briefing: Briefing
) -> None:
    assert_possible(briefing.situation, strategy.decide(briefing).plan)


@given(briefings())
def test_something_is_explored_whenever_a_planner_could(strategy: Strategy, briefing: Briefing) -> None:
    plan = strategy.decide(briefing).plan
    assert bool(plan.explored) == bool(serve(briefing.situation)[0].explored)


@pytest.mark.parametrize("seed", [1, 2])
def test_a_mission_where_rovers_can_drive_everywhere_completes(strategy: Strategy, seed: int) -> None:
    ended = simulate(
        builtin_scenario("rooms"), strategy=strategy.name, planner="greedy", budget=Budget(steps=1), seed=seed
    )
    assert (ended.status, ended.coverage, ended.plans_invalid) == (Status.COMPLETE, 1.0, 0), ended.reason
