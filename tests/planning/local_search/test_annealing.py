import threading
from contextlib import closing

from hypothesis import given
from support.planning.drawn_situations import situations
from support.planning.situations import SOLVABLE, many_rooms, one_room

from marsupial.model import MAKESPAN, Budget, Improved, Plan, Situation
from marsupial.planning.checker import check
from marsupial.planning.greedy import Greedy
from marsupial.planning.local_search.encoding import ProblemData, encode, events_of, plan_of
from marsupial.planning.local_search.engine import Anytime, ParallelSearches
from marsupial.planning.local_search.search import Annealing, is_feasible


def listed(situation: Situation) -> list[Plan]:
    return [event.plan for event in Greedy().solve(situation, Budget(steps=1)) if isinstance(event, Improved)]


def team(situation: Situation, size: int) -> tuple[ProblemData, ParallelSearches]:
    data = encode(situation)
    return data, ParallelSearches(data, [events_of(situation, plan) for plan in listed(situation)], 0, size)


def test_a_plan_of_list_scheduling_keeps_its_score() -> None:
    for make in SOLVABLE.values():
        situation = make()
        (plan,) = listed(situation)
        search = Annealing(encode(situation), [events_of(situation, plan)], 0)
        assert search.score == MAKESPAN.value(situation, plan)


@given(situations())
def test_incrementally_updated_times_are_those_of_the_plan(situation: Situation) -> None:
    for plan in listed(situation):
        events = events_of(situation, plan)
        if not len(events):
            return
        search = Annealing(encode(situation), [events], 0)
        for used in (0.0, 0.5, 0.9):
            search.step(used, 1)
            better = plan_of(situation, search.events)
            assert check(situation, better).valid, check(situation, better).violation
            assert search.score == MAKESPAN.value(situation, better)


def test_an_infeasible_plan_is_no_start() -> None:
    situation = one_room()
    (plan,) = listed(situation)
    events = events_of(situation, plan)
    assert is_feasible(encode(situation), events)
    assert not is_feasible(encode(situation), events[[0, 1, *range(len(events) - 1, 1, -1)]])


def test_two_searches_find_no_less_than_the_first_of_them() -> None:
    situation = many_rooms(3, 2, 12, 5, seed=1)
    _, alone = team(situation, 1)
    _, both = team(situation, 2)
    with closing(alone), closing(both):
        alone.step(0.0, 20)
        both.step(0.0, 20)
        assert both.score <= alone.score


def test_the_last_run_begins_with_the_best_of_all() -> None:
    situation = many_rooms(2, 2, 8, 4, seed=1)
    _, searches = team(situation, 2)
    with closing(searches):
        searches.expect(1000)
        searches.step(0.0, 10)
        best = searches.score
        searches.step(0.99, 1)
        assert searches.score <= best


def test_no_thread_outlives_the_iterator() -> None:
    before = set(threading.enumerate())
    with closing(Anytime().solve(many_rooms(2, 2, 8, 4, seed=2), Budget(seconds=60.0))) as events:  # type: ignore[type-var]
        for event in events:
            assert isinstance(event, Improved)
            if set(threading.enumerate()) > before:
                break
    assert set(threading.enumerate()) == before
