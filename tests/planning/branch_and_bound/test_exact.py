"""The exact engine against an independent exhaustive search over all actions of all robots in any order."""

import random
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from support.planning.drawn_situations import mixed_teams, situations
from support.planning.exhaustive import Everything, reduced
from support.planning.situations import SOLVABLE, many_rooms, two_rooms
from support.planning.spots import carrier, default_types, door, hall, room, rover, situation_of

from benchmarks.floors import Floor
from marsupial.model import UNREACHABLE, Budget, Finished, Improved, Outcome, Plan, Situation, SituationGoal
from marsupial.planning.branch_and_bound.engine import Exact
from marsupial.planning.checker import check
from marsupial.planning.greedy import Greedy

AMPLE = Budget(steps=1000)


def solve(
    situation: Situation, budget: Budget = AMPLE, start: Plan | None = None, latest: Plan | None = None
) -> tuple[list[Plan], Finished]:
    *improved, finished = Exact(latest=lambda: latest).solve(situation, budget, start=start)
    assert isinstance(finished, Finished)
    return [event.plan for event in improved if isinstance(event, Improved)], finished


def disturbed(situation: Situation, data: st.DataObject) -> Situation:
    """Return the situation with some roads closed and some times changed, so that detours may be shorter."""
    n = len(situation.places)
    changes = data.draw(
        st.lists(
            st.tuples(
                st.sampled_from([kind.name for kind in situation.types]),
                st.integers(0, n - 1),
                st.integers(0, n - 1),
                st.sampled_from([UNREACHABLE, 0, 1, 3, 20]),
            ),
            max_size=20,
        )
    )
    tables = {name: table.copy() for name, table in situation.travel_ms.items()}
    for name, origin, place, time in changes:
        tables[name][origin, place] = time
    return replace(situation, travel_ms=tables)


def confirm(situation: Situation) -> None:
    plans, finished = solve(situation)
    everything = Everything(situation)
    assert all(check(situation, plan).valid for plan in plans)
    assert all(one.makespan_ms > other.makespan_ms for one, other in pairwise(plans))
    if finished.outcome is Outcome.UNSOLVABLE:
        assert not plans
        assert not everything.has_plan()
    else:
        assert finished.outcome is Outcome.OPTIMAL, finished.detail
        assert finished.lower_bound_ms == plans[-1].makespan_ms
        assert not everything.has_plan_before(plans[-1].makespan_ms)


@pytest.mark.parametrize("name", SOLVABLE)
def test_every_hand_made_situation_is_solved_and_proven(name: str) -> None:
    situation = SOLVABLE[name]()
    plans, finished = solve(situation)
    assert finished.outcome is Outcome.OPTIMAL
    assert finished.lower_bound_ms == plans[-1].makespan_ms
    assert check(situation, plans[-1]).valid


@pytest.mark.parametrize("recover", [False, True])
@pytest.mark.parametrize("seed", range(4))
def test_two_carriers_with_two_rovers_are_proven(seed: int, recover: bool) -> None:
    situation = replace(many_rooms(2, 2, 8, 4, seed=seed), goal=SituationGoal(recover_rovers=recover))
    plans, finished = solve(situation, Budget(steps=2000))
    assert finished.outcome is Outcome.OPTIMAL
    assert check(situation, plans[-1]).valid


@pytest.mark.parametrize("targets", [2, 3, 4])
def test_few_targets_in_one_room_are_proven_for_eight_carriers_with_three_rovers_each(targets: int) -> None:
    situation = Floor(seed=0, carriers=8, rovers=3, targets=targets, rooms=1).situation()
    plans, finished = solve(situation, Budget(steps=1))
    assert finished.outcome is Outcome.OPTIMAL
    assert check(situation, plans[-1]).valid


def test_steps_decide_what_is_found() -> None:
    situation = replace(many_rooms(2, 2, 8, 6, seed=1), goal=SituationGoal(recover_rovers=True))
    one, other = (solve(situation, Budget(steps=3)) for _ in range(2))
    assert one[0] == other[0]
    assert one[1].outcome is Outcome.SATISFICING
    assert one[1].lower_bound_ms == other[1].lower_bound_ms
    assert 0 < (one[1].lower_bound_ms or 0) < one[0][-1].makespan_ms


@pytest.mark.parametrize(
    ("situation", "reason"), [(many_rooms(2, 2, 13, 4), "13 targets"), (many_rooms(4, 2, 12, 40), "too many together")]
)
def test_problems_too_large_for_tables_are_refused(situation: Situation, reason: str) -> None:
    plans, finished = solve(situation)
    assert (plans, finished.outcome) == ([], Outcome.UNSUPPORTED)
    assert reason in finished.detail


def test_a_start_that_is_best_is_proven_so() -> None:
    known = solve(two_rooms())[0][-1]
    (plan,), finished = solve(two_rooms(), start=known)
    assert plan == known
    assert finished.outcome is Outcome.OPTIMAL


def test_the_search_continues_from_a_better_plan_of_another_engine() -> None:
    situation = replace(many_rooms(2, 1, 6, 4), goal=SituationGoal(recover_rovers=True))
    (poor,) = (event.plan for event in Greedy().solve(situation, Budget(steps=1)) if isinstance(event, Improved))
    best = solve(situation)[0][-1]
    alone, beside = (solve(situation, Budget(steps=1), poor, latest)[0][-1] for latest in (None, best))
    assert alone.makespan_ms > best.makespan_ms
    assert beside == best


def test_closing_early_ends_the_search() -> None:
    events = Exact().solve(many_rooms(2, 2, 8, 6, seed=3), Budget(seconds=60))
    assert isinstance(next(iter(events)), Improved)
    events.close()  # type: ignore[attr-defined]


@given(situations())
def test_claims_of_optimality_and_unsolvability_are_true(situation: Situation) -> None:
    confirm(reduced(situation))


@given(st.booleans().flatmap(lambda seats: mixed_teams(seats=seats)))
def test_they_are_true_for_mixed_teams_with_and_without_seats(situation: Situation) -> None:
    confirm(reduced(situation))


@given(situations(), st.data())
def test_the_same_where_detours_are_shorter_and_roads_are_closed(situation: Situation, data: st.DataObject) -> None:
    confirm(disturbed(reduced(situation), data))


def drawn(seed: int, rooms: int = 2, pressure: bool = False) -> Situation:
    """Return a small, usually solvable situation: rooms with one or two doors, random times, few closed roads.

    With `pressure` every room has a target, and rovers start and end aboard.
    """
    draw = random.Random(seed)
    carriers, rovers = draw.choice([(1, 1), (1, 2), (1, 2), (2, 1), (2, 2)])
    targets, meetings = (rooms, rooms) if pressure else (draw.randint(1, 3), draw.randint(1, 3))
    capacity = draw.choice([1, 1, 2])
    aboard = [
        f"c{1 + i % carriers}" if i < capacity * carriers and draw.random() < 0.8 else None for i in range(rovers)
    ]
    homes = {"h": hall(0)} if draw.random() < 0.5 else {}
    robots = [carrier(i + 1, free_at_ms=draw.randrange(4), home="h" if homes else None) for i in range(carriers)]
    robots += [rover(i + 1, on, free_at_ms=draw.randrange(4)) for i, on in enumerate(aboard)]
    spots = {f"t{i}": hall(0) if draw.random() < 0.2 else room(0, draw.randrange(rooms)) for i in range(targets)}
    if pressure:
        spots = {f"t{i}": room(0, i) for i in range(rooms)}
    starts = {r.place: hall(0) if r.type == "carrier" else room(0, draw.randrange(2)) for r in robots if r.place}
    recover = pressure or draw.random() < 0.5
    situation = situation_of(
        robots,
        spots,
        {f"m{i}": door(0, i % rooms) for i in range(meetings)},
        starts,
        homes=homes,
        types=tuple(
            replace(kind, dock_ms=draw.randrange(5), undock_ms=draw.randrange(5)) for kind in default_types(capacity)
        ),
        goal=SituationGoal(recover_rovers=recover, return_home=recover and draw.random() < 0.5),
    )
    tables = {name: table.copy() for name, table in situation.travel_ms.items()}
    for table in tables.values():
        for i, j in np.argwhere(table == 0):
            table[i, j] = UNREACHABLE if draw.random() < 0.05 else draw.choice([0, 2, 5, 9, 14])
    return replace(situation, travel_ms=tables)


@pytest.mark.parametrize("seed", range(60))
def test_small_rooms_are_planned_as_well_as_by_trying_everything(seed: int) -> None:
    confirm(drawn(seed))


@pytest.mark.parametrize("seed", range(12))
def test_where_rovers_are_fewer_than_rooms_and_fetched_again_it_is_so_too(seed: int) -> None:
    confirm(drawn(seed, rooms=3, pressure=True))
