import numpy as np
import pytest
from hypothesis import given
from support.planning.drawn_situations import situations
from support.planning.situations import full_carrier, many_rooms, one_hall, one_room, relay, rover_left_behind

from marsupial.model.situation import Situation
from marsupial.planning.schedule.costs import NEVER, Costs
from marsupial.planning.schedule.insertions import Insertions
from marsupial.planning.schedule.timeline import Timeline, Transport, transport


def insertions_of(situation: Situation, timeline: Timeline | None = None) -> Insertions:
    left = np.ones(len(situation.targets), dtype=np.bool_)
    return Insertions(timeline or Timeline.of(situation), Costs(situation), left)


def take_soonest(insertions: Insertions, target: int) -> None:
    """Carry out the soonest insertion to a target."""
    robot, carrier = insertions.explorer(int(insertions.soonest()[1][target]))
    if carrier is not None:
        assert transport(insertions.timeline, robot, insertions.journey(robot, carrier, target))
    insertions.timeline.explore(robot, insertions.timeline.situation.targets[target].name)


def soonest_ms(situation: Situation) -> list[int]:
    return insertions_of(situation).soonest()[0].tolist()


def test_there_is_a_way_for_every_robot_alone_and_for_every_ride() -> None:
    insertions = insertions_of(one_room())
    assert (insertions.alone_ms >= NEVER).all()
    assert insertions.landed_ms.tolist() == [[[15_002]], [[NEVER]]]  # set down by the carrier it is aboard; fetched
    done, numbers = insertions.soonest()
    assert done.tolist() == [19_002]
    assert insertions.explorer(int(numbers[0])) == ("r1", "c1")


def test_a_rover_that_drives_alone_needs_no_carrier() -> None:
    insertions = insertions_of(one_hall())
    done, numbers = insertions.soonest()
    assert done.tolist() == [10_000, 30_000]
    assert insertions.explorer(int(numbers[0])) == ("c1", None)


def test_targets_outside_the_goal_have_no_insertion() -> None:
    insertions = insertions_of(one_hall())
    insertions.left[0] = False
    assert insertions.soonest()[0].tolist() == [NEVER, 30_000]


def test_fetching_counts_the_longer_of_both_ways_to_the_meeting() -> None:
    insertions = insertions_of(rover_left_behind())
    assert insertions.soonest()[0].tolist() == [59_004]
    assert insertions.journey("r1", "c1", 0) == Transport(carrier="c1", pickup="m1", set_down="m2", then_to="m2")


def test_a_full_carrier_makes_room_before_it_fetches() -> None:
    assert soonest_ms(full_carrier()) == [41_005]


def test_a_relay_is_no_insertion_of_one_ride() -> None:
    assert soonest_ms(relay()) == [NEVER]


@pytest.mark.parametrize("seed", range(3))
def test_an_updated_table_equals_a_new_one_on_a_big_situation(seed: int) -> None:
    mended_equals_new(many_rooms(3, 2, 12, 6, seed=seed))


@given(situations(goals=False))
def test_an_updated_table_equals_a_new_one(situation: Situation) -> None:
    mended_equals_new(situation)


def mended_equals_new(situation: Situation) -> None:
    """Explore target by target: each is done at the time of the table, and the updated table equals a new one."""
    insertions = insertions_of(situation)
    for target in range(len(situation.targets)):
        said = int(insertions.soonest()[0][target])
        if said >= NEVER:
            continue
        take_soonest(insertions, target)
        assert max(action.end_ms for action in insertions.timeline.actions if action.place == f"t{target}") == said
        insertions.left[target] = False
        insertions.advance()
        new = Insertions(insertions.timeline, insertions.costs, insertions.left)
        assert (insertions.landed_ms == new.landed_ms).all()
        assert (insertions.alone_ms == new.alone_ms).all()
        assert (insertions.arrivals.arrive_ms == new.arrivals.arrive_ms).all()
        assert (insertions.arrivals.boarding_ms == new.arrivals.boarding_ms).all()
        assert all(
            one.tolist() == other.tolist() for one, other in zip(insertions.soonest(), new.soonest(), strict=True)
        )
