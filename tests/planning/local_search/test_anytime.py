from collections.abc import Iterator
from dataclasses import replace
from itertools import count, pairwise

import pytest
from hypothesis import given
from support.planning.drawn_situations import situations, with_closed_roads
from support.planning.situations import SOLVABLE, many_rooms, one_hall, one_room, two_rooms
from support.planning.spots import carrier, hall, situation_of

from marsupial.bench.suite.catalogue import INSTANCES
from marsupial.model.objective import MAKESPAN, PricedArrival
from marsupial.model.plan import Plan
from marsupial.model.planning import Budget, Engine, Finished, Improved, Outcome
from marsupial.model.robots import Role
from marsupial.model.situation import Situation, SituationGoal
from marsupial.planning.checker import check
from marsupial.planning.greedy import ROUNDS, Greedy
from marsupial.planning.local_search.engine import Anytime
from marsupial.planning.schedule.timeline import Timeline

FEW = Budget(steps=20)


def solve(
    situation: Situation, budget: Budget = FEW, start: Plan | None = None, engine: Engine | None = None
) -> tuple[list[Plan], Finished]:
    *improved, finished = (engine or Anytime()).solve(situation, budget, start=start)
    assert isinstance(finished, Finished)
    return [event.plan for event in improved if isinstance(event, Improved)], finished


def listed(situation: Situation) -> list[Plan]:
    return solve(situation, Budget(steps=ROUNDS), engine=Greedy())[0]


def ticking() -> Iterator[float]:
    return (i / 100 for i in count())


@pytest.mark.parametrize("name", SOLVABLE)
def test_every_hand_made_situation_is_solved_no_worse_than_by_list_scheduling(name: str) -> None:
    situation = SOLVABLE[name]()
    plans, finished = solve(situation)
    assert finished.outcome in (Outcome.SATISFICING, Outcome.OPTIMAL)
    assert all(check(situation, plan).valid for plan in plans)
    assert plans[-1].makespan_ms <= listed(situation)[-1].makespan_ms


def test_a_makespan_no_plan_can_beat_is_called_optimal_and_the_search_ends_early() -> None:
    _, finished = solve(one_room(), Budget(steps=10**9))
    assert finished.outcome is Outcome.OPTIMAL
    assert finished.lower_bound_ms == 19_002
    assert "makespan is optimal" in finished.detail


def test_the_way_home_counts_in_the_bound() -> None:
    plans, finished = solve(one_room(goal=SituationGoal(recover_rovers=True, return_home=True)))
    assert finished.outcome is Outcome.OPTIMAL
    assert finished.lower_bound_ms == plans[-1].makespan_ms


@pytest.mark.parametrize("name", ["mission-rooms-1x1-11", "two-doors-2x1-6", "pressure-2x2-8"])
def test_more_steps_never_give_a_worse_plan(name: str) -> None:
    situation = INSTANCES[name].situation()
    values = [MAKESPAN.value(situation, solve(situation, Budget(steps=n))[0][-1]) for n in (1, 5, 8, 16, 20, 30, 40)]
    assert values == sorted(values, reverse=True)


def test_more_steps_never_give_a_plan_of_later_arrivals() -> None:
    situation = INSTANCES["mission-cave-2x2-42"].situation()
    worth = {target.name: 1.0 for target in situation.targets}
    objective = PricedArrival(worth=worth, makespan=0.3, driving=0.15)
    start, values = listed(situation)[-1], []
    for steps in (4, 8, 20, 40):
        events = Anytime().solve(situation, Budget(steps=steps), objective=objective, start=start)
        values.append(objective.value(situation, [e.plan for e in events if isinstance(e, Improved)][-1]))
    assert values == sorted(values, reverse=True)


@pytest.mark.parametrize("driving", [0.0, 0.15])
def test_without_targets_rovers_are_fetched_by_priced_arrival_too(driving: float) -> None:
    situation = INSTANCES["mission-office-6x3-0"].situation()
    assert not situation.targets
    objective = PricedArrival(worth={}, makespan=0.3, driving=driving)
    events = Anytime().solve(situation, Budget(steps=8), objective=objective)
    plans = [event.plan for event in events if isinstance(event, Improved)]
    values = [objective.value(situation, plan) for plan in plans]
    assert values == sorted(values, reverse=True)
    assert check(situation, plans[-1]).valid


@pytest.mark.parametrize("seed", [1, 2])
@pytest.mark.parametrize(
    ("size", "recover", "share"),
    [((2, 2, 8, 4), False, 0.95), ((6, 3, 20, 8), False, 0.95), ((2, 2, 12, 11), True, 0.85)],
)
def test_plans_get_clearly_shorter_than_the_first_and_much_shorter_where_rovers_have_to_be_used_again(
    size: tuple[int, int, int, int], recover: bool, share: float, seed: int
) -> None:
    situation = many_rooms(*size, seed=seed)
    situation = replace(situation, goal=SituationGoal(recover_rovers=True)) if recover else situation
    plans, _ = solve(situation, Budget(steps=60))
    assert check(situation, plans[-1]).valid
    assert plans[-1].makespan_ms <= share * plans[0].makespan_ms


def test_the_biggest_teams_get_valid_plans() -> None:
    situation = many_rooms(34, 3, 150, 60)
    plans, finished = solve(situation, Budget(steps=5))
    assert all(check(situation, plan).valid for plan in plans)
    assert finished.lower_bound_ms is not None
    assert finished.lower_bound_ms <= plans[-1].makespan_ms


def test_targets_that_reveal_more_are_reached_first_if_the_makespan_stays() -> None:
    team, starts = [carrier(1), carrier(2)], {"c1_start": hall(0), "c2_start": hall(0)}
    situation = situation_of(team, {"far": hall(100), "left": hall(-10), "right": hall(10)}, {}, starts)
    for rich in ("left", "right"):
        targets = tuple(replace(t, reveal_m2=50.0 if t.name == rich else 1.0) for t in situation.targets)
        plan = solve(replace(situation, targets=targets))[0][-1]
        assert plan.makespan_ms == 100_000
        assert min(plan.actions, key=lambda action: action.end_ms).place == rich


def test_a_valid_start_comes_first_and_is_never_made_worse() -> None:
    situation = many_rooms(2, 2, 8, 4, seed=2)
    start = solve(situation, Budget(steps=40))[0][-1]
    plans, _ = solve(situation, Budget(steps=3), start)
    assert plans[0] == start
    assert plans[-1].makespan_ms <= start.makespan_ms


def test_a_start_that_does_not_fit_the_situation_is_passed_over() -> None:
    start = listed(two_rooms())[0]
    plans, _ = solve(one_room(), start=start)
    assert start not in plans
    assert check(one_room(), plans[0]).valid


def test_a_start_with_idle_time_is_tightened() -> None:
    tight = listed(one_room())[0]
    late = Plan.of(replace(action, start_ms=action.start_ms + 5_000) for action in tight.actions)
    plans, _ = solve(one_room(), start=late)
    assert plans[0] == late
    assert plans[-1].makespan_ms == tight.makespan_ms


def test_a_start_that_explores_a_target_twice_is_improved() -> None:
    team = [carrier(1), carrier(2)]
    situation = situation_of(team, {"t1": hall(-10), "t2": hall(10)}, {}, {"c1_start": hall(0), "c2_start": hall(0)})
    timeline = Timeline.of(situation)
    for robot, target in (("c1", "t1"), ("c1", "t2"), ("c2", "t2"), ("c2", "t1")):
        timeline.explore(robot, target)
    plans, _ = solve(situation, start=timeline.plan)
    assert plans[0] == timeline.plan
    assert plans[-1].makespan_ms < plans[0].makespan_ms


def test_a_team_without_rovers_shares_the_targets() -> None:
    targets = {f"t{i}": hall(10 * i) for i in (-3, -2, 2, 3)}
    situation = situation_of([carrier(1), carrier(2)], targets, {}, {"c1_start": hall(0), "c2_start": hall(0)})
    assert solve(situation)[0][-1].makespan_ms == 30_001


def test_where_nothing_is_to_do_the_empty_plan_is_optimal() -> None:
    for situation in (situation_of([], {}, {}, {}), one_hall().restricted(targets=frozenset())):
        (plan,), finished = solve(situation)
        assert plan.actions == ()
        assert finished.outcome is Outcome.OPTIMAL


def test_the_budget_in_seconds_is_kept_by_the_clock_given() -> None:
    ticks = ticking()
    situation = many_rooms(2, 2, 8, 4, seed=1)
    _, finished = solve(situation, Budget(seconds=0.5), engine=Anytime(lambda: next(ticks)))
    assert 0.5 <= finished.elapsed_s < 0.6


def test_plans_are_not_yielded_too_often() -> None:
    events = list(Anytime().solve(many_rooms(6, 3, 20, 8), Budget(steps=30)))
    plans = [event.plan for event in events if isinstance(event, Improved)]
    slight = [one for one, other in pairwise(plans) if other.makespan_ms >= 0.99 * one.makespan_ms]
    assert len(slight) <= 4


def test_a_search_that_converges_yields_its_first_plan_and_its_best() -> None:
    situation = many_rooms(6, 3, 20, 8)
    objective = PricedArrival(worth={target.name: 1.0 for target in situation.targets}, makespan=0.3, driving=0.15)
    ticks = (i / 1000 for i in count())  # seconds; a mission's plans take about as many readings of the clock
    engine, start = Anytime(lambda: next(ticks)), listed(situation)[0]
    found = list(engine.solve(situation, Budget(seconds=20), objective=objective, start=start))
    values = [objective.value(situation, event.plan) for event in found if isinstance(event, Improved)]
    assert len(values) == 3  # the start is the first
    assert values == sorted(values, reverse=True)


@given(situations())
def test_every_plan_passes_the_checker_and_keeps_the_bound(situation: Situation) -> None:
    plans, finished = solve(situation, Budget(steps=2))
    for plan in plans:
        assert check(situation, plan).valid, check(situation, plan).violation
    assert (finished.outcome is Outcome.UNSOLVABLE) == (not plans), finished.detail
    if plans:
        assert finished.lower_bound_ms is not None
        assert finished.lower_bound_ms <= plans[-1].makespan_ms
        assert plans[-1].makespan_ms <= listed(situation)[0].makespan_ms
        assert (finished.lower_bound_ms == plans[-1].makespan_ms) == (finished.outcome is Outcome.OPTIMAL)


@given(with_closed_roads())
def test_one_way_roads_make_no_invalid_plans(situation: Situation) -> None:
    plans, finished = solve(situation, Budget(steps=2))
    assert all(check(situation, plan).valid for plan in plans)
    assert (finished.outcome in (Outcome.SATISFICING, Outcome.OPTIMAL)) == bool(plans)
    if plans:
        assert (finished.lower_bound_ms or 0) <= plans[-1].makespan_ms


@given(situations(goals=False))
def test_teams_without_rovers_are_searched(situation: Situation) -> None:
    """A team of carriers alone never crashes the search, however reduced the situation is."""
    alone = frozenset(robot.name for robot in situation.of_role(Role.CARRIER))
    kept = situation.restricted(robots=alone)
    assert all(check(kept, plan).valid for plan in solve(kept, Budget(steps=1))[0])
