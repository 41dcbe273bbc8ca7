"""The lower bound from the workload: checked by hand, and never above the makespan of a plan."""

from dataclasses import replace

import pytest
from hypothesis import given
from support.planning.drawn_situations import situations
from support.planning.situations import many_rooms, one_hall, two_rooms
from support.planning.spots import carrier, door, hall, room, rover, situation_of

from marsupial.model import EPSILON_MS, Budget, Improved, Outcome, Situation, SituationGoal
from marsupial.planning.local_search.encoding import encode
from marsupial.planning.local_search.engine import Anytime
from marsupial.planning.local_search.workload import work_bound_ms

RECOVER = SituationGoal(recover_rovers=True)


def bound_ms(situation: Situation) -> int:
    return work_bound_ms(encode(situation)) - EPSILON_MS


def three_rooms(*, carriers: int = 1) -> Situation:
    """Return: rooms at 10, 20 and 30 s with a target 2 s behind each door, a rover aboard each carrier at 0."""
    return situation_of(
        [carrier(i + 1) for i in range(carriers)] + [rover(i + 1, f"c{i + 1}") for i in range(carriers)],
        {f"t{i}": room(10 * i + 2, i) for i in (1, 2, 3)},
        {f"m{i}": door(10 * i, i) for i in (1, 2, 3)},
        {f"c{i + 1}_start": hall(0) for i in range(carriers)},
        goal=RECOVER,
    )


def test_one_rover_for_two_rooms_is_set_down_picked_up_carried_and_set_down() -> None:
    """10 and 20 s from the start; two undockings of 5 s, 4 s in, 4 s out, a docking of 10 s; 1 ms after each of seven.

    The bound ignores that the way between the rooms takes 30 s: it only connects both with the start.
    """
    assert bound_ms(two_rooms()) == 62_007


def test_a_room_waits_for_its_rover_or_is_visited_again() -> None:
    """30 s of driving, three times 5 + 4 + 4 + 10 s: the carrier waits for the rover, as driving on has no benefit."""
    assert 99_000 <= bound_ms(three_rooms()) <= 99_020


def test_work_is_shared_among_robots() -> None:
    assert bound_ms(three_rooms(carriers=3)) == pytest.approx(bound_ms(three_rooms()) / 3, abs=10)


def test_robots_that_are_busy_take_their_share_later() -> None:
    situation = three_rooms(carriers=2)
    robots = tuple(
        replace(robot, free_at_ms=40_000) if robot.name in ("c2", "r2") else robot for robot in situation.robots
    )
    assert bound_ms(replace(situation, robots=robots)) == pytest.approx(bound_ms(situation) + 20_000, abs=10)


def test_without_rovers_or_rooms_there_is_no_work_to_share() -> None:
    assert work_bound_ms(encode(one_hall())) == 0


def test_local_search_reports_the_workload_bound_where_it_is_higher() -> None:
    *_, end = Anytime().solve(three_rooms(), Budget(steps=5))
    assert (end.outcome, end.lower_bound_ms) == (Outcome.OPTIMAL, bound_ms(three_rooms()))


def test_a_ride_from_a_place_in_the_room_itself_counts_for_nothing() -> None:
    """A rover could drive to the target from the carrier's place, but can't be set down there, only at a door."""
    team, targets = [carrier(1), carrier(2), rover(on="c1")], {"t0": hall(-5), "t1": room(12)}
    situation = situation_of(team, targets, {"m1": door(10)}, {"c1_start": hall(0), "c2_start": hall(-5)})
    road = situation.travel_ms["rover"].copy()
    road[situation.place_index["c1_start"], situation.place_index["t1"]] = 1
    changed = replace(situation, travel_ms={**situation.travel_ms, "rover": road})
    assert 0 < bound_ms(changed) <= bound_ms(situation) <= 19_002


@pytest.mark.parametrize("recover", [False, True])
@pytest.mark.parametrize("seed", range(4))
def test_no_plan_for_many_rooms_ends_before_it(seed: int, *, recover: bool) -> None:
    situation = replace(many_rooms(2, 1, 9, 8, seed=seed), goal=SituationGoal(recover_rovers=recover))
    found = shortest_ms(situation)
    assert found is not None
    assert 0 < bound_ms(situation) <= found


@given(situations())
def test_no_plan_ends_before_it(situation: Situation) -> None:
    found = shortest_ms(situation)
    assert found is None or bound_ms(situation) <= found


def shortest_ms(situation: Situation) -> int | None:
    plans = [event.plan for event in Anytime().solve(situation, Budget(steps=5)) if isinstance(event, Improved)]
    return min((plan.makespan_ms for plan in plans), default=None)
