from collections.abc import Callable

import pytest
from hypothesis import given, settings
from support.planning.drawn_situations import situations
from support.planning.situations import (
    SOLVABLE,
    bring_them_home,
    everybody_seated,
    in_flight,
    one_room,
    out_of_reach,
    relay,
)
from support.planning.spots import carrier, default_types, door, hall, room, rover, situation_of

from marsupial.model import ActionName, Budget, Improved, Situation, SituationGoal
from marsupial.planning.external import aries, tamer
from marsupial.planning.external.encodings import Vocabulary
from marsupial.planning.greedy import Greedy

pytest.importorskip("unified_planning")


def words(situation: Situation) -> set[str]:
    vocabulary = Vocabulary(situation)
    actions = [action for robot in situation.robots for action in vocabulary.drives(robot)] + list(vocabulary.meets())
    return {str(action) for action in actions}


def test_only_actions_that_can_be_carried_out_exist() -> None:
    assert words(one_room()) == {
        "(move c1 c1_start m1)",
        "(undock r1 c1 m1)",
        "(dock r1 c1 m1)",
        "(explore r1 m1 t1)",
        "(move r1 t1 m1)",
    }


def test_a_target_that_no_robot_can_enter_has_no_action() -> None:
    assert words(out_of_reach()) == {"(explore c1 c1_start t1)"}


def test_homes_are_driven_to_where_the_goal_asks_for_it() -> None:
    assert "(move c1 m1 home)" not in words(one_room())
    assert "(move c1 m1 home)" in words(one_room(goal=SituationGoal(return_home=True)))
    assert "(move c1 m1 h2)" not in words(bring_them_home())


def test_the_first_drive_takes_as_much_longer_as_the_robot_is_busy() -> None:
    vocabulary = Vocabulary(in_flight())
    robots = in_flight().robot_by_name
    took = {str(action): action.duration_ms for name in ("c1", "r2") for action in vocabulary.drives(robots[name])}
    assert took["(move c1 c1_start m1)"] == 7_000 + 10_000
    assert took["(explore r2 r2_start t2)"] == 3_000 + 4_000
    assert took["(explore c1 m1 t3)"] == 15_000


def test_a_rover_drives_from_door_to_door_only_where_it_may_change_carriers() -> None:
    assert "(move r1 m1 m2)" in words(relay())
    one_carrier = situation_of(
        [carrier(), rover(on="c1")], {"t1": room(5)}, {"m1": door(1), "m2": door(9)}, {"c1_start": hall(0)}
    )
    assert "(move r1 m1 m2)" not in words(one_carrier)


def test_interchangeable_rovers_are_set_down_in_a_fixed_order() -> None:
    situation = situation_of(
        [carrier(1), rover(1, "c1"), rover(2, "c1"), rover(3), carrier(2), rover(4, "c2"), rover(5, "c1")],
        {},
        {"m1": door(1)},
        {"c1_start": hall(0), "c2_start": hall(2), "r3_start": room(3)},
        types=default_types(3),
    )
    assert Vocabulary(situation).predecessors() == {"r2": "r1", "r5": "r2"}


@pytest.mark.parametrize("case", SOLVABLE)
def test_tamer_gets_one_action_per_action_and_flat_propositions(case: str) -> None:
    situation = SOLVABLE[case]()
    encoding = tamer.TamerEncoding(situation)
    assert {str(action) for action in encoding.actions.values()} == words(situation)
    assert all(not action.parameters for action in encoding.problem.actions)
    assert all(fluent.arity == 0 and fluent.type.is_bool_type() for fluent in encoding.problem.fluents)


@pytest.mark.parametrize(("capacity", "versions"), [(3, 1), (2, 2)])
def test_tamer_counts_the_load_of_a_carrier_only_where_places_are_scarce(capacity: int, versions: int) -> None:
    situation = situation_of(
        [carrier(), rover(1, "c1"), rover(2), rover(3)],
        {},
        {"m1": door(1)},
        {"c1_start": hall(0), "r2_start": room(2), "r3_start": room(3)},
        types=default_types(capacity),
        goal=SituationGoal(recover_rovers=True),
    )
    actions = tamer.TamerEncoding(situation).actions.values()
    docks = [str(action) for action in actions if action.name is ActionName.DOCK]
    assert docks == sorted(versions * ["(dock r1 c1 m1)", "(dock r2 c1 m1)", "(dock r3 c1 m1)"])


def test_tamer_counts_seats_besides_where_they_are_scarcer_than_places() -> None:
    docks = [str(a) for a in tamer.TamerEncoding(everybody_seated()).actions.values() if a.name is ActionName.DOCK]
    # the carrier has 2 places for 3 rovers, 1 seat for 2 rovers, and the hauler none for the climber
    assert docks.count("(dock r1 c1 m1)") == docks.count("(dock r1 h1 m1)") == 2 * 1
    assert docks.count("(dock k1 c1 m1)") == 2
    assert "(dock k1 h1 m1)" not in docks


def test_a_deadline_for_tamer_is_a_goal_with_a_time() -> None:
    problem = tamer.TamerEncoding(one_room(), 12_345).problem
    (interval,) = problem.timed_goals
    assert interval.lower.delay == 12_345
    assert len(problem.timed_goals[interval]) == len(problem.goals) == 1


@pytest.mark.parametrize("case", SOLVABLE)
def test_aries_gets_one_schema_per_thing_to_do(case: str) -> None:
    situation = SOLVABLE[case]()
    encoding = aries.Encoding(situation)
    explores = [action.name for action in encoding.problem.actions if action.name.startswith("to_")]
    vocabulary = Vocabulary(situation)
    goals = {(a.place, r.type) for r in situation.robots for a in vocabulary.drives(r)}
    assert len(explores) == len(goals)
    assert len(encoding.meaning) == len(encoding.problem.actions)


def test_aries_gets_whole_numbers_of_units_rounded_up() -> None:
    situation = situation_of([carrier()], {"t1": hall(1), "t2": hall(60)}, {}, {"c1_start": hall(0)})
    problem = aries.Encoding(situation).problem
    durations = {
        value.constant_value()
        for fluent, value in problem.explicit_initial_values.items()
        if fluent.fluent().name.startswith("time_")
    }
    assert durations == {500, 492, 9}  # units of 120 ms


@pytest.mark.parametrize("encode", [tamer.TamerEncoding, aries.Encoding])
def test_any_names_may_occur_in_a_situation(encode: Callable[[Situation], object]) -> None:
    odd = situation_of([carrier()], {"and": hall(10), "t 1/ü": hall(30), "p0": hall(5)}, {}, {"c1_start": hall(0)})
    assert encode(odd)


@settings(max_examples=50)
@given(situations())
def test_every_action_of_a_valid_plan_is_among_the_words(situation: Situation) -> None:
    known = words(situation)
    many = len(Vocabulary(situation).carriers) > 1
    for event in Greedy().solve(situation, Budget(steps=1)):
        for action in event.plan.actions if isinstance(event, Improved) and many else ():
            assert str(action) in known
