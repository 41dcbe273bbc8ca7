from dataclasses import replace

from support.planning.situations import one_room
from support.planning.spots import carrier, default_types, door, hall, room, rover, situation_of

from marsupial.model import (
    EPSILON_MS,
    ActionName,
    Budget,
    Improved,
    Outcome,
    Plan,
    PricedArrival,
    Situation,
    SituationGoal,
)
from marsupial.planning.checker import check
from marsupial.planning.greedy import serve
from marsupial.planning.local_search.engine import Anytime


def priced(makespan: float = 0.001, driving: float = 0.001, **worth: float) -> PricedArrival:
    return PricedArrival(worth=worth, makespan=makespan, driving=driving)


def test_the_value_is_the_sum_of_its_prices() -> None:
    plan, _ = serve(one_room())

    def value(objective: PricedArrival) -> float:
        (found,) = objective.value(one_room(), plan)
        return found

    assert value(priced(makespan=0, driving=0, t1=2.0)) == 2 * 19_003
    assert value(priced(makespan=0.5, driving=0, t1=0.0, t2=2.0)) == plan.makespan_ms
    assert value(priced(makespan=0, driving=1, t1=0.0)) == 10_000 + 4_000 + 2 * EPSILON_MS


def near_and_far() -> Situation:
    """Return: a carrier between a target 10 s to the left and one 11 s to the right."""
    return situation_of([carrier()], {"near": hall(-10), "far": hall(11)}, {}, {"c1_start": hall(0)})


def best(situation: Situation, by: PricedArrival) -> Plan:
    events = Anytime().solve(situation, Budget(steps=3), objective=by)
    plans = [event.plan for event in events if isinstance(event, Improved)]
    costs = [by.value(situation, plan) for plan in plans]
    assert costs == sorted(costs, reverse=True)
    assert check(situation, plans[-1]).valid
    return plans[-1]


def places(plan: Plan) -> list[str]:
    return [action.place for action in plan.actions]


def test_more_valuable_targets_are_reached_first_although_it_takes_longer() -> None:
    assert places(best(near_and_far(), priced(near=1.0, far=1.0))) == ["near", "far"]
    assert places(best(near_and_far(), priced(near=1.0, far=2.0))) == ["far", "near"]
    assert places(best(near_and_far(), priced(makespan=9.0, near=1.0, far=2.0))) == ["near", "far"]


def two_doors() -> Situation:
    """Return: one carrier with two rovers; one rover can explore both rooms, or two rovers one each and sooner."""
    team, targets = [carrier(), rover(1, on="c1"), rover(2, on="c1")], {"t1": room(20), "t2": room(30)}
    meetings, starts = {"m1": door(20), "m2": door(30)}, {"c1_start": hall(0)}
    return situation_of(team, targets, meetings, starts, types=default_types(capacity=2))


def set_down(plan: Plan) -> set[str]:
    return {action.robot for action in plan.actions if action.name is ActionName.UNDOCK}


def test_one_rover_drives_on_instead_of_a_second_if_both_must_be_retrieved() -> None:
    by = priced(makespan=3, driving=0.15, t1=1.0, t2=1.0)
    assert len(set_down(best(two_doors(), by))) == 2
    assert len(set_down(best(replace(two_doors(), goal=SituationGoal(recover_rovers=True)), by))) == 1


def test_the_same_steps_give_the_same_plan() -> None:
    by = priced(t1=1.0, t2=1.0)
    assert best(two_doors(), by) == best(two_doors(), by)


def test_nothing_is_proven() -> None:
    *_, last = Anytime().solve(near_and_far(), Budget(steps=1), objective=priced(near=1.0, far=1.0))
    assert not isinstance(last, Improved)
    assert (last.outcome, last.lower_bound_ms) == (Outcome.SATISFICING, None)


def test_a_budget_in_seconds_is_not_used_up_where_more_would_gain_next_to_nothing() -> None:
    steps = []

    def clock() -> float:
        steps.append(None)
        return 1e-4 * len(steps)

    engine, by = Anytime(clock), priced(near=1.0, far=1.0)
    *_, ended = engine.solve(near_and_far(), Budget(seconds=100.0), objective=by)
    assert ended.elapsed_s < 0.1
    *_, ended = engine.solve(near_and_far(), Budget(seconds=0.001), objective=by)
    assert ended.elapsed_s < 0.002
