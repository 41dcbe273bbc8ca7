import threading
import time
from collections.abc import Callable, Iterator
from typing import Self

import pytest
from support.planning.situations import one_hall
from support.waiting import HANG_S, wait_until

from marsupial.model.objective import MAKESPAN, Objective
from marsupial.model.plan import Action, ActionName, Plan
from marsupial.model.planning import Budget, EngineInfo, Finished, Improved, Outcome
from marsupial.model.situation import Situation
from marsupial.planning.portfolio.engine import GIVEN, Latest, Portfolio, PortfolioMember
from marsupial.planning.race import WallClock

INFO = EngineInfo(name="test", summary="", licence="", anytime=True, proves_optimality=True, deterministic_steps=True)
AMPLE, SHORT = Budget(seconds=HANG_S), Budget(seconds=0.1)
BOTH = (AMPLE, Budget(steps=3))
BEST_MS = 30_001
DONE = Finished(outcome=Outcome.SATISFICING)
INVALID = Plan(actions=())

Step = Improved | Finished | Exception | Callable[[WallClock], None]


def explore(start_ms: int, duration_ms: int, origin: str, target: str) -> Action:
    return Action(
        name=ActionName.EXPLORE, start_ms=start_ms, duration_ms=duration_ms, robot="c1", origin=origin, place=target
    )


def late(ms: int = 0) -> Plan:
    """Return the best plan of `one_hall`, delayed: 10 s to t1, then 20 s to t2."""
    return Plan.of([explore(ms, 10_000, "c1_start", "t1"), explore(ms + 10_001, 20_000, "t1", "t2")])


def roundabout() -> Plan:
    """Return a plan of `one_hall` that goes to the far target first."""
    return Plan.of([explore(0, 30_000, "c1_start", "t2"), explore(30_001, 20_000, "t2", "t1")])


def found(plan: Plan) -> Improved:
    return Improved(plan=plan, elapsed_s=0.0)


def optimal(bound_ms: int | None = BEST_MS) -> Finished:
    return Finished(outcome=Outcome.OPTIMAL, lower_bound_ms=bound_ms)


class Fake:
    """An engine with a script of steps: yield an event, raise an exception, or call a function with its clock."""

    info = INFO

    def __init__(self, clock: WallClock, steps: tuple[Step, ...], asked: list[tuple[Budget, Plan | None]]) -> None:
        self._clock, self._steps, self._asked = clock, steps, asked

    def solve(
        self, situation: Situation, budget: Budget, *, objective: Objective = MAKESPAN, start: Plan | None = None
    ) -> Iterator[Improved | Finished]:
        self._asked.append((budget, start))
        for step in self._steps:
            if isinstance(step, Exception):
                raise step
            if isinstance(step, (Improved, Finished)):
                yield step
            else:
                step(self._clock)


class Listening:
    """An engine that obeys `cancel` but ignores its clock."""

    info = INFO

    def __init__(self, clock: WallClock, latest: Latest) -> None:
        self._cancelled = threading.Event()

    def solve(
        self, situation: Situation, budget: Budget, *, objective: Objective = MAKESPAN, start: Plan | None = None
    ) -> Self:
        return self

    def __iter__(self) -> Self:
        return self

    def __next__(self) -> Improved | Finished:
        assert self._cancelled.wait(HANG_S)
        raise StopIteration

    def cancel(self) -> None:
        self._cancelled.set()


def never(clock: WallClock) -> None:
    """Search without a result until the time is up."""
    end_s = clock() + HANG_S
    while clock() < end_s:
        time.sleep(0.001)


def member(
    name: str, *steps: Step, asked: list[tuple[Budget, Plan | None]] | None = None, alone_s: float = 0
) -> PortfolioMember:
    calls = [] if asked is None else asked
    return PortfolioMember(name=name, make=lambda clock, latest: Fake(clock, steps, calls), head_start_s=alone_s)


class Watch:
    """A clock that stands still until `leap`, the last step of an engine."""

    def __init__(self) -> None:
        self._now_s = 0.0

    def __call__(self) -> float:
        return self._now_s

    def leap(self, clock: WallClock) -> None:
        """Advance beyond a short budget."""
        self._now_s = 1.0


def solve(
    *members: PortfolioMember,
    budget: Budget = AMPLE,
    start: Plan | None = None,
    situation: Situation | None = None,
    clock: WallClock = time.perf_counter,
) -> tuple[list[Plan], Finished]:
    asked = Portfolio(INFO, *members, clock=clock).solve(situation or one_hall(), budget, start=start)
    *improved, finished = asked
    assert isinstance(finished, Finished)
    return [event.plan for event in improved if isinstance(event, Improved)], finished


def threads() -> list[str]:
    return [thread.name for thread in threading.enumerate() if thread.name.startswith("planner ")]


@pytest.fixture(autouse=True)
def no_thread_left() -> Iterator[None]:
    yield
    wait_until(lambda: threads() == [])


@pytest.mark.parametrize("budget", BOTH)
def test_the_better_of_two_engines_plans_is_the_last(budget: Budget) -> None:
    plans, finished = solve(member("a", found(late(500)), DONE), member("b", found(late(20)), DONE), budget=budget)
    assert plans[-1] == late(20)
    assert finished.outcome is Outcome.SATISFICING
    assert "plan by b" in finished.detail


def test_plans_that_are_no_better_are_not_passed_on() -> None:
    plans, _ = solve(member("a", found(late(9)), found(late(30)), found(late(9)), found(late(2)), DONE))
    assert plans == [late(9), late(2)]


def test_of_equal_makespans_the_one_that_reaches_targets_sooner_is_better() -> None:
    waiting = Plan.of([explore(500, 30_000, "c1_start", "t2"), explore(30_501, 20_000, "t2", "t1")])
    sooner = Plan.of([explore(0, 30_000, "c1_start", "t2"), explore(30_501, 20_000, "t2", "t1")])
    assert waiting.makespan_ms == sooner.makespan_ms
    assert MAKESPAN.value(one_hall(), sooner) < MAKESPAN.value(one_hall(), waiting)
    assert solve(member("a", found(waiting), found(sooner), found(waiting), DONE))[0] == [waiting, sooner]


@pytest.mark.parametrize("budget", BOTH)
@pytest.mark.parametrize("before", [(), (found(roundabout()),)])
def test_an_engine_that_crashes_costs_nothing_and_is_named(before: tuple[Improved, ...], budget: Budget) -> None:
    good = member("good", found(late()), optimal())
    for crew in ((member("bad", *before, ValueError("no luck")), good), (good, member("bad", *before, ValueError()))):
        plans, finished = solve(*crew, budget=budget)
        assert plans[-1] == late()
        assert finished.outcome is Outcome.OPTIMAL
    _, finished = solve(member("bad", *before, ValueError("no luck")), good, budget=budget)
    assert "bad crashed (ValueError: no luck)" in finished.detail


@pytest.mark.parametrize("budget", BOTH)
def test_if_all_engines_crash_that_is_the_outcome(budget: Budget) -> None:
    plans, finished = solve(member("a", ValueError("one")), member("b", ValueError("two")), budget=budget)
    assert plans == []
    assert finished.outcome is Outcome.CRASHED
    assert "one" in finished.detail
    assert "two" in finished.detail


@pytest.mark.parametrize("budget", BOTH)
def test_plans_the_checker_refuses_are_not_passed_on_but_counted(budget: Budget) -> None:
    plans, finished = solve(member("bad", found(INVALID), DONE), member("good", found(late()), DONE), budget=budget)
    assert plans == [late()]
    assert "bad: 1 plan refused" in finished.detail


@pytest.mark.parametrize("quiet", [member("quiet", never), PortfolioMember(name="quiet", make=Listening)])
def test_engines_that_never_answer_are_stopped_at_the_end_of_the_budget(quiet: PortfolioMember) -> None:
    for quick_leads in (True, False):
        watch = Watch()
        quick = member("quick", found(late(7)), DONE, watch.leap)
        plans, finished = solve(*((quick, quiet) if quick_leads else (quiet, quick)), budget=SHORT, clock=watch)
        assert plans == [late(7)]
        assert finished.outcome is Outcome.SATISFICING


@pytest.mark.parametrize("quiet", [member("quiet", never), PortfolioMember(name="quiet", make=Listening)])
def test_without_a_plan_at_the_end_of_the_budget_the_time_was_too_short(quiet: PortfolioMember) -> None:
    plans, finished = solve(quiet, budget=SHORT)
    assert plans == []
    assert finished.outcome is Outcome.TIMEOUT


def test_a_proof_that_there_is_no_plan_ends_all() -> None:
    plans, finished = solve(
        member("quiet", never), member("prover", Finished(outcome=Outcome.UNSOLVABLE, detail="t2 is walled in"))
    )
    assert plans == []
    assert (finished.outcome, finished.detail) == (Outcome.UNSOLVABLE, "t2 is walled in")
    assert finished.lower_bound_ms is None


def test_a_valid_plan_outweighs_a_proof_that_there_is_none() -> None:
    plans, finished = solve(member("a", found(late()), Finished(outcome=Outcome.UNSOLVABLE)), member("b", DONE))
    assert plans == [late()]
    assert finished.outcome is Outcome.SATISFICING


def test_a_proof_by_one_of_anothers_plan_ends_all() -> None:
    plans, finished = solve(member("finder", found(late()), never), member("prover", optimal(), never))
    assert plans == [late()]
    assert finished.outcome is Outcome.OPTIMAL
    assert finished.lower_bound_ms == BEST_MS
    assert "plan by finder" in finished.detail
    assert "proven optimal by prover" in finished.detail


def test_once_the_makespan_is_proven_the_lead_still_gets_targets_reached_sooner() -> None:
    proven = threading.Event()
    slow, quick = late(3), late()
    watch = Watch()
    lead = member("lead", found(slow), lambda clock: wait_until(proven.is_set), found(quick), watch.leap, never)
    prover = member("prover", lambda clock: proven.set(), optimal(slow.makespan_ms), never)
    plans, finished = solve(lead, prover, clock=watch)
    assert plans == [slow, quick]
    assert finished.outcome is Outcome.SATISFICING  # the proof was wrong
    assert finished.lower_bound_ms is None


def test_the_lead_continues_from_a_proven_plan_of_another_engine() -> None:
    asked: list[tuple[Budget, Plan | None]] = []
    lead = member("lead", found(late(8)), never, asked=asked)
    plans, finished = solve(lead, member("prover", found(late()), optimal()))
    assert plans[-1] == late()
    assert finished.outcome is Outcome.OPTIMAL
    wait_until(lambda: threads() == [])
    assert [start for _, start in asked] == [None, late()]


@pytest.mark.parametrize("budget", BOTH)
def test_the_highest_bound_that_no_plan_refutes_counts(budget: Budget) -> None:
    bounds = (9_000, 12_000, 40_000)
    ends = [Finished(outcome=Outcome.SATISFICING, lower_bound_ms=bound) for bound in bounds]
    _, finished = solve(*(member(f"e{end.lower_bound_ms}", found(late()), end) for end in ends), budget=budget)
    assert (finished.outcome, finished.lower_bound_ms) == (Outcome.SATISFICING, 12_000)


def test_optimal_without_a_bound_means_the_engines_own_plan() -> None:
    _, finished = solve(member("a", found(late(4)), optimal(None)))
    assert (finished.outcome, finished.lower_bound_ms) == (Outcome.OPTIMAL, late(4).makespan_ms)
    _, finished = solve(member("b", found(late(1)), DONE), member("a", found(late(4)), optimal(None)))
    assert finished.outcome is Outcome.SATISFICING


@pytest.mark.parametrize("budget", BOTH)
def test_the_plan_given_comes_first_and_is_handed_on(budget: Budget) -> None:
    asked: list[tuple[Budget, Plan | None]] = []
    plans, finished = solve(member("a", DONE, asked=asked), start=late(5), budget=budget)
    assert plans == [late(5)]
    assert asked[0][1] == late(5)
    assert f"plan by {GIVEN}" in finished.detail


def test_a_plan_given_that_the_checker_refuses_is_passed_over() -> None:
    asked: list[tuple[Budget, Plan | None]] = []
    assert solve(member("a", found(late()), DONE, asked=asked), start=INVALID)[0] == [late()]
    assert asked[0][1] is None


def test_later_engines_start_from_the_best_plan_with_the_remaining_time() -> None:
    asked: list[tuple[Budget, Plan | None]] = []
    solve(member("lead", found(late(8)), never), member("late", DONE, asked=asked, alone_s=20), budget=SHORT)
    solve(member("lead", found(late(8)), DONE), member("late", DONE, asked=asked, alone_s=20))
    ((budget, start),) = asked
    assert start == late(8)
    assert budget.seconds is not None
    assert budget.seconds <= HANG_S


def test_with_steps_one_comes_after_the_other_until_one_has_proven_something() -> None:
    asked: list[tuple[Budget, Plan | None]] = []
    crew = (
        member("a", found(late(8)), DONE, asked=asked),
        member("b", found(late()), optimal(), asked=asked),
        member("c", DONE, asked=asked),
    )
    plans, finished = solve(*crew, budget=Budget(steps=3))
    assert plans == [late(8), late()]
    assert asked == [(Budget(steps=3), None), (Budget(steps=3), late(8))]
    assert finished.outcome is Outcome.OPTIMAL


@pytest.mark.parametrize("budget", BOTH)
def test_members_can_ask_for_the_best_plan_of_all_at_any_time(budget: Budget) -> None:
    told: list[Plan | None] = []

    def asking(clock: WallClock, latest: Latest) -> Fake:
        told.append(latest())
        return Fake(clock, (found(late(4)), lambda clock: told.append(latest()), DONE), [])

    solve(PortfolioMember(name="a", make=asking), budget=budget)
    assert told == [None, late(4)]


def test_an_engine_that_does_not_suit_is_not_asked() -> None:
    asked: list[tuple[Budget, Plan | None]] = []
    small = PortfolioMember(
        name="small",
        make=lambda clock, latest: Fake(clock, (DONE,), asked),
        suits=lambda situation: len(situation.targets) < 2,
    )
    for budget in BOTH:
        solve(member("a", found(late()), DONE), small, budget=budget)
    assert asked == []


@pytest.mark.parametrize("quiet", [member("quiet", never), PortfolioMember(name="quiet", make=Listening)])
def test_closing_early_stops_every_engine(quiet: PortfolioMember) -> None:
    events = Portfolio(INFO, member("lead", found(late()), never), quiet).solve(one_hall(), AMPLE)
    assert isinstance(next(iter(events)), Improved)
    assert len(threads()) == 2
    events.close()  # type: ignore[attr-defined]
    wait_until(lambda: threads() == [])
