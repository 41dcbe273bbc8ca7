"""The anytime engine: list scheduling's plan at once, then simulated annealing on the exact schedule.

Once the makespan is as short as the lower bound, only the mean time at which targets are reached and the driving can
get better, and that gets as much effort as there has been so far, and a little more. Where `marsupial.planning.greedy`
finds no plan and none is given, there is none: a search over plans needs one to begin with.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator

from marsupial.model.plan import EPSILON_MS, Plan
from marsupial.model.planning import Budget, EngineInfo, Finished, Improved, Outcome
from marsupial.model.situation import Situation
from marsupial.planning.anytime.bounds import makespan_bound_ms
from marsupial.planning.anytime.encoding import Task, encode, events_of, plan_of
from marsupial.planning.anytime.search import Annealing
from marsupial.planning.checker import check
from marsupial.planning.greedy import ROUNDS, Greedy
from marsupial.planning.score import Score, score

POLISH_STEPS, POLISH_S = 50, 0.1
"""Effort still made where the makespan can't get shorter."""

PAUSE_STEPS, PAUSE_S = 10, 0.02
"""Least effort between two plans, unless the makespan gets a hundredth shorter."""


class Anytime:
    """The engine; `clock` gives wall-clock seconds. One step of a budget is `search.STEP` changes tried.

    Plans get better in their makespan, then in the mean time at which targets are reached, those that reveal more
    counting more, then in the time spent driving.
    """

    info = EngineInfo(
        name="anytime",
        summary="annealing on exact schedules; a plan at once, then better ones; proves some makespans best",
        licence="Apache-2.0",
        anytime=True,
        proves_optimality=True,
        deterministic_steps=True,
    )

    def __init__(self, clock: Callable[[], float] = time.perf_counter) -> None:
        self._clock = clock

    def solve(
        self, situation: Situation, budget: Budget, *, start: Plan | None = None
    ) -> Iterator[Improved | Finished]:
        """Yield `start` if it is valid, or list scheduling's plan, better ones, then `Finished`; see `Engine`.

        A `start` that the checker refuses is passed over. The first plan and one step come however small the budget.
        """
        begun = self._clock()
        plans = [start] if start is not None and check(situation, start).valid else []
        for plan in plans:
            yield Improved(plan=plan, elapsed_s=self._clock() - begun)
        listed = _listed(situation)
        if isinstance(listed, Plan):
            plans.append(listed)
        elif not plans:
            yield listed
            return
        if len(plans) == 1 and isinstance(listed, Plan):
            yield Improved(plan=listed, elapsed_s=self._clock() - begun)
        task = encode(situation)
        bound_ms = makespan_bound_ms(task)
        makespan_ms = plans[0].makespan_ms
        for plan in self._improvements(situation, task, plans, _Pace(budget, self._clock, begun, bound_ms)):
            makespan_ms = plan.makespan_ms
            yield Improved(plan=plan, elapsed_s=self._clock() - begun)
        yield _finished(makespan_ms, bound_ms, self._clock() - begun)

    def _improvements(self, situation: Situation, task: Task, plans: list[Plan], pace: _Pace) -> Iterator[Plan]:
        """Yield plans better than the first of `plans`, from the best of which the search begins."""
        told = score(situation, plans[0])
        searches = [Annealing(task, events_of(situation, plan)) for plan in plans]
        search = min((search for search in searches if search.feasible), key=lambda search: search.score, default=None)
        if search is None or not len(search.events):
            return
        while pace.goes_on(search.score):
            search.step(pace.used)
            if pace.has_begun:
                search.expect(pace.steps)
            if search.score < told and pace.is_due(search.score, told):
                told = search.score
                yield plan_of(situation, search.events)
        if search.score < told:
            yield plan_of(situation, search.events)


class _Pace:
    """How much of the budget is used, in seconds or in steps, and when it is time to tell of a better plan."""

    def __init__(self, budget: Budget, clock: Callable[[], float], begun: float, bound_ms: int) -> None:
        self._clock, self._begun = clock, begun
        self._bound_ms = bound_ms
        self._timed = budget.seconds is not None
        self._end = float(budget.steps or 0) if budget.seconds is None else budget.seconds
        self._at_bound = False
        self._done = 0
        self._spent = self._told = self._first = 0.0

    @property
    def used(self) -> float:
        """The share of the budget used so far, from 0 to 1."""
        return min(1.0, self._spent / self._end)

    @property
    def has_begun(self) -> bool:
        """Whether exactly one step is done."""
        return self._done == 1

    @property
    def steps(self) -> float:
        """How many steps the budget suffices for, judged by the first one if it is in seconds."""
        return (self._end - self._first) / max(1e-6, self._now() - self._first) if self._timed else self._end

    def goes_on(self, score: Score) -> bool:
        """Note that a step begins and say whether it may; the first one always may."""
        self._spent = self._now()
        if not self._done:
            self._first = self._spent
        if not self._at_bound and score[0] - EPSILON_MS <= self._bound_ms:
            self._at_bound = True
            self._end = min(self._end, 2 * self._spent + (POLISH_S if self._timed else POLISH_STEPS))
        self._done += 1
        return self._done == 1 or self._spent < self._end

    def _now(self) -> float:
        return self._clock() - self._begun if self._timed else float(self._done)

    def is_due(self, score: Score, told: Score) -> bool:
        """Say whether to tell of a better plan now, and if so note it."""
        pause = PAUSE_S if self._timed else PAUSE_STEPS
        due = score[0] < 0.99 * told[0] or self._spent - self._told >= pause
        if due:
            self._told = self._spent
        return due


def _listed(situation: Situation) -> Plan | Finished:
    """Return list scheduling's first plan, or how it ended without one."""
    event: Improved | Finished = Finished(outcome=Outcome.NO_PLAN)
    for event in Greedy().solve(situation, Budget(steps=ROUNDS)):
        if isinstance(event, Improved):
            return event.plan
    assert isinstance(event, Finished)
    return event


def _finished(makespan_ms: int, bound_ms: int, elapsed_s: float) -> Finished:
    optimal = makespan_ms <= bound_ms
    seconds = bound_ms / 1000
    return Finished(
        outcome=Outcome.OPTIMAL if optimal else Outcome.SATISFICING,
        detail=(
            f"no plan ends before {seconds:.3f} s: the makespan is optimal, the rest is as good as was found"
            if optimal
            else f"annealing; no plan ends before {seconds:.3f} s"
        ),
        elapsed_s=elapsed_s,
        lower_bound_ms=bound_ms,
    )
