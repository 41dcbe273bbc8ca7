from dataclasses import replace

import pytest
from support.planning.situations import one_hall, one_room, too_wide
from support.planning.spots import carrier, door, hall, room, rover, situation_of

from marsupial.model import Briefing, Cell, GuessedGround, Plan, Situation, Square, Unseen
from marsupial.planning.checker import check
from marsupial.planning.greedy import serve
from marsupial.planning.schedule.timeline import Timeline
from marsupial.strategies.guess import BEND, HEAD_START_MS, MOST_SQUARES, NEAR_MS, ROOM_MS, WORTH, Guess, guess

SPEED_MPS = {"carrier": 1.0, "rover": 0.5, "climber": 0.5}


def square(name: str, x_m: float, *, share: float = 1.0, draw: float = 0.9) -> Square:
    return Square(name=name, x_m=x_m, y_m=0.0, share=share, draw=draw)


def guessed(
    situation: Situation,
    *squares: Square,
    previous: Plan | None = None,
    rovers_only: float = 0.5,
    shared: float = 0.0,
    early: float = 1.0,
    **at_m: float,
) -> Guess:
    """Return the guess with targets at these positions on a line."""
    positions = {name: (x, 0.0) for name, x in at_m.items()}
    unseen = Unseen(
        squares=tuple(replace(one, at=Cell(i, 0)) for i, one in enumerate(squares)),
        at_m=positions,
        rovers_only=rovers_only,
        shared=shared,
        speed_mps=SPEED_MPS,
        side=4,
    )
    return guess(
        Briefing(
            situation=situation, previous=previous, direct_ms=dict, connects={}, deployed_at={}, unseen=lambda: unseen
        ),
        early=early,
    )


def two_in_a_hall() -> Situation:
    return situation_of(
        [carrier(), carrier(2)], {"t1": hall(10), "t2": hall(30)}, {}, {"c1_start": hall(0), "c2_start": hall(0)}
    )


def seconds(metres: float) -> int:
    return int(1000 * BEND * metres)


def test_a_known_map_leaves_nothing_to_guess() -> None:
    situation = one_hall()
    found = guessed(situation, t1=10, t2=30)
    assert found.situation == situation
    assert found.worth == {"t1": 1.0, "t2": 1.0}


def test_it_is_told_where_halls_and_rooms_are_guessed() -> None:
    found = guessed(one_room(), square("a", 30, draw=0.1), square("b", 40), rovers_only=0.5, shared=1.0, t1=10)
    assert found.ground == GuessedGround(corner=Cell(0, 0), side=4, halls=(Cell(1, 0),), rooms=(Cell(0, 0),))


def test_targets_are_worth_the_area_that_they_may_reveal() -> None:
    situation = one_hall()
    first, second = situation.targets
    for areas, priority, early, worth in (
        ((30.0, 10.0), 1.0, 1.0, {"t1": 1.5, "t2": 0.5}),
        ((12.0, 0.1), 1.0, 1.0, {"t1": 1.5, "t2": 0.5}),  # as if it were 4 m2
        ((30.0, 10.0), 1.0, 0.0, {"t1": 1.0, "t2": 1.0}),
        ((30.0, 10.0), 3.0, 1.0, {"t1": 1.5, "t2": 1.5}),
    ):
        targets = replace(first, reveal_m2=areas[0]), replace(second, reveal_m2=areas[1], priority=priority)
        found = guessed(replace(situation, targets=targets), t1=10, t2=30, early=early)
        assert found.worth == pytest.approx(worth)


def test_a_corner_near_a_robot_is_worth_at_least_the_mean() -> None:
    far, near = hall(30), hall(NEAR_MS / 1000)
    for corner, worth in ((far, 0.5), (near, 1.0)):
        situation = situation_of([carrier()], {"t1": hall(10), "t2": corner}, {}, {"c1_start": hall(0)})
        areas = {"t1": 30.0, "t2": 10.0}
        targets = tuple(replace(target, reveal_m2=areas[target.name]) for target in situation.targets)
        found = guessed(replace(situation, targets=targets), t1=10, t2=30)
        assert found.worth == {"t1": 1.5, "t2": worth}


def test_a_square_is_a_target_for_carriers_behind_the_target_on_the_shortest_way() -> None:
    found = guessed(two_in_a_hall(), square("a", 40), square("b", 0, share=0.5), t1=10, t2=30)
    assert found.situation.target_by_name["?a"].explorers == {"carrier"}
    assert found.situation.travel("carrier", "c1_start", "?a") == 30_000 + seconds(10)
    assert found.situation.travel("carrier", "c1_start", "?b") == 10_000 + seconds(10)
    assert found.situation.travel("carrier", "?a", "t1") == 20_000 + seconds(10)
    assert found.situation.travel("carrier", "?a", "?b") == seconds(40)
    assert found.worth == {"t1": 1.0, "t2": 1.0, "?a": WORTH, "?b": WORTH / 2}


def team() -> Situation:
    return situation_of(
        [carrier(), rover(on="c1")], {"t1": hall(10), "t2": room(12)}, {"m1": door(10)}, {"c1_start": hall(0)}
    )


def test_the_share_of_squares_for_rovers_is_that_of_ground_for_rovers_only() -> None:
    found = guessed(team(), square("a", 20, draw=0.2), square("b", 20, draw=0.4), rovers_only=0.3, t1=10, t2=12)
    assert found.situation.target_by_name["?a"].explorers == {"rover"}
    assert found.situation.target_by_name["?b"].explorers == {"carrier"}
    assert found.situation.meetings == ("m1", "?door_a")
    assert found.situation.travel("carrier", "c1_start", "?door_a") == 10_000 + seconds(10)
    assert found.situation.travel("carrier", "c1_start", "?a") is None
    assert found.situation.travel("rover", "?door_a", "?a") == ROOM_MS
    assert found.situation.travel("rover", "m1", "?a") is None
    plan, unserved = serve(found.situation)
    assert not unserved
    assert check(found.situation, plan).valid


def shared_ground() -> Situation:
    """A rover on the ground, and one aboard, where rovers can drive wherever carriers can."""
    team, targets = [carrier(), rover(1), rover(2, on="c1")], {"t1": door(10), "t2": room(12)}
    return situation_of(team, targets, {"m1": door(10)}, {"c1_start": door(0), "r1_start": door(2)})


def test_a_rover_on_the_ground_drives_on_where_rovers_share_the_carriers_ground() -> None:
    squares = square("a", 20, draw=0.2), square("b", 20, draw=0.5), square("c", 20, draw=0.9)
    found = guessed(shared_ground(), *squares, rovers_only=0.3, shared=0.5, t1=10, t2=12)
    explorers = {name: found.situation.target_by_name[f"?{name}"].explorers for name in "abc"}
    assert explorers == {"a": {"rover"}, "b": {"carrier", "rover"}, "c": {"carrier"}}
    to_t2_and_on = 20_000 + 2 * seconds(8)  # t2 is the nearer one, and a rover takes twice as long
    assert found.situation.travel("rover", "r1_start", "?b") == to_t2_and_on
    assert found.situation.travel("rover", "r1_start", "?door_a") == to_t2_and_on
    assert found.situation.travel("rover", "r1_start", "?a") == to_t2_and_on + ROOM_MS
    assert found.situation.travel("carrier", "c1_start", "?b") == 10_000 + seconds(10)


def test_a_rover_that_would_drive_on_goes_to_the_target_that_only_it_can_explore() -> None:
    found = guessed(shared_ground(), square("b", 20), rovers_only=0.0, shared=1.0, t1=10, t2=12)
    plan = found.real_part(exploring(found.situation, "?b", robot="r1"))
    assert [(a.robot, a.place) for a in plan.actions] == [("r1", "t2")]
    assert check(shared_ground(), plan, targets=plan.explored).valid


def test_without_rovers_no_square_is_a_room() -> None:
    assert guessed(two_in_a_hall(), square("a", 40, draw=0.1), t1=10, t2=30).situation.meetings == ()


def test_a_rover_is_no_narrower_in_a_guess() -> None:
    situation = too_wide()
    found = guessed(situation, square("a", 40), shared=0.5, t1=22).situation
    assert len(found.places) > len(situation.places)
    for kind, standing in situation.standing.items():
        assert {place: found.standing[kind][found.place_index[place]] for place in situation.places} == dict(
            zip(situation.places, standing, strict=True)
        )


def test_a_single_robot_does_not_avoid_others() -> None:
    assert guessed(one_hall(), square("a", 40), t1=10, t2=30).situation == one_hall()


def test_where_no_carrier_can_get_to_the_unknown_nothing_is_guessed() -> None:
    situation = one_room()
    assert guessed(situation, square("a", 20), t1=12).situation == situation


def test_of_many_squares_the_nearest_are_planned_for() -> None:
    squares = [square(f"s{i}", 100 - i) for i in range(MOST_SQUARES + 10)]
    found = guessed(two_in_a_hall(), *squares, t1=10, t2=30)
    assert {name for name in found.worth if name.startswith("?")} == {f"?s{i}" for i in range(10, MOST_SQUARES + 10)}


def exploring(situation: Situation, *targets: str, robot: str = "c1") -> Plan:
    timeline = Timeline.of(situation)
    for target in targets:
        timeline.explore(robot, target)
    return timeline.plan


def test_the_way_a_robot_is_on_already_is_a_little_shorter() -> None:
    situation = one_hall()
    found = guessed(situation, previous=exploring(situation, "t2", "t1"), t1=10, t2=30)
    assert found.situation.travel("carrier", "c1_start", "t2") == 30_000 - HEAD_START_MS
    assert found.situation.travel("carrier", "c1_start", "t1") == 10_000
    assert found.situation.travel("carrier", "t2", "t1") == 20_000
    assert situation.travel("carrier", "c1_start", "t2") == 30_000


def test_a_real_plan_is_put_on_the_clock_without_head_starts() -> None:
    situation = one_hall()
    plan = exploring(situation, "t1", "t2")
    found = guessed(situation, previous=plan, t1=10, t2=30)
    early, _ = serve(found.situation, plan)
    assert early.makespan_ms == plan.makespan_ms - HEAD_START_MS
    assert found.real_part(early) == plan


def two_carriers() -> Situation:
    return situation_of(
        [carrier(1), carrier(2)], {"t1": hall(10), "t2": hall(-30)}, {}, {"c1_start": hall(0), "c2_start": hall(1)}
    )


def test_a_robot_for_a_square_drives_to_the_target_before_it_even_if_another_explores_that() -> None:
    found = guessed(two_carriers(), square("a", 20), t1=10, t2=-30)
    timeline = Timeline.of(found.situation)
    timeline.explore("c1", "t1")
    timeline.explore("c2", "?a")
    timeline.explore("c2", "t2")
    plan = found.real_part(timeline.plan)
    assert [(a.robot, a.place) for a in plan.actions] == [("c1", "t1"), ("c2", "t1")]
    assert check(two_carriers(), plan, targets=plan.explored).valid


def test_after_the_target_before_a_square_a_robot_waits_there_for_new_targets() -> None:
    found = guessed(two_carriers(), square("a", 20), t1=10, t2=-30)
    plan = found.real_part(exploring(found.situation, "t1", "?a", "t2"))
    assert [(a.robot, a.place) for a in plan.actions] == [("c1", "t1")]


def test_a_rover_for_a_square_stays_aboard() -> None:
    found = guessed(team(), square("a", 20, draw=0.1), t1=10, t2=12)
    timeline = Timeline.of(found.situation)
    timeline.undock("r1", "?door_a")
    timeline.explore("r1", "?a")
    plan = found.real_part(timeline.plan)
    assert [(a.robot, a.place) for a in plan.actions] == [("c1", "t1")]


@pytest.mark.parametrize("places", [("?a",), ("?a", "t2"), ("t2", "?a")])
def test_the_real_part_can_be_carried_out(places: tuple[str, ...]) -> None:
    situation = replace(two_carriers())
    found = guessed(situation, square("a", 20), t1=10, t2=-30)
    plan = found.real_part(exploring(found.situation, *places))
    assert check(situation, plan, targets=plan.explored).valid
