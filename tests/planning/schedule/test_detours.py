from dataclasses import replace

import numpy as np
import pytest
from support.planning.situations import SOLVABLE, one_room
from support.planning.spots import carrier, door, hall, situation_of

from marsupial.model import UNREACHABLE, Budget, Improved, Outcome, Situation
from marsupial.planning.checker import check
from marsupial.planning.greedy import Greedy
from marsupial.planning.schedule.costs import Detours


def by_way_of_two() -> Situation:
    """Return: the carrier reaches the target only through m1 and m2."""
    situation = situation_of([carrier()], {"t1": hall(30)}, {"m1": door(10), "m2": door(20)}, {"c1_start": hall(0)})
    table = np.full((4, 4), UNREACHABLE, dtype=np.int64)
    index = situation.place_index
    for origin, place in (("c1_start", "m1"), ("m1", "m2"), ("m2", "t1")):
        table[index[origin], index[place]] = 10_000
    return replace(situation, travel_ms=dict(situation.travel_ms) | {"carrier": table})


@pytest.mark.parametrize("name", SOLVABLE)
def test_complete_tables_stay_unchanged(name: str) -> None:
    situation = SOLVABLE[name]()
    assert Detours(situation).situation is situation


def test_a_hole_takes_the_time_of_the_way_round_it() -> None:
    filled = Detours(by_way_of_two()).situation
    assert filled.travel("carrier", "c1_start", "t1") == 30_002
    assert filled.travel("carrier", "m1", "t1") == 20_001
    assert filled.travel("carrier", "t1", "m1") is None


def test_no_way_round_leads_over_a_target() -> None:
    situation = one_room()
    table = situation.travel_ms["carrier"].copy()
    index = situation.place_index
    table[index["c1_start"], index["m1"]] = table[index["c1_start"], index["home"]] = UNREACHABLE
    table[index["c1_start"], index["t1"]] = table[index["t1"], index["m1"]] = 5
    torn = replace(situation, travel_ms=dict(situation.travel_ms) | {"carrier": table})
    assert Detours(torn).situation.travel("carrier", "c1_start", "m1") is None


def test_the_plan_uses_existing_drives_only() -> None:
    situation = by_way_of_two()
    *improved, finished = Greedy().solve(situation, Budget(steps=2))
    assert finished.outcome is Outcome.SATISFICING
    (plan,) = [event.plan for event in improved if isinstance(event, Improved)]
    assert [(str(action), action.start_ms) for action in plan.actions] == [
        ("(move c1 c1_start m1)", 0),
        ("(move c1 m1 m2)", 10_001),
        ("(explore c1 m2 t1)", 20_002),
    ]
    assert check(situation, plan).valid
