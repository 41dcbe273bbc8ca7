"""The method of the paper: the shortest plan for the known targets."""

from dataclasses import replace

import pytest
from support.planning.fake_engines import FakeEngine, WithPrices, brief, found, in_order
from support.planning.situations import one_hall, out_of_reach, two_rooms
from support.planning.spots import carrier, hall, situation_of

from marsupial.model.objective import ObjectiveName
from marsupial.model.plan import Plan
from marsupial.model.planning import Budget, Finished, Outcome
from marsupial.model.situation import Situation
from marsupial.model.strategy import Square, Unseen
from marsupial.papers.wurm2010.strategy import ShortestPlan
from marsupial.planning.greedy import serve
from marsupial.planning.local_search.engine import Anytime

BUDGET = Budget(steps=7)


def equals() -> tuple[Situation, Plan, Plan]:
    """Return a carrier between two targets equally far, and both orders to explore them."""
    situation = situation_of([carrier()], {"t1": hall(-10), "t2": hall(10)}, {}, {"c1_start": hall(0)})
    return situation, in_order(situation, "t1", "t2"), in_order(situation, "t2", "t1")


@pytest.mark.parametrize("kind", [FakeEngine, WithPrices])
def test_the_makespan_is_asked_of_every_engine_for_the_known_targets(kind: type[FakeEngine]) -> None:
    engine, situation = kind(*found()), one_hall()
    squares = (Square(name="beyond", x_m=10.0, y_m=9.0, share=1.0, draw=0.9),)
    unseen = Unseen(squares=squares, at_m={"t1": (10.0, 0.0)}, speed_mps={"carrier": 1.0})
    ShortestPlan(engine, BUDGET).decide(replace(brief(situation), unseen=lambda: unseen))
    assert engine.asked == [(situation, BUDGET, None)]
    assert engine.objectives == [ObjectiveName.MAKESPAN]


def test_the_shortest_plan_is_followed_though_many_targets_wait() -> None:
    three = {"t1": hall(10), "t2": hall(12), "t3": hall(14), "far": hall(-9)}
    situation = situation_of([carrier()], three, {}, {"c1_start": hall(0)})
    long, short = in_order(situation, "t1", "t2", "t3", "far"), in_order(situation, "far", "t1", "t2", "t3")
    engine = WithPrices(*found(short, long))
    assert ShortestPlan(engine, BUDGET).decide(brief(situation, long)).plan == short


def test_no_other_plan_is_weighed_against_the_planners() -> None:
    situation = one_hall()
    slow = in_order(situation, "t2", "t1")
    assert serve(situation)[0].makespan_ms < slow.makespan_ms
    assert ShortestPlan(FakeEngine(*found(slow)), BUDGET).decide(brief(situation)).plan == slow


def test_the_previous_plan_is_kept_if_it_is_as_short() -> None:
    situation, one, other = equals()
    engine = FakeEngine(*found(other))
    assert ShortestPlan(engine, BUDGET).decide(brief(situation, one)).plan == one
    assert [start for _, _, start in engine.asked] == [one]


def test_new_targets_are_added_to_the_previous_plan_which_gives_way_to_a_shorter_one() -> None:
    situation = one_hall()
    slow, fast = in_order(situation, "t2", "t1"), in_order(situation, "t1", "t2")
    engine = FakeEngine(*found(fast))
    assert ShortestPlan(engine, BUDGET).decide(brief(situation, in_order(situation, "t2"))).plan == fast
    assert [start for _, _, start in engine.asked] == [slow]


def test_targets_that_no_robot_can_serve_are_left_out_of_the_problem() -> None:
    decision = ShortestPlan(Anytime(), Budget(steps=1)).decide(brief(out_of_reach()))
    assert [action.place for action in decision.plan.actions] == ["t1"]
    assert decision.report.detail == "; nobody can serve t2"


@pytest.mark.parametrize("outcome", [Outcome.TIMEOUT, Outcome.CRASHED])
def test_without_an_answer_the_previous_plan_is_completed(outcome: Outcome) -> None:
    situation = two_rooms()
    silent = FakeEngine(Finished(outcome=outcome))
    decision = ShortestPlan(silent, BUDGET).decide(brief(situation))
    assert decision.plan == serve(situation)[0]
    assert decision.report.outcome is outcome
    assert decision.report.detail == f"fake: {outcome}"


def test_a_plan_for_a_part_of_the_targets_is_completed() -> None:
    situation, _, other = equals()
    part = Plan(actions=other.actions[:1])
    assert ShortestPlan(FakeEngine(*found(part)), BUDGET).decide(brief(situation)).plan == other
