"""The used share of a budget in seconds or in steps, and when to report a better plan.

A budget in steps is used in rounds whose lengths do not depend on it; the temperature follows from the share of the
round. So a search of few steps is the beginning of one of more steps, and more steps never give a worse plan. Where
nothing can be proven, a budget in seconds is used in the same rounds, until one of them, with as many steps as all
before it, has gained almost nothing; otherwise it is one round.
"""

import math
from collections.abc import Callable

from marsupial.model import EPSILON_MS, Budget, Value

POLISH_STEPS, POLISH_S = 50, 0.1  # effort after the makespan is proven optimal, for the other parts of the value
FIRST_ROUND = 8  # steps of the first round; each later one has as many as all before it
# a search has converged after a round that makes the plan better by less than this share, but not before so many steps;
# docs/planners.md has what more steps would gain
LEAST_GAIN, LEAST_STEPS = 0.01, 16

PAUSE_STEPS, PAUSE_S = 10, 0.02  # least effort between two reports, but a plan shorter by 1 % is reported at once
# of a search that converges, after the first report: nobody watches a mission's plan improve, and a report takes as
# long as several steps
CONVERGING_PAUSE_S = 0.5

SLICE_S, SLICE_SHARE = 0.01, 0.05  # longest time between two readings of the clock, also as a share of the budget


class BudgetTracker:
    """Tracks how much of a budget is used.

    No makespan is below `bound_ms`; with `converges` the rest of a budget in seconds is not used once the search has.
    """

    def __init__(
        self, budget: Budget, clock: Callable[[], float], begun: float, bound_ms: int, *, converges: bool = False
    ) -> None:
        self.bound_ms = bound_ms
        self.steps = 1  # to take in the current slice
        self._clock, self._begun = clock, begun
        self._timed = budget.seconds is not None
        self._end = float(budget.steps or 0) if budget.seconds is None else budget.seconds
        self._converges = converges and self._timed
        self._in_rounds = converges or not self._timed
        self._slice = min(SLICE_S, SLICE_SHARE * self._end)
        self._at_bound = self._has_converged = False
        self._slices = self._done = self._taken = 0
        self._spent = self._first = 0.0
        self._reported_at = -math.inf if self._converges else 0.0
        self._round_begun, self._round_steps, self._round_score = 0, FIRST_ROUND, math.inf

    @property
    def used(self) -> float:
        """The share of the budget in seconds, or of the round, used so far, from 0 to 1."""
        if self._in_rounds:
            return (self._taken - self._round_begun) / self._round_steps
        return min(1.0, self._spent / self._end)

    @property
    def has_begun(self) -> bool:
        """Whether one slice has been taken, or two: the first is short, and threads begin in it."""
        return 1 <= self._slices <= 2

    @property
    def expected(self) -> float:
        """The steps that a budget in seconds will suffice for at the pace so far, or those of the round."""
        if self._in_rounds:
            return self._round_steps
        return (self._end - self._first) / max(1e-6, self._now() - self._first) * self._done

    @property
    def starts_round(self) -> bool:
        """Whether a round but the first begins with this slice."""
        return self._in_rounds and 0 < self._round_begun == self._taken

    def goes_on(self, score: Value) -> bool:
        """Begin a slice of `steps`; return whether it is within the budget. The first one always is."""
        self._spent = self._now()
        if not self._slices:
            self._first = self._spent
        if not self._at_bound and score[0] - EPSILON_MS <= self.bound_ms:
            self._at_bound = True
            self._end = min(self._end, 2 * self._spent + (POLISH_S if self._timed else POLISH_STEPS))
        if self._in_rounds and self._done == self._round_begun + self._round_steps:
            gains = score[0] < (1 - LEAST_GAIN) * self._round_score
            self._has_converged = self._converges and self._done >= LEAST_STEPS and not gains
            self._round_begun, self._round_steps, self._round_score = self._done, self._done, score[0]
        goes_on = not self._slices or (self._spent < self._end and not self._has_converged)
        if self._timed and self._slices:
            per_step = (self._spent - self._first) / self._done
            self.steps = max(1, int(min(self._slice, self._end - self._spent) / max(1e-6, per_step)))
        if self._in_rounds:
            self.steps = min(self.steps, self._round_begun + self._round_steps - self._done)
        self._slices += 1
        self._taken = self._done
        self._done += self.steps
        return goes_on

    def should_report(self, score: Value, reported: Value) -> bool:
        """Return whether to report a better plan now; if so, remember when."""
        elapsed = self._spent - self._reported_at
        if self._converges:
            due = elapsed >= CONVERGING_PAUSE_S
        else:
            pause = PAUSE_S if self._timed else PAUSE_STEPS
            due = elapsed >= pause or (self._timed and score[0] < 0.99 * reported[0])
        if due:
            self._reported_at = self._spent
        return due

    def _now(self) -> float:
        return self._clock() - self._begun if self._timed else float(self._done)
