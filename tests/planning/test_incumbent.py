from dataclasses import replace

from support.planning.situations import one_hall, one_room

from marsupial.model import MAKESPAN, Plan, PricedArrival
from marsupial.planning.greedy import serve
from marsupial.planning.incumbent import Incumbent
from marsupial.planning.schedule.timeline import retime

GOOD, _ = serve(one_room())
LATE = Plan(actions=tuple(replace(action, start_ms=action.start_ms + 500) for action in GOOD.actions))
WRONG = Plan(actions=GOOD.actions[1:])


def test_plans_are_kept_that_are_valid_and_better_than_all_before() -> None:
    incumbent = Incumbent(one_room())
    assert [incumbent.take(plan) for plan in (LATE, LATE, GOOD, LATE)] == [True, False, True, False]
    assert (incumbent.plan, incumbent.value) == (GOOD, MAKESPAN.value(one_room(), GOOD))
    assert incumbent.refused == []


def test_refused_plans_are_recorded_and_not_kept() -> None:
    incumbent = Incumbent(one_room())
    assert not incumbent.take(WRONG)
    assert (incumbent.plan, incumbent.value) == (None, None)
    assert incumbent.refused == [incumbent.violation]
    assert incumbent.take(GOOD)
    assert incumbent.violation is None
    assert len(incumbent.refused) == 1


def orders() -> tuple[Plan, Plan]:
    """Return the plans that explore the two targets of `one_hall` in either order."""
    near_first, _ = serve(one_hall())
    actions, place = [], "c1_start"
    for target in ("t2", "t1"):
        actions.append(replace(near_first.actions[0], origin=place, place=target))
        place = target
    return near_first, retime(one_hall(), actions)


def test_which_plan_is_better_is_up_to_the_objective() -> None:
    near_first, far_first = orders()
    far_is_dear = PricedArrival(worth={"t1": 0.0, "t2": 1.0}, makespan=0.0, driving=0.0)
    for objective, better in ((MAKESPAN, near_first), (far_is_dear, far_first)):
        incumbent = Incumbent(one_hall(), objective)
        for plan in (far_first, near_first):
            incumbent.take(plan)
        assert incumbent.plan == better


def test_plans_for_some_targets_count_where_they_may_and_more_targets_are_better() -> None:
    whole, _ = serve(one_hall())
    part = retime(one_hall(), whole.actions[:1])
    assert not Incumbent(one_hall()).take(part)
    incumbent = Incumbent(one_hall(), partial=True)
    assert [incumbent.take(plan) for plan in (part, whole, part)] == [True, True, False]
