from collections.abc import Sequence
from dataclasses import replace
from itertools import product

import pytest
from hypothesis import given
from hypothesis import strategies as st
from support.planning.situations import (
    SOLVABLE,
    bring_them_home,
    everybody_seated,
    full_carrier,
    mixed_types,
    one_room,
    out_of_reach,
    relay,
    wrong_carrier,
)
from support.planning.spots import carrier, door, hall, room, rover, situation_of

from marsupial.model.situation import UNREACHABLE, Situation, SituationGoal
from marsupial.planning.reachability import hopeless_targets, impossible, matching, obstacles, reach


def places_of(name: str, robot: str) -> set[str]:
    situation = SOLVABLE[name]()
    return {place for place, yes in zip(situation.places, reach(situation)[robot], strict=True) if yes}


@pytest.mark.parametrize("name", SOLVABLE)
def test_nothing_is_called_impossible_that_has_a_plan(name: str) -> None:
    assert impossible(SOLVABLE[name]()) is None


@pytest.mark.parametrize(
    ("name", "robot", "places"),
    [
        ("relay", "c1", {"c1_start", "m1"}),  # places it can drive to
        ("relay", "r1", {"m1", "m2", "m3", "t1"}),  # places it reaches by transports in a row
        ("no_capacity", "r1", {"r1_start", "m1", "t2"}),  # no carrier transports it
    ],
)
def test_a_robot_reaches_what_it_can_drive_to_or_be_carried_to(name: str, robot: str, places: set[str]) -> None:
    assert places_of(name, robot) == places


def test_hopeless_targets_are_named_with_the_reason() -> None:
    situation = out_of_reach()
    assert hopeless_targets(situation, reach(situation)) == {
        "t2": "no robot of the team is of a type that can explore t2"
    }


@pytest.mark.parametrize(
    ("situation", "left", "why"),
    [
        (relay(), {"c1", "r1"}, "no rover can get to t1, not even carried"),
        (full_carrier(), {"c1", "r1"}, "no robot of the team is of a type that can explore t1"),
        (bring_them_home(), {"c1", "r1", "r2"},
         "no place aboard for r2: of the carriers only c1 can get there, with 1 place in all"),
    ],
)  # fmt: skip
def test_a_goal_beyond_a_part_of_the_team_is_impossible(situation: Situation, left: set[str], why: str) -> None:
    assert impossible(situation.restricted(robots=frozenset(left))) == why


def test_a_reason_names_robot_types_not_types_of_planning_alone() -> None:
    left = relay().restricted(robots=frozenset({"c1", "r1"}))
    assert next(obstacles(left, {"rover": "scout"})) == "no scout can get to t1, not even carried"


def test_every_obstacle_is_named_and_rovers_that_are_aboard_keep_their_places() -> None:
    spots = {"c1_start": hall(0), "r1_start": room(0, 1), "r3_start": room(9, 2)}
    team = [carrier(home="h1"), rover(1), rover(2, "c1"), rover(3)]
    goal = SituationGoal(recover_rovers=True, return_home=True)
    situation = situation_of(team, {}, {"m1": door(1, 1)}, spots, homes={"h1": hall(0, 5)}, goal=goal)
    assert [*obstacles(situation)] == [
        "no place aboard for r1: of the carriers only c1 can get there, with 1 place in all",
        "no place aboard for r3: no carrier with places can get there",
        "c1 has no path to its home h1",
    ]
    situation = situation.restricted(robots=frozenset({"r1", "r3"}))
    assert [*obstacles(situation)] == ["no place aboard for r1, r3: no carrier with places is left"]


def test_a_target_without_a_way_back_can_not_be_explored_if_all_must_return() -> None:
    situation = one_room(goal=SituationGoal(recover_rovers=True))
    assert impossible(situation) is None
    trap = {kind: table.copy() for kind, table in situation.travel_ms.items()}
    trap["rover"][situation.place_index["t1"]] = UNREACHABLE
    assert impossible(replace(situation, travel_ms=trap, goal=SituationGoal())) is None
    said = impossible(replace(situation, travel_ms=trap))
    assert said == "whoever explores t1 can't get from there to where it has to end"


def test_a_carrier_has_to_come_home_from_its_targets() -> None:
    team, targets, starts = [carrier(home="h1")], {"t1": hall(5)}, {"c1_start": hall(0)}
    situation = situation_of(team, targets, {}, starts, homes={"h1": hall(0)}, goal=SituationGoal(return_home=True))
    assert impossible(situation) is None
    trap = {kind: table.copy() for kind, table in situation.travel_ms.items()}
    trap["carrier"][situation.place_index["t1"]] = UNREACHABLE
    assert impossible(replace(situation, travel_ms=trap)) is not None


@pytest.mark.parametrize(
    ("wanted", "places", "given"),
    [
        ([[0, 1], [1, 0], [0]], [2, 1], [0, 1, 0]),  # all get their preferred place if there are enough
        ([[0, 1], [0]], [1, 1], [1, 0]),  # a rover with a choice yields
        ([[0, 1], [1, 2], [0]], [1, 1, 1], [1, 2, 0]),  # rovers yield along a chain
        ([[0], [0], [], [1]], [1, 1], [0, -1, -1, 1]),  # a rover without a place is left out
    ],
)
def test_rovers_are_matched_to_places(wanted: list[list[int]], places: list[int], given: list[int]) -> None:
    assert matching(wanted, [0] * len(wanted), places, [[n] for n in places]) == given


@pytest.mark.parametrize(
    ("wanted", "groups", "places", "most", "given"),
    [
        ([[0], [0], [0]], [0, 0, 1], [2], [[1, 1]], [0, -1, 0]),  # the second of a group has no seat
        ([[0, 1], [0]], [0, 0], [2, 1], [[1], [1]], [1, 0]),  # it yields although a place of another group is free
        ([[0], [0, 1], [0]], [0, 1, 0], [2, 1], [[2, 2], [0, 1]], [0, 1, 0]),  # full: one of any group yields
    ],
)
def test_rovers_are_matched_to_seats_of_their_group(
    wanted: list[list[int]], groups: list[int], places: list[int], most: list[list[int]], given: list[int]
) -> None:
    assert matching(wanted, groups, places, most) == given


@given(st.data())
def test_no_matching_seats_more_rovers(data: st.DataObject) -> None:
    rovers, carriers, counts = data.draw(st.integers(0, 5)), 3, st.integers(0, 2)
    groups = [data.draw(st.integers(0, 1)) for _ in range(rovers)]
    options = [sorted(data.draw(st.sets(st.integers(0, carriers - 1)))) for _ in range(rovers)]
    places = [data.draw(counts) for _ in range(carriers)]
    most = [[data.draw(counts), data.draw(counts)] for _ in range(carriers)]

    def fits(chosen: Sequence[int]) -> bool:
        pairs = list(zip(chosen, groups, strict=True))
        return all(
            chosen.count(k) <= places[k] and all(pairs.count((k, group)) <= most[k][group] for group in (0, 1))
            for k in range(carriers)
        )

    found = matching(options, groups, places, most)
    assert fits(found)
    assert all(k < 0 or k in options[i] for i, k in enumerate(found))
    every = (chosen for chosen in product(*([-1, *mine] for mine in options)) if fits(chosen))
    assert rovers - found.count(-1) == max(rovers - chosen.count(-1) for chosen in every)


def test_rovers_that_fit_nowhere_are_named() -> None:
    situation = replace(everybody_seated(), types=mixed_types((("climber", 2),), (("rover", 1),)))
    why = "no place aboard for r2: of the carriers only h1 can get there, with 1 place in all"
    assert impossible(situation) == why
    alone = everybody_seated().restricted(robots=frozenset({"h1", "k1"}))
    assert impossible(alone) == "no place aboard for k1: no carrier with places is left"


def test_a_rover_gets_only_where_carriers_take_it_that_it_fits_on() -> None:
    situation = wrong_carrier().restricted(robots=frozenset({"c1", "r1"}))
    assert impossible(situation) == "no rover can get to t1, not even carried"
