from collections.abc import Iterable, Iterator

import pytest
from support.planning.situations import many_rooms, one_room, two_rooms
from support.waiting import HANG_S, doubling_budgets

from marsupial.bench.suite.catalogue import INSTANCES
from marsupial.model import MAKESPAN, Budget, Finished, Improved, Objective, Outcome, Plan, Situation
from marsupial.planning.auto import auto
from marsupial.planning.infos import AUTO
from marsupial.planning.portfolio.engine import Latest
from marsupial.planning.race import WallClock


class Prover:
    """Reports a lower bound at once."""

    info = AUTO

    def __init__(self, asked: list[Plan | None], bound_ms: int = 0) -> None:
        self._asked, self._bound_ms = asked, bound_ms

    def solve(
        self, situation: Situation, budget: Budget, *, objective: Objective = MAKESPAN, start: Plan | None = None
    ) -> Iterator[Improved | Finished]:
        self._asked.append(start)
        yield Finished(outcome=Outcome.OPTIMAL, lower_bound_ms=self._bound_ms)


@pytest.mark.parametrize("budget", [Budget(seconds=HANG_S), Budget(steps=5)])
def test_on_small_teams_an_exact_search_proves_the_plan_of_annealing(budget: Budget) -> None:
    asked: list[Plan | None] = []

    def exact(clock: WallClock, latest: Latest) -> Prover:
        return Prover(asked, bound_ms=72_007)

    *_, end = auto(exact).solve(two_rooms(), budget)
    assert end.outcome is Outcome.OPTIMAL
    assert "plan by anytime, its makespan proven optimal by exact" in end.detail
    assert len(asked) == 1


def test_with_few_targets_it_is_asked_for_teams_of_more_than_a_dozen_too() -> None:
    asked: list[Plan | None] = []
    list(auto(lambda clock, latest: Prover(asked)).solve(many_rooms(5, 2, 8, 4, seed=5), Budget(steps=2)))
    assert len(asked) == 1


@pytest.mark.parametrize("budgets", [(Budget(seconds=s) for s in doubling_budgets(0.1)), [Budget(steps=2)]])
def test_with_many_targets_it_is_not_asked(budgets: Iterable[Budget]) -> None:
    asked: list[Plan | None] = []
    for budget in budgets:
        *plans, end = auto(lambda clock, latest: Prover(asked)).solve(many_rooms(6, 3, 20, 8), budget)
        if plans and end.lower_bound_ms is not None:
            break
    else:
        pytest.fail("no plan with a bound")
    assert asked == []


def test_the_same_steps_give_the_same_plans() -> None:
    first, second = ([*auto().solve(many_rooms(2, 2, 8, 4), Budget(steps=10))] for _ in range(2))
    plans = [[event.plan for event in events if isinstance(event, Improved)] for events in (first, second)]
    assert plans[0] == plans[1]


def test_more_steps_never_give_a_longer_plan() -> None:
    situation = INSTANCES["mission-rooms-1x1-11"].situation()
    spans = []
    for steps in (8, 20, 40):
        events = auto().solve(situation, Budget(steps=steps))
        spans.append([event.plan for event in events if isinstance(event, Improved)][-1].makespan_ms)
    assert spans == sorted(spans, reverse=True)


def test_a_makespan_as_short_as_the_bound_needs_no_second_engine() -> None:
    asked: list[Plan | None] = []
    *_, end = auto(lambda clock, latest: Prover(asked)).solve(one_room(), Budget(steps=5))
    assert (end.outcome, end.lower_bound_ms) == (Outcome.OPTIMAL, 19_002)
    assert "proven optimal by anytime" in end.detail
    assert asked == []
