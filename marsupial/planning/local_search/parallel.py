"""Several searches side by side in threads: compiled code does not hold the interpreter's lock.

They take their steps together, so that the same steps give the same plans. The last run of each begins with the best
list that any of them has found.
"""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor

from marsupial.arrays import Ints32
from marsupial.model.objective import MAKESPAN, Objective, Value
from marsupial.planning.local_search.encoding import ProblemData
from marsupial.planning.local_search.search import Annealing


class ParallelSearches:
    """A number of searches in threads; for the other parameters see `Annealing`."""

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
        """The score of the best list."""
        return min(search.score for search in self._searches)

    @property
    def events(self) -> Ints32:
        """The best list so far."""
        return min(self._searches, key=lambda search: search.score).events

    def expect(self, steps: float) -> None:
        """Choose the number of runs for a budget of about that many steps."""
        for search in self._searches:
            search.expect(steps)

    def begin_round(self, steps: float) -> None:
        """Restart with the best list so far for about that many steps."""
        events = self.events
        for search in self._searches:
            search.begin_round(events, steps)

    def step(self, used: float, steps: int) -> None:
        """Take that many steps with each search; `used` is the used share of the budget, from 0 to 1."""
        if self._searches[0].is_last_run(used):
            events = self.events
            for search in self._searches:
                search.begin_last(events)
        others = [self._threads.submit(search.step, used, steps) for search in self._searches[1:]]
        self._searches[0].step(used, steps)
        for other in others:
            other.result()
