from dataclasses import replace

import pytest
from support.planning.situations import (
    in_flight,
    one_hall,
    one_room,
    relay,
    rover_left_behind,
    seat_taken,
    too_wide,
    two_rooms,
    wrong_carrier,
)
from support.planning.spots import carrier, default_types, door, hall, room, rover, situation_of

from marsupial.model import EPSILON_MS, Action, ActionName, Plan, Situation, SituationGoal
from marsupial.planning.checker import Verdict, ViolationKind, check

Kind = ViolationKind


def move(start: int, duration: int, robot: str, origin: str, place: str) -> Action:
    return Action(name=ActionName.MOVE, start_ms=start, duration_ms=duration, robot=robot, origin=origin, place=place)


def explore(start: int, duration: int, robot: str, origin: str, place: str) -> Action:
    return replace(move(start, duration, robot, origin, place), name=ActionName.EXPLORE)


def dock(start: int, duration: int, robot: str, on: str, place: str) -> Action:
    return Action(name=ActionName.DOCK, start_ms=start, duration_ms=duration, robot=robot, carrier=on, place=place)


def undock(start: int, duration: int, robot: str, on: str, place: str) -> Action:
    return replace(dock(start, duration, robot, on, place), name=ActionName.UNDOCK)


ROOM = (
    move(0, 10_000, "c1", "c1_start", "m1"),
    undock(10_001, 5_000, "r1", "c1", "m1"),
    explore(15_002, 4_000, "r1", "m1", "t1"),
)
"""The best plan for `one_room`."""

BACK = (
    *ROOM,
    move(19_003, 4_000, "r1", "t1", "m1"),
    dock(23_004, 10_000, "r1", "c1", "m1"),
    move(33_005, 10_000, "c1", "m1", "home"),
)
"""The best plan for `one_room` with the whole team home at the end."""

HOME = SituationGoal(recover_rovers=True, return_home=True)


def verdict(situation: Situation, *actions: Action, targets: frozenset[str] | None = None) -> Verdict:
    return check(situation, Plan.of(actions), targets=targets)


def refused(situation: Situation, *actions: Action, targets: frozenset[str] | None = None) -> tuple[Kind, int]:
    """Return kind and time of the first violation, after checking that it has a message."""
    found = verdict(situation, *actions, targets=targets)
    assert not found.valid
    assert found.violation.message
    return found.violation.kind, found.violation.time_ms


def with_action(actions: tuple[Action, ...], i: int, **changes: object) -> tuple[Action, ...]:
    return (*actions[:i], replace(actions[i], **changes), *actions[i + 1 :])


def test_the_plan_for_one_room_is_valid() -> None:
    found = verdict(one_room(), *ROOM)
    assert found == Verdict(valid=True, violation=None, makespan_ms=19_002)


def test_the_plan_that_brings_everybody_home_is_valid() -> None:
    assert verdict(one_room(goal=HOME), *BACK).valid


def test_an_empty_plan_is_valid_where_nothing_has_to_be_explored() -> None:
    assert verdict(one_room(), targets=frozenset()).valid


def test_targets_outside_the_goal_may_be_left() -> None:
    assert verdict(one_hall(), explore(0, 10_000, "c1", "c1_start", "t1"), targets=frozenset({"t1"})).valid


def test_exploring_a_target_twice_only_costs_time() -> None:
    twice = explore(19_003, 1, "r1", "t1", "t1")
    assert verdict(one_room(), *ROOM, twice).makespan_ms == 19_004


def test_an_action_of_no_length_takes_one_millisecond() -> None:
    situation = situation_of([carrier(home="h1")], {}, {}, {"c1_start": hall(0)}, homes={"h1": hall(0)}, goal=HOME)
    assert verdict(situation, move(0, 1, "c1", "c1_start", "h1")).valid
    assert refused(situation, move(0, 0, "c1", "c1_start", "h1")) == (Kind.WRONG_DURATION, 0)


NEAR = (move(0, 1, "c1", "c1_start", "m1"), move(0, 1, "r1", "r1_start", "m1"), dock(2, 10_000, "r1", "c1", "m1"))

WRONG: dict[str, tuple[Situation, tuple[Action, ...], tuple[Kind, int]]] = {
    "a rover docks on a carrier for climbers": (wrong_carrier(), NEAR, (Kind.NO_SEAT, 2)),
    "a rover docks where a slow one has the seat": (
        seat_taken(), (move(0, 10_000, "c1", "c1_start", "m1"), move(0, 1, "r1", "r1_start", "m1"),
                       dock(10_001, 10_000, "r1", "c1", "m1")), (Kind.NO_SEAT, 10_001)
    ),
    "a drive with a carrier": (one_room(), with_action(ROOM, 0, carrier="c1"), (Kind.MALFORMED, 0)),
    "a drive without origin": (one_room(), with_action(ROOM, 2, origin=None), (Kind.MALFORMED, 15_002)),
    "an undock without carrier": (one_room(), with_action(ROOM, 1, carrier=None), (Kind.MALFORMED, 10_001)),
    "a dock with an origin": (one_room(goal=HOME), with_action(BACK, 4, origin="m1"), (Kind.MALFORMED, 23_004)),
    "an unknown robot": (one_room(), with_action(ROOM, 2, robot="r9"), (Kind.UNKNOWN_NAME, 15_002)),
    "an unknown place": (one_room(), with_action(ROOM, 0, place="m9"), (Kind.UNKNOWN_NAME, 0)),
    "an unknown origin": (one_room(), with_action(ROOM, 0, origin="nowhere"), (Kind.UNKNOWN_NAME, 0)),
    "a carrier undocks from a rover": (
        one_room(), with_action(ROOM, 1, robot="c1", carrier="r1"), (Kind.WRONG_ROLE, 10_001)
    ),
    "a rover docks on a rover": (in_flight(), (dock(9_000, 10_000, "r2", "r1", "m1"),), (Kind.WRONG_ROLE, 9_000)),
    "a start before zero": (one_hall(), (explore(-1, 10_000, "c1", "c1_start", "t1"),), (Kind.TOO_EARLY, -1)),
    "two things at a time": (one_room(), with_action(ROOM, 1, start_ms=9_000), (Kind.OVERLAP, 9_000)),
    "no millisecond between": (one_room(), with_action(ROOM, 1, start_ms=10_000), (Kind.OVERLAP, 10_000)),
    "a carrier leaves while it undocks": (
        one_room(), (*ROOM, move(12_000, 10_000, "c1", "m1", "home")), (Kind.OVERLAP, 12_000)
    ),
    "a move to a target": (one_hall(), (move(0, 10_000, "c1", "c1_start", "t1"),), (Kind.WRONG_PLACE, 0)),
    "a move back to a start": (
        one_room(), (ROOM[0], move(10_001, 10_000, "c1", "m1", "c1_start")), (Kind.WRONG_PLACE, 10_001)
    ),
    "a meeting is explored": (one_room(), with_action(ROOM, 0, name=ActionName.EXPLORE), (Kind.WRONG_PLACE, 0)),
    "a dock at home": (one_room(goal=HOME), with_action(BACK, 4, place="home"), (Kind.WRONG_PLACE, 23_004)),
    "a carried rover explores": (one_room(), (ROOM[0], ROOM[2]), (Kind.CARRIED, 15_002)),
    "a carried rover moves": (one_room(), (move(0, 20_000, "r1", "c1_start", "m1"),), (Kind.CARRIED, 0)),
    "a carried rover docks": (one_room(), (ROOM[0], dock(10_001, 10_000, "r1", "c1", "m1")), (Kind.CARRIED, 10_001)),
    "a drive from elsewhere": (one_hall(), (explore(0, 20_000, "c1", "t1", "t2"),), (Kind.ELSEWHERE, 0)),
    "an undock where the carrier is not": (
        two_rooms(), (ROOM[0], undock(10_001, 5_000, "r1", "c1", "m2")), (Kind.ELSEWHERE, 10_001)
    ),
    "an undock from another carrier": (
        relay(),
        (move(0, 10_000, "c2", "c2_start", "m2"), undock(10_001, 5_000, "r1", "c2", "m2")),
        (Kind.NOT_ABOARD, 10_001),
    ),
    "an undock of a rover on the ground": (
        one_room(), (*ROOM[:2], undock(15_002, 5_000, "r1", "c1", "m1")), (Kind.NOT_ABOARD, 15_002)
    ),
    "an undock where the rover is too wide": (
        too_wide(), (ROOM[0], undock(10_001, 5_000, "r1", "c1", "m1")), (Kind.NO_ROOM, 10_001)
    ),
    "a target of another type": (
        one_room(), (explore(0, 12_000, "c1", "c1_start", "t1"),), (Kind.CANNOT_EXPLORE, 0)
    ),
    "a drive without a path": (relay(), (move(0, 20_000, "c1", "c1_start", "m2"),), (Kind.NO_PATH, 0)),
    "a carrier away from home in the end": (one_room(goal=HOME), BACK[:-1], (Kind.CARRIER_NOT_HOME, 33_004)),
}  # fmt: skip


@pytest.mark.parametrize("case", WRONG)
def test_a_plan_with_something_wrong_is_refused_by_kind_and_time(case: str) -> None:
    assert EPSILON_MS == 1
    situation, actions, expected = WRONG[case]
    assert refused(situation, *actions) == expected


def test_actions_have_to_be_listed_in_order_of_start() -> None:
    plan = Plan(actions=(ROOM[0], ROOM[2], ROOM[1]))
    found = check(one_room(), plan).violation
    assert (found.kind, found.action) == (Kind.OUT_OF_ORDER, ROOM[1])


def test_a_robot_in_flight_is_waited_for() -> None:
    early = explore(6_999, 5_000, "c1", "c1_start", "t3")
    assert refused(in_flight(), early) == (Kind.TOO_EARLY, 6_999)
    assert verdict(in_flight(), replace(early, start_ms=7_000), targets=frozenset({"t3"})).valid


def test_a_rover_aboard_is_bound_to_a_busy_carrier() -> None:
    situation = situation_of([carrier(free_at_ms=8_000), rover(on="c1")], {}, {"m1": door(0)}, {"c1_start": hall(0)})
    first = move(7_000, 1, "c1", "c1_start", "m1")
    assert refused(situation, first) == (Kind.TOO_EARLY, 7_000)
    assert verdict(situation, replace(first, start_ms=8_000), undock(8_002, 5_000, "r1", "c1", "m1")).valid


def test_a_carrier_that_docks_one_rover_can_not_dock_another() -> None:
    starts = {"c1_start": hall(0), "r1_start": room(0), "r2_start": room(0)}
    situation = situation_of([carrier(), rover(1), rover(2)], {}, {"m1": door(0)}, starts, types=default_types(2))
    there = (
        move(0, 1, "c1", "c1_start", "m1"),
        move(0, 1, "r1", "r1_start", "m1"),
        move(0, 1, "r2", "r2_start", "m1"),
        dock(2, 10_000, "r1", "c1", "m1"),
    )
    assert refused(situation, *there, dock(3, 10_000, "r2", "c1", "m1")) == (Kind.OVERLAP, 3)
    assert verdict(situation, *there, dock(10_003, 10_000, "r2", "c1", "m1")).valid


def test_both_have_to_be_there_to_dock() -> None:
    comes = move(0, 2_000, "r1", "r1_start", "m1")
    assert refused(rover_left_behind(), comes, dock(2_001, 10_000, "r1", "c1", "m1")) == (Kind.ELSEWHERE, 2_001)
    waits = move(0, 10_000, "c1", "c1_start", "m1")
    assert refused(rover_left_behind(), waits, dock(10_001, 10_000, "r1", "c1", "m1")) == (Kind.ELSEWHERE, 10_001)


@pytest.mark.parametrize("i", range(len(BACK)))
@pytest.mark.parametrize("change", [-1, 1])
def test_durations_are_exact(i: int, change: int) -> None:
    changed = with_action(BACK, i, duration_ms=BACK[i].duration_ms + change)
    assert refused(one_room(goal=HOME), *changed) == (Kind.WRONG_DURATION, BACK[i].start_ms)


def test_a_full_carrier_takes_no_rover() -> None:
    situation = situation_of(
        [carrier(), rover(1, "c1"), rover(2)], {}, {"m1": door(0)}, {"c1_start": hall(0), "r2_start": room(0)}
    )
    there = (move(0, 1, "c1", "c1_start", "m1"), move(0, 1, "r2", "r2_start", "m1"))
    assert refused(situation, *there, dock(2, 10_000, "r2", "c1", "m1")) == (Kind.NO_CAPACITY, 2)
    swap = (undock(2, 5_000, "r1", "c1", "m1"), dock(5_003, 10_000, "r2", "c1", "m1"))
    assert verdict(situation, *there, *swap).valid


def test_a_target_left_out_is_named_at_the_end() -> None:
    found = verdict(one_room(), *ROOM[:2]).violation
    assert (found.kind, found.time_ms, found.action) == (Kind.TARGET_UNEXPLORED, 15_001, None)
    assert str(found) == "15.001 s, at the end: t1 has not been explored"


@pytest.mark.parametrize("goal", [SituationGoal(recover_rovers=True), SituationGoal(return_home=True)])
def test_a_rover_left_on_the_ground_is_refused(goal: SituationGoal) -> None:
    home = move(15_002, 10_000, "c1", "m1", "home")
    assert refused(one_room(goal=goal), *ROOM, home) == (Kind.ROVER_NOT_ABOARD, 25_002)


def test_the_first_violation_in_time_is_reported_whatever_the_order_of_kinds() -> None:
    broken = with_action(with_action(BACK, 5, place="nowhere"), 3, duration_ms=1)
    assert refused(one_room(goal=HOME), *broken) == (Kind.WRONG_DURATION, 19_003)


def test_a_violation_has_its_time_and_action() -> None:
    found = verdict(one_room(), *with_action(ROOM, 2, duration_ms=5)).violation
    assert str(found) == "15.002 s, (explore r1 m1 t1): takes 4000 ms, not 5 ms"


def test_swapping_the_starts_of_two_actions_of_a_robot_is_refused() -> None:
    for i, j in ((0, 1), (1, 2), (3, 4), (4, 5)):
        swapped = with_action(BACK, i, start_ms=BACK[j].start_ms)
        assert not verdict(one_room(goal=HOME), *with_action(swapped, j, start_ms=BACK[i].start_ms)).valid
