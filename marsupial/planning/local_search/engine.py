"""The anytime engine: list scheduling's plan at once, then simulated annealing on the exact schedule.

For priced arrival, and where there is no target, it stops when it has converged (`budget_tracker`). Once the makespan
meets the lower bound, only the mean time at which targets are reached and the driving can get better; that gets as much
effort as before, and a little more. Where `marsupial.planning.greedy` finds no plan and none is given,
there is none: a search over plans needs one to begin with.
"""

import time
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import closing

from marsupial.arrays import Ints32
from marsupial.model import EPSILON_MS, MAKESPAN, Budget, Finished, Improved, Objective, Outcome, Plan, Situation, Value
from marsupial.planning import infos
from marsupial.planning.greedy import ROUNDS, Greedy
from marsupial.planning.incumbent import Incumbent
from marsupial.planning.local_search.bounds import makespan_bound_ms
from marsupial.planning.local_search.budget_tracker import BudgetTracker
from marsupial.planning.local_search.encoding import ProblemData, encode, events_of, plan_of
from marsupial.planning.local_search.search import Annealing, is_feasible


class ParallelSearches:
    """Several searches in threads, as compiled code does not hold the interpreter's lock; see `Annealing`.

    They take their steps together, so that the same steps give the same plans. The last run of each begins with the
    best list that any of them has found.
    """

    def __init__(
        self, data: ProblemData, beginnings: list[Ints32], bound_ms: int, size: int, objective: Objective = MAKESPAN
    ) -> None:
        self._searches = [Annealing(data, beginnings[i:] + beginnings[:i], bound_ms, i, objective) for i in range(size)]
        self._threads = ThreadPoolExecutor(max(1, size - 1), thread_name_prefix="anytime")

    def close(self) -> None:
        """End the threads."""
        self._threads.shutdown()

    @property
    def score(self) -> Value:
        return min(search.score for search in self._searches)

    @property
    def events(self) -> Ints32:
        """The best list so far."""
        return min(self._searches, key=lambda search: search.score).events

    def expect(self, steps: float) -> None:
        """Choose the number of runs for about `steps` steps."""
        for search in self._searches:
            search.expect(steps)

    def begin_round(self, steps: float) -> None:
        """Restart with the best list so far for about `steps` steps."""
        events = self.events
        for search in self._searches:
            search.begin_round(events, steps)

    def step(self, used: float, steps: int) -> None:
        """Take `steps` steps with each search; `used` is the used share of the budget, from 0 to 1."""
        if self._searches[0].is_last_run(used):
            events = self.events
            for search in self._searches:
                search.begin_last(events)
        others = [self._threads.submit(search.step, used, steps) for search in self._searches[1:]]
        self._searches[0].step(used, steps)
        for other in others:
            other.result()


LISTING_SHARE = 0.08  # largest share of a budget in seconds for all rounds of list scheduling but the first

SIZE = 2  # number of searches, each in a thread


class Anytime:
    """The engine; `clock` gives wall-clock seconds. In one step each of `searches` tries `search.STEP` changes.

    The first call in a process loads compiled code, which takes up to half a second: a service makes one before a robot
    waits. The first call ever compiles, for some twenty seconds. It proves nothing about priced arrival.
    """

    info = infos.ANYTIME

    def __init__(self, clock: Callable[[], float] = time.perf_counter, searches: int = SIZE) -> None:
        self._clock, self._searches = clock, searches

    def solve(
        self, situation: Situation, budget: Budget, *, objective: Objective = MAKESPAN, start: Plan | None = None
    ) -> Iterator[Improved | Finished]:
        begun = self._clock()
        shortest = objective == MAKESPAN
        incumbent = Incumbent(situation, objective)
        plans: list[Plan] = []
        if start is not None and incumbent.take(start):
            plans.append(start)
            yield Improved(plan=start, elapsed_s=self._clock() - begun)
        # list scheduling makes short plans: by another objective it is asked only where there is no start
        rounds = Budget(steps=ROUNDS) if budget.seconds is None else Budget(seconds=LISTING_SHARE * budget.seconds)
        for event in Greedy(self._clock).solve(situation, rounds) if shortest or not plans else ():
            if isinstance(event, Finished):
                if not plans:
                    yield event
                    return
                break
            plans.append(event.plan)
            if incumbent.take(event.plan):
                yield Improved(plan=event.plan, elapsed_s=self._clock() - begun)
        data = encode(situation, objective)
        bound_ms = makespan_bound_ms(data) if shortest else 0
        # robots wait for one plan after the other, as in missions, and no proof may end the search
        converges = not (shortest and situation.targets)
        tracker = BudgetTracker(budget, self._clock, begun, bound_ms, converges=converges)
        makespan_ms = min(plan.makespan_ms for plan in plans)
        for plan in self._improvements(situation, data, plans, tracker, objective):
            makespan_ms = plan.makespan_ms
            yield Improved(plan=plan, elapsed_s=self._clock() - begun)
        if shortest:
            yield _finished(makespan_ms, bound_ms, self._clock() - begun)
        else:
            detail = f"local search for {objective.name}, nothing proven"
            yield Finished(outcome=Outcome.SATISFICING, detail=detail, elapsed_s=self._clock() - begun)

    def _improvements(
        self, situation: Situation, data: ProblemData, plans: list[Plan], tracker: BudgetTracker, objective: Objective
    ) -> Iterator[Plan]:
        """Yield plans better than all of `plans`; the search begins with these, the best first."""
        plans = sorted(plans, key=lambda plan: objective.value(situation, plan))
        reported = objective.value(situation, plans[0])
        beginnings = [events_of(situation, plan) for plan in plans]
        beginnings = [events for events in beginnings if is_feasible(data, events)]
        if not beginnings or len(beginnings[0]) == 0:
            return
        bound_ms = tracker.bound_ms + EPSILON_MS
        with closing(ParallelSearches(data, beginnings, bound_ms, self._searches, objective)) as searches:
            best = searches.score
            while tracker.goes_on(best):
                if tracker.starts_round:
                    searches.begin_round(tracker.expected)
                searches.step(tracker.used, tracker.steps)
                if tracker.has_begun:
                    searches.expect(tracker.expected)
                best = searches.score
                if best < reported and tracker.should_report(best, reported):
                    reported = best
                    yield plan_of(situation, searches.events)
            if best < reported:
                yield plan_of(situation, searches.events)


def _finished(makespan_ms: int, bound_ms: int, elapsed_s: float) -> Finished:
    outcome, bound = Outcome.SATISFICING, f"no plan ends before {bound_ms / 1000:.3f} s"
    detail = f"annealing; {bound}"
    if makespan_ms <= bound_ms:
        outcome, detail = Outcome.OPTIMAL, f"{bound}: the makespan is optimal, the rest is as good as was found"
    return Finished(outcome=outcome, detail=detail, elapsed_s=elapsed_s, lower_bound_ms=bound_ms)
