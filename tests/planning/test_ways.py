from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from situations import full_carrier, many_rooms, one_room, relay, rover_left_behind, situations

from marsupial.model.situation import Situation
from marsupial.planning.rides import Ride, follow, ride
from marsupial.planning.timeline import Timeline
from marsupial.planning.ways import NEVER, Costs, Ways


def ways_of(situation: Situation, timeline: Timeline | None = None) -> Ways:
    left = np.ones(len(situation.targets), dtype=np.bool_)
    return Ways(timeline or Timeline.of(situation), Costs(situation), left)


def take_soonest(ways: Ways, target: int) -> set[str]:
    """Carry out the soonest way to a target; return the robots that took part."""
    robot, carrier = ways.way(int(np.argmin(ways.done_ms[:, target])))
    timeline = ways.timeline
    changed = {robot}
    if carrier is not None:
        changed |= {carrier, *timeline.cargo[carrier]}
        assert ride(timeline, robot, ways.journey(robot, carrier, target))
    timeline.explore(robot, timeline.situation.targets[target].name)
    return changed


def test_the_table_has_a_row_for_every_way() -> None:
    ways = ways_of(one_room())
    assert ways.done_ms.tolist()[:3] == [[NEVER], [NEVER], [19_002]]  # carrier alone, rover alone, rover set down
    assert (ways.done_ms[3:] >= NEVER).all()
    assert ways.way(2) == ("r1", "c1")


def test_fetching_counts_the_longer_of_both_ways_to_the_meeting() -> None:
    ways = ways_of(rover_left_behind())
    assert int(ways.done_ms.min()) == 59_004
    assert ways.journey("r1", "c1", 0) == Ride(carrier="c1", pickup="m1", set_down="m2", then_to="m2")


def test_a_full_carrier_makes_room_before_it_fetches() -> None:
    assert int(ways_of(full_carrier()).done_ms.min()) == 41_005


def test_a_relay_is_not_in_the_table_but_found() -> None:
    ways = ways_of(relay())
    assert (ways.done_ms >= NEVER).all()
    times, rides = ways.relay("r1")
    assert times.tolist() == [15_002, 35_003, 70_006]
    assert rides[2] == Ride(carrier="c2", pickup="m2", set_down="m3", then_to="m3")
    assert rides[1] == Ride(carrier="c1", pickup=None, set_down="m1", then_to="m2")


def test_alone_a_rover_gets_where_its_carrier_and_its_wheels_take_it() -> None:
    times, _ = ways_of(relay()).relay("r1", alone=True)
    assert times.tolist()[:2] == [15_002, 35_003]
    assert times[2] >= NEVER


def test_following_the_rides_brings_the_rover_there_in_time() -> None:
    situation = relay()
    times, rides = ways_of(situation).relay("r1")
    timeline = Timeline.of(situation)
    assert follow(timeline, "r1", 2, rides)
    assert (timeline.at["r1"], timeline.ready_ms["r1"]) == ("m3", int(times[2]))


def test_a_ride_that_is_not_possible_says_so() -> None:
    timeline = Timeline.of(relay())
    assert not ride(timeline, "r1", Ride(carrier="c1", pickup=None, set_down="m3", then_to="m3"))


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
        said = int(ways.done_ms[:, target].min())
        if said >= NEVER:
            continue
        changed = take_soonest(ways, target)
        assert max(action.end_ms for action in ways.timeline.actions if action.place == f"t{target}") == said
        ways.explored(target)
        ways.update(changed)
        new = Ways(ways.timeline, ways.costs, ways.left)
        assert (np.minimum(ways.done_ms, NEVER) == np.minimum(new.done_ms, NEVER)).all()
        assert (ways.arrive_ms == new.arrive_ms).all()
