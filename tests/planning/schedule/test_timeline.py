from collections.abc import Callable

import pytest
from support.planning.situations import full_carrier, in_flight, one_room, relay, two_rooms

from marsupial.errors import InternalError
from marsupial.model.situation import Situation
from marsupial.planning.checker import check
from marsupial.planning.schedule.timeline import Timeline


def test_actions_start_as_early_as_their_robots_can() -> None:
    timeline = Timeline.of(one_room())
    timeline.undock("r1", "m1")
    timeline.explore("r1", "t1")
    assert [(str(action), action.start_ms) for action in timeline.plan.actions] == [
        ("(move c1 c1_start m1)", 0),
        ("(undock r1 c1 m1)", 10_001),
        ("(explore r1 m1 t1)", 15_002),
    ]
    assert check(one_room(), timeline.plan).valid


def test_the_first_robot_at_a_meeting_waits() -> None:
    timeline = Timeline.of(two_rooms())
    timeline.undock("r1", "m1")
    timeline.explore("r1", "t1")
    timeline.dock("r1", "c1", "m1")
    docked = timeline.plan.actions[-1]
    assert (docked.start_ms, docked.end_ms) == (23_004, 33_004)
    assert timeline.ready_ms["c1"] == timeline.ready_ms["r1"] == 33_005


def test_a_robot_in_flight_starts_when_it_is_free() -> None:
    timeline = Timeline.of(in_flight())
    timeline.explore("r2", "t2")
    timeline.undock("r1", "m1")
    assert [action.start_ms for action in timeline.plan.actions] == [3_000, 7_000, 17_001]


def test_moving_to_where_it_is_takes_no_action() -> None:
    timeline = Timeline.of(one_room())
    timeline.move("c1", "m1")
    timeline.move("c1", "m1")
    assert len(timeline.actions) == 1


def test_cargo_is_kept_in_the_order_of_boarding() -> None:
    timeline = Timeline.of(full_carrier())
    timeline.undock("r1", "m1")
    assert timeline.cargo["c1"] == ()
    timeline.dock("k1", "c1", "m1")
    assert timeline.cargo["c1"] == ("k1",)
    assert (timeline.at["k1"], timeline.on["k1"]) == (None, "c1")


def test_a_copy_goes_its_own_way() -> None:
    timeline = Timeline.of(one_room())
    other = timeline.copy()
    other.undock("r1", "m1")
    assert timeline.actions == []
    assert timeline.cargo["c1"] == ("r1",)
    assert timeline.at["c1"] == "c1_start"


@pytest.mark.parametrize(
    ("situation", "act", "message"),
    [
        (full_carrier(), lambda timeline: timeline.dock("k1", "c1", "m1"), "c1 has no place for k1"),
        (relay(), lambda timeline: timeline.move("c1", "m2"), "c1 can't drive from c1_start to m2"),
        (one_room(), lambda timeline: timeline.explore("r1", "t1"), "r1 can't drive"),
        (in_flight(), lambda timeline: timeline.undock("r2", "m1"), "r2 is not aboard a carrier"),
    ],
)
def test_an_impossible_action_is_an_error(
    situation: Situation, act: Callable[[Timeline], object], message: str
) -> None:
    with pytest.raises(InternalError, match=message):
        act(Timeline.of(situation))
