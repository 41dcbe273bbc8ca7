from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from situations import full_carrier, many_rooms, one_hall, one_room, relay, rover_left_behind, situations

from marsupial.model.situation import Situation
from marsupial.planning.list_scheduling.costs import NEVER, Costs
from marsupial.planning.list_scheduling.insertions import Ways
from marsupial.planning.list_scheduling.timeline import Timeline
from marsupial.planning.list_scheduling.transports import Ride, ride


def ways_of(situation: Situation, timeline: Timeline | None = None) -> Ways:
    left = np.ones(len(situation.targets), dtype=np.bool_)
    return Ways(timeline or Timeline.of(situation), Costs(situation), left)


def take_soonest(ways: Ways, target: int) -> None:
    """Carry out the soonest way to a target."""
    robot, carrier = ways.way(int(ways.soonest()[1][target]))
    if carrier is not None:
        assert ride(ways.timeline, robot, ways.journey(robot, carrier, target))
    ways.timeline.explore(robot, ways.timeline.situation.targets[target].name)


def soonest_ms(situation: Situation) -> list[int]:
    return ways_of(situation).soonest()[0].tolist()


def test_there_is_a_way_for_every_robot_alone_and_for_every_ride() -> None:
    ways = ways_of(one_room())
    assert (ways.alone_ms >= NEVER).all()
    assert ways.landed_ms.tolist() == [[[15_002]], [[NEVER]]]  # set down by the carrier it is aboard; fetched
    done, numbers = ways.soonest()
    assert done.tolist() == [19_002]
    assert ways.way(int(numbers[0])) == ("r1", "c1")


def test_who_goes_alone_needs_no_carrier() -> None:
    ways = ways_of(one_hall())
    done, numbers = ways.soonest()
    assert done.tolist() == [10_000, 30_000]
    assert ways.way(int(numbers[0])) == ("c1", None)


def test_what_is_not_left_is_not_done() -> None:
    ways = ways_of(one_hall())
    ways.left[0] = False
    assert ways.soonest()[0].tolist() == [NEVER, 30_000]


def test_fetching_counts_the_longer_of_both_ways_to_the_meeting() -> None:
    ways = ways_of(rover_left_behind())
    assert ways.soonest()[0].tolist() == [59_004]
    assert ways.journey("r1", "c1", 0) == Ride(carrier="c1", pickup="m1", set_down="m2", then_to="m2")


def test_a_full_carrier_makes_room_before_it_fetches() -> None:
    assert soonest_ms(full_carrier()) == [41_005]


def test_a_relay_is_no_way_of_one_ride() -> None:
    assert soonest_ms(relay()) == [NEVER]


@pytest.mark.parametrize("seed", range(3))
def test_a_mended_table_equals_a_new_one_on_a_big_situation(seed: int) -> None:
    mended_equals_new(many_rooms(3, 2, 12, 6, seed=seed))


@settings(deadline=None)
@given(situations(goals=False))
def test_a_mended_table_equals_a_new_one(situation: Situation) -> None:
    mended_equals_new(situation)


def mended_equals_new(situation: Situation) -> None:
    """Explore target by target; each is done when the table said, and then the table is as if made anew."""
    ways = ways_of(situation)
    for target in range(len(situation.targets)):
        said = int(ways.soonest()[0][target])
        if said >= NEVER:
            continue
        take_soonest(ways, target)
        assert max(action.end_ms for action in ways.timeline.actions if action.place == f"t{target}") == said
        ways.left[target] = False
        ways.advance()
        new = Ways(ways.timeline, ways.costs, ways.left)
        assert (ways.landed_ms == new.landed_ms).all()
        assert (ways.alone_ms == new.alone_ms).all()
        assert (ways.arrivals.arrive_ms == new.arrivals.arrive_ms).all()
        assert (ways.arrivals.boarding_ms == new.arrivals.boarding_ms).all()
        assert all(one.tolist() == other.tolist() for one, other in zip(ways.soonest(), new.soonest(), strict=True))
