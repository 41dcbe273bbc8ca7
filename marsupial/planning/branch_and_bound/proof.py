"""What is known of a situation so far, and the searches that close the gap: one from above, one from below.

The search from above is for any plan shorter than the best one. That is the quickest proof where the best plan is the
shortest there is; where it is far from that, such a search loses itself among the many ways to be a little better. So
if it takes long, another one takes turns with it that looks for plans that end before a moment little above the bound.
There are few ways to do so much: either it soon ends, which raises the bound, and the next search is for somewhat
longer plans, or it finds one. The first search that finds the shortest plan costs hardly more than its proof, and what
one finds is the limit of the other.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator

from marsupial.arrays import Ints
from marsupial.model.plan import EPSILON_MS, Plan
from marsupial.model.planning import Finished, Outcome
from marsupial.model.situation import Situation
from marsupial.planning.branch_and_bound import columns as col
from marsupial.planning.branch_and_bound.memory import entry_size
from marsupial.planning.branch_and_bound.plans import plan_found
from marsupial.planning.branch_and_bound.search import advance, root_bound_ms, search_of
from marsupial.planning.branch_and_bound.tables import Tables, tables_of, timeless
from marsupial.planning.local_search.bounds import makespan_bound_ms
from marsupial.planning.local_search.encoding import encode

STEP = 2000
"""States that a search enters before it is asked what it has found."""

MEMORY_BYTES = 1 << 26
"""For states that a search has met; there are two searches at most."""

PATIENCE = 20
"""How many steps the search from above is alone."""

STRIDES = 16
"""The first search from below is for plans that end before this part of the gap."""

SLOW, QUICK = 4, 2
"""By how many times longer a search from below may take than the one before (a step at least): above the one the next
stride is half as long, under the other it is twice as long."""


class Proof:
    """The `best` plan, and the bound that no plan ends before; `latest` is asked for better plans of others."""

    def __init__(self, situation: Situation, best: Plan | None, latest: Callable[[], Plan | None]) -> None:
        self._situation, self._latest = situation, latest
        self._data = encode(situation)
        self._tables = tables_of(self._data)
        self._best, self._bound_ms = best, 0
        self._states, self._without_plan = 0, Outcome.TIMEOUT

    def plans(self, goes_on: Callable[[], bool]) -> Iterator[Plan]:
        """Yield ever better plans until the last one is proven best or a step must not be made."""
        if self._best is None:
            yield from self._any(goes_on)
        if self._best is None:
            return
        root = root_bound_ms(self._tables, self._best.makespan_ms + EPSILON_MS) - EPSILON_MS
        self._bound_ms = max(makespan_bound_ms(self._data), root)
        yield from self._best_ones(goes_on)

    @property
    def _gap_ms(self) -> int:
        return 0 if self._best is None else self._best.makespan_ms - self._bound_ms

    def _any(self, goes_on: Callable[[], bool]) -> Iterator[Plan]:
        """Yield a plan as if nothing took time, if there is one."""
        sweep = Sweep(timeless(self._tables), 0, keyed=False)
        while sweep.goes_on and goes_on():
            sweep.advance()
            yield from self._found(sweep)
        self._states += sweep.states
        if not sweep.goes_on:
            self._without_plan = Outcome.NO_PLAN if sweep.lost else Outcome.UNSOLVABLE

    def _best_ones(self, goes_on: Callable[[], bool]) -> Iterator[Plan]:
        assert self._best is not None
        above, below = Sweep(self._tables, self._best.makespan_ms), _Rise(self._tables)
        steps = 0
        while self._gap_ms > 0 and not above.lost and goes_on():
            steps += 1
            rising = below.sweep(self._bound_ms, self._gap_ms) if steps > PATIENCE else None
            for sweep in (above, rising):
                if sweep is not None:
                    sweep.advance()
                    yield from self._found(sweep)
                    yield from self._adopted()
                    self._note(sweep)
        self._states += above.states + below.states

    def _found(self, sweep: Sweep) -> Iterator[Plan]:
        """Yield the last plan of a search if it is better."""
        if self._best is not None and sweep.limit_ms >= self._best.makespan_ms:
            return
        if sweep.has_found:
            self._best = plan_found(self._situation, self._data, self._tables, sweep.events, sweep.shares)
            yield self._best

    def _adopted(self) -> Iterator[Plan]:
        """Yield the plan of another engine if it is better."""
        plan = self._latest()
        if plan is not None and self._best is not None and plan.makespan_ms < self._best.makespan_ms:
            self._best = plan
            yield plan

    def _note(self, sweep: Sweep) -> None:
        """Take note of the end of a search, or let it know the best plan."""
        assert self._best is not None
        if sweep.goes_on:
            sweep.lower(self._best.makespan_ms)
        elif not sweep.lost:
            self._bound_ms = max(self._bound_ms, min(sweep.below_ms, self._best.makespan_ms))

    def finished(self, elapsed_s: float) -> Finished:
        """Return how it ended."""
        states = f"{self._states} states"
        if self._best is None:
            detail = _WITHOUT_PLAN[self._without_plan] + states
            return Finished(outcome=self._without_plan, detail=detail, elapsed_s=elapsed_s)
        seconds = self._bound_ms / 1000
        return Finished(
            outcome=Outcome.SATISFICING if self._gap_ms > 0 else Outcome.OPTIMAL,
            detail=f"no plan ends before {seconds:.3f} s, proven with {states}"
            if self._gap_ms > 0
            else f"the makespan is optimal, proven with {states}",
            elapsed_s=elapsed_s,
            lower_bound_ms=self._bound_ms,
        )


_WITHOUT_PLAN = {
    Outcome.UNSOLVABLE: "every way of setting down and picking up rovers has been tried: ",
    Outcome.NO_PLAN: "no plan found with a moderate number of docks and undocks: ",
    Outcome.TIMEOUT: "no plan found so far: ",
}


class Sweep:
    """A search for plans that end before `below_ms`, in steps. If it ends, none ends before the last one it found."""

    def __init__(self, tables: Tables, below_ms: int, *, keyed: bool = True) -> None:
        entries = MEMORY_BYTES // (8 * entry_size(len(tables.traits), tables.carriers))
        self._tables, self._search = tables, search_of(tables, below_ms + EPSILON_MS, entries, keyed=keyed)
        self.below_ms = below_ms
        self.goes_on = True

    def advance(self) -> None:
        """Make a step."""
        self.goes_on = self.goes_on and advance(self._tables, self._search, STEP)

    def lower(self, below_ms: int) -> None:
        """Look only for plans that end before then."""
        tallies = self._search.tallies
        tallies[col.LIMIT] = min(tallies[col.LIMIT], below_ms + EPSILON_MS)

    @property
    def limit_ms(self) -> int:
        """What plans have to end before: `below_ms`, the makespan of the last plan found, or what was told."""
        return int(self._search.tallies[col.LIMIT]) - EPSILON_MS

    @property
    def has_found(self) -> bool:
        """Whether it has found a plan."""
        return bool(self._search.tallies[col.FOUND])

    @property
    def lost(self) -> bool:
        """Whether something was left out for lack of space, so that its end proves nothing."""
        return bool(self._search.tallies[col.LOST])

    @property
    def states(self) -> int:
        """How many states it has entered."""
        return int(self._search.tallies[col.NODES])

    @property
    def events(self) -> Ints:
        """The docks and undocks (n, 7) of the last plan found."""
        return self._search.best[1 : self._search.tallies[col.FOUND]]

    @property
    def shares(self) -> Ints:
        """The sets (robots,) that are explored after them."""
        return self._search.shares


class _Rise:
    """The searches from below, one after the other."""

    def __init__(self, tables: Tables) -> None:
        self._tables = tables
        self._sweep: Sweep | None = None
        self._stride_ms, self._before, self._ended = 0, STEP, 0

    @property
    def states(self) -> int:
        """How many states they have entered."""
        return self._ended + (self._sweep.states if self._sweep is not None else 0)

    def sweep(self, bound_ms: int, gap_ms: int) -> Sweep | None:
        """Return the search that goes on, or the next one, or None if it would be the same as the one from above."""
        if self._sweep is None:
            self._stride_ms = max(1, gap_ms // STRIDES)
        elif self._sweep.goes_on:
            return self._sweep
        elif self._sweep.lost:
            return None
        else:
            self._adapt(max(STEP, self._sweep.states))
        if self._stride_ms >= gap_ms:
            return None
        self._ended = self.states
        self._sweep = Sweep(self._tables, bound_ms + self._stride_ms)
        return self._sweep

    def _adapt(self, states: int) -> None:
        if states > SLOW * self._before:
            self._stride_ms = max(1, self._stride_ms // 2)
        elif states < QUICK * self._before:
            self._stride_ms *= 2
        self._before = states
