import threading
from collections.abc import Iterator

import pytest
from support.planning.situations import two_rooms
from support.waiting import HANG_S

import marsupial
from marsupial.errors import UsageError
from marsupial.model.mission import Status
from marsupial.model.objective import MAKESPAN, Objective
from marsupial.model.plan import Plan
from marsupial.model.planning import Budget, EngineInfo, Finished, Improved, Outcome
from marsupial.model.situation import Situation
from marsupial.planning.greedy import Greedy
from marsupial.planning.race import Punctual

SHORT = Budget(seconds=0.01)


class Late:
    """Yields nothing, or only a first plan, until it is released."""

    info = EngineInfo(name="late", deterministic_steps=True)

    def __init__(self, *, after_a_plan: bool = False) -> None:
        self.released = threading.Event()
        self.asked: list[int] = []
        self._after_a_plan = after_a_plan

    def solve(
        self, situation: Situation, budget: Budget, *, objective: Objective = MAKESPAN, start: Plan | None = None
    ) -> Iterator[Improved | Finished]:
        self.asked.append(threading.get_ident())
        plan, end = Greedy().solve(situation, Budget(steps=1))
        if self._after_a_plan:
            yield plan
        if budget.steps is None:
            assert self.released.wait(HANG_S)
        yield plan
        yield end


@pytest.fixture
def late() -> Iterator[Late]:
    engine = Late()
    yield engine
    engine.released.set()


def last_of(engine: Punctual, budget: Budget) -> Finished:
    *_, end = engine.solve(two_rooms(), budget)
    assert isinstance(end, Finished)
    return end


def test_an_engine_that_ignores_the_clock_is_cut_off(late: Late) -> None:
    (end,) = Punctual(late).solve(two_rooms(), SHORT)
    assert (end.outcome, end.detail) == (Outcome.TIMEOUT, "cut off 0.25 s after its budget of 0.01 s")


def test_it_is_not_asked_again_until_it_has_ended(late: Late) -> None:
    engine = Punctual(late)
    last_of(engine, SHORT)
    assert "still busy" in last_of(engine, Budget(seconds=HANG_S)).detail
    assert len(late.asked) == 1
    late.released.set()
    while "still busy" in (end := last_of(engine, Budget(seconds=HANG_S))).detail:
        pass
    assert end.outcome is Outcome.SATISFICING


def test_plans_within_the_budget_count() -> None:
    late = Late(after_a_plan=True)
    plans = marsupial.plan(two_rooms(), late, budget=10 * HANG_S)
    first = next(plans)
    plans.close()
    assert plans.best == first
    late.released.set()


def test_counted_steps_take_as_long_as_they_take_in_the_same_thread(late: Late) -> None:
    assert last_of(Punctual(late), Budget(steps=1)).outcome is Outcome.SATISFICING
    assert late.asked == [threading.get_ident()]


def test_exceptions_of_an_engine_are_raised() -> None:
    class Raising(Late):
        def solve(self, *_: object, **__: object) -> Iterator[Improved | Finished]:
            raise UsageError("not like that")

    with pytest.raises(UsageError, match="not like that"):
        last_of(Punctual(Raising()), Budget(seconds=HANG_S))


def test_a_mission_continues_without_a_late_engine(late: Late) -> None:
    found = marsupial.explore("office", planner=late, budget=0.01)
    assert found.status is Status.COMPLETE
    assert len(late.asked) == 1
