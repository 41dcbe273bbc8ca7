"""Unusual situations from files: every engine gives a clear result, none raises."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from support.planning.situations import (
    bring_them_home,
    many_rooms,
    no_capacity,
    one_hall,
    one_room,
    out_of_reach,
    two_rooms,
)
from support.planning.spots import Spot, carrier, door, hall, room, rover, situation_of
from support.waiting import doubling_budgets

from marsupial.model import UNREACHABLE, Budget, Engine, Finished, Improved, Outcome, Plan, Situation, SituationGoal
from marsupial.planning.checker import check
from marsupial.planning.engines import ENGINES

HOME = SituationGoal(recover_rovers=True, return_home=True)
ABOARD = SituationGoal(recover_rovers=True)


def no_rovers(spot: Spot) -> Situation:
    return situation_of([carrier()], {"t1": spot}, {"m1": door(1)}, {"c1_start": hall(0)})


def no_carriers(goal: SituationGoal | None = None) -> Situation:
    return situation_of([rover()], {"t1": room(10)}, {"m1": door(1)}, {"r1_start": room(0)}, goal=goal)


def rover_aboard(targets: dict[str, Spot], meetings: dict[str, Spot]) -> Situation:
    return situation_of([carrier(), rover(on="c1")], targets, meetings, {"c1_start": hall(0)})


def one_cell() -> Situation:
    """Return: all places are the same."""
    here = Spot(0, {"carrier": 0, "rover": 0})
    robots = [carrier(home="h"), rover(on="c1")]
    return situation_of(robots, {"t1": here}, {"m1": here}, {"c1_start": here}, homes={"h": here}, goal=HOME)


def cut(situation: Situation, *roads: tuple[str, str, str]) -> Situation:
    """Return the situation without some roads: type, from, to; the way back stays."""
    tables = {kind: table.copy() for kind, table in situation.travel_ms.items()}
    for kind, origin, place in roads:
        tables[kind][situation.place_index[origin], situation.place_index[place]] = UNREACHABLE
    return replace(situation, travel_ms=tables)


def timed(situation: Situation, ms: int) -> Situation:
    """Return the situation with the same travel time between all places."""
    tables = {kind: np.where(table > 0, ms, table) for kind, table in situation.travel_ms.items()}
    return replace(situation, travel_ms=tables)


def instant() -> Situation:
    situation = timed(two_rooms(), 0)
    return replace(situation, types=tuple(replace(kind, dock_ms=0, undock_ms=0) for kind in situation.types))


def late() -> Situation:
    situation = two_rooms()
    return replace(situation, robots=(replace(situation.robots[0], free_at_ms=10**12), situation.robots[1]))


def no_explorers() -> Situation:
    situation = one_hall()
    return replace(situation, targets=(situation.targets[0], replace(situation.targets[1], explorers=frozenset())))


def no_roads() -> Situation:
    situation = two_rooms()
    tables = {kind: np.full_like(table, UNREACHABLE) for kind, table in situation.travel_ms.items()}
    return replace(situation, travel_ms=tables)


SOLVABLE: dict[str, Callable[[], Situation]] = {
    "no types": lambda: Situation(types=(), robots=(), targets=(), meetings=(), travel_ms={}),
    "nothing at all": lambda: situation_of([], {}, {}, {}),
    "no targets": lambda: replace(rover_aboard({}, {"m1": door(1)}), goal=HOME),
    "no targets left": lambda: one_hall().restricted(targets=frozenset()),
    "no rovers": lambda: no_rovers(hall(10)),
    "no carriers": no_carriers,
    "no capacity": no_capacity,
    "no time": instant,
    "thirty years a road": lambda: timed(two_rooms(), 10**12),
    "thirty years home": lambda: timed(bring_them_home(), 10**12),
    "busy for years": late,
    "one cell": one_cell,
    "one road less": lambda: cut(two_rooms(), ("carrier", "c1_start", "m2")),
}

UNSOLVABLE: dict[str, tuple[Callable[[], Situation], str]] = {
    "no robots": (lambda: situation_of([], {"t1": hall(3)}, {"m1": door(1)}, {}), "t1"),
    "no rover for a room": (lambda: no_rovers(room(10)), "t1"),
    "no carrier to board": (lambda: no_carriers(ABOARD), "no place aboard for r1"),
    "no capacity to board": (lambda: replace(no_capacity(), goal=ABOARD), "no place aboard for r1"),
    "no meetings": (lambda: rover_aboard({"t1": room(10)}, {}), "t1"),
    "disconnected": (lambda: no_rovers(hall(10, 1)), "t1"),
    "out of reach": (out_of_reach, "t2"),
    "no explorers": (no_explorers, "t2"),
    "no roads": (no_roads, "t1"),
    "no way home": (
        lambda: replace(cut(one_room(), ("carrier", "m1", "home"), ("carrier", "c1_start", "home")), goal=HOME),
        "c1",
    ),
    "no way back from a target": (lambda: replace(cut(one_room(), ("rover", "t1", "m1")), goal=ABOARD), "t1"),
}

WITHOUT_A_PLAN: dict[str, Callable[[], Situation]] = {
    "the carrier is stuck at either door": lambda: cut(two_rooms(), ("carrier", "m1", "m2"), ("carrier", "m2", "m1")),
    "no way home from the door": lambda: replace(cut(one_room(), ("carrier", "m1", "home")), goal=HOME),
}
"""Situations without a plan, which only a search can prove."""


def engine(name: str) -> Engine:
    found = ENGINES[name]()
    if found.info.missing is not None:
        pytest.skip(found.info.missing)
    return found


def ask(asked: Engine, situation: Situation, seconds: float = 1.0) -> tuple[list[Plan], Finished]:
    budget = Budget(steps=3) if asked.info.deterministic_steps else Budget(seconds=seconds)
    *improved, finished = asked.solve(situation, budget)
    assert isinstance(finished, Finished)
    return [event.plan for event in improved if isinstance(event, Improved)], finished


PROMPT = [name for name in ENGINES if ENGINES[name]().info.deterministic_steps]
"""Engines that count steps; the others need a second per situation."""


def solves(name: str, situation: Situation) -> None:
    for seconds in doubling_budgets(1.0):
        plans, finished = ask(engine(name), situation, seconds)
        if plans or finished.outcome is not Outcome.TIMEOUT:
            break
    assert plans, finished
    assert all(check(situation, plan).valid for plan in plans)
    assert finished.outcome in (Outcome.SATISFICING, Outcome.OPTIMAL), finished


def gives_up(name: str, situation: Situation) -> None:
    plans, finished = ask(engine(name), situation)
    assert not plans
    assert finished.outcome in (Outcome.UNSOLVABLE, Outcome.NO_PLAN, Outcome.TIMEOUT), finished
    assert finished.detail


@pytest.mark.parametrize("name", PROMPT)
@pytest.mark.parametrize("case", SOLVABLE)
def test_odd_situations_that_have_a_plan_are_solved(name: str, case: str) -> None:
    solves(name, SOLVABLE[case]())


@pytest.mark.parametrize("name", ENGINES)
@pytest.mark.parametrize("case", UNSOLVABLE)
def test_impossible_targets_and_robots_are_named(name: str, case: str) -> None:
    make, named = UNSOLVABLE[case]
    plans, finished = ask(engine(name), make())
    assert not plans
    assert finished.outcome is Outcome.UNSOLVABLE, finished
    assert named in finished.detail


@pytest.mark.parametrize("name", PROMPT)
@pytest.mark.parametrize("case", WITHOUT_A_PLAN)
def test_situations_without_a_plan_end_with_a_reason(name: str, case: str) -> None:
    gives_up(name, WITHOUT_A_PLAN[case]())


@pytest.mark.slow
@pytest.mark.parametrize("name", sorted(set(ENGINES) - set(PROMPT)))
@pytest.mark.parametrize("case", [*SOLVABLE, *WITHOUT_A_PLAN])
def test_engines_with_processes_give_clear_results_too(name: str, case: str) -> None:
    if case in SOLVABLE:
        solves(name, SOLVABLE[case]())
    else:
        gives_up(name, WITHOUT_A_PLAN[case]())


@pytest.mark.parametrize("name", PROMPT)
@pytest.mark.parametrize("targets", [200, pytest.param(1000, marks=pytest.mark.slow)])
def test_engines_handle_very_many_targets(name: str, targets: int) -> None:
    situation = many_rooms(6, 3, targets, 20)
    plans, finished = ask(engine(name), situation)
    if finished.outcome is Outcome.UNSUPPORTED:
        assert f"{targets} targets" in finished.detail
    else:
        assert check(situation, plans[-1]).valid
