"""The exact engine: plans with the shortest makespan, proven so, for small teams and few targets.

It begins with the plan of a short annealing and searches for shorter ones until there are none
(`marsupial.planning.exact.search`). Where neither list scheduling nor annealing has a plan, it first looks for any at
all, as if nothing took time: if there is none, that is proven. Where the budget is too small for a proof, the end of it
goes into proving that no plan is much shorter.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator

from marsupial.model.plan import EPSILON_MS, Plan
from marsupial.model.planning import Budget, EngineInfo, Finished, Improved, Outcome
from marsupial.model.robots import Role
from marsupial.model.situation import Situation
from marsupial.planning.anytime.bounds import makespan_bound_ms
from marsupial.planning.anytime.encoding import encode
from marsupial.planning.anytime.engine import Anytime
from marsupial.planning.checker import check
from marsupial.planning.exact.memory import MAX_CARRIERS, MAX_CODES, MAX_ROVERS, MAX_TARGETS
from marsupial.planning.exact.plans import plan_found
from marsupial.planning.exact.search import FOUND, LIMIT, LOST, NODES, advance, root_bound_ms, search_of
from marsupial.planning.exact.tables import Tables, tables_of, timeless
from marsupial.planning.reachability import impossible

STEP = 2000
"""States entered between two looks at the clock."""

ANNEALING_STEPS = 100
"""How long the anytime engine looks for a good plan first."""

MEMORY_BYTES = 1 << 27
"""For states that have been met."""

TABLES_BYTES = 1 << 26
"""For tours over sets of targets; all in all less than 256 MB are used."""

PROOF_SHARE = 0.8
"""Share of the budget for proving the best plan best; if that is not enough, the rest is for smaller bounds."""

STRIDES = 4
"""The next bound to prove lies this part of the gap higher."""


class Exact:
    """The engine; `clock` gives wall-clock seconds. One step of a budget is `STEP` states entered."""

    info = EngineInfo(
        name="exact",
        summary="branch and bound over docks and undocks; proves makespans best, up to a dozen targets",
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
        """Yield `start` if it is valid, plans that are shorter, then `Finished`; see `Engine`.

        The annealing at the beginning is not counted in steps.
        """
        begun = self._clock()
        complaint = unsupported(situation)
        if complaint is not None:
            yield Finished(outcome=Outcome.UNSUPPORTED, detail=complaint, elapsed_s=self._clock() - begun)
            return
        best: Plan | None = None
        for plan in _first_plans(situation, start):
            if best is None or plan.makespan_ms < best.makespan_ms:
                best = plan
                yield Improved(plan=plan, elapsed_s=self._clock() - begun)
        proof = impossible(situation) if best is None else None
        if proof is not None:
            yield Finished(outcome=Outcome.UNSOLVABLE, detail=proof, elapsed_s=self._clock() - begun)
            return
        proof_of = _Proof(situation, best, _Effort(budget, self._clock, begun))
        for plan in proof_of.plans():
            yield Improved(plan=plan, elapsed_s=self._clock() - begun)
        yield proof_of.finished(self._clock() - begun)


def unsupported(situation: Situation) -> str | None:
    """Return why a situation is too large for the engine, or None."""
    carriers, rovers = (len(situation.of_role(role)) for role in (Role.CARRIER, Role.ROVER))
    bases = len(situation.meetings) + sum(robot.place is not None for robot in situation.robots)
    for count, most, what in (
        (len(situation.targets), MAX_TARGETS, "targets"),
        (carriers, MAX_CARRIERS, "carriers"),
        (rovers, MAX_ROVERS, "rovers"),
        (bases + carriers, MAX_CODES - 1, "starts, meetings and carriers"),
    ):
        if count > most:
            return f"{count} {what}: the exact engine takes {most} at most"
    kinds, robots = len(situation.types), len(situation.robots)
    rows = bases * (kinds * len(situation.meetings) + robots * (2 + kinds))
    if 8 * rows << len(situation.targets) > TABLES_BYTES:
        return f"{len(situation.targets)} targets and {bases} starts and meetings: too many together"
    return None


class _Effort:
    """How much of the budget is used."""

    def __init__(self, budget: Budget, clock: Callable[[], float], begun: float) -> None:
        self._budget, self._clock, self._begun, self._steps = budget, clock, begun, 0

    def goes_on(self, share: float) -> bool:
        """Say whether a step may be made that belongs to that share of the budget, and if so count it."""
        if self._budget.seconds is not None:
            return self._clock() - self._begun < share * self._budget.seconds
        if self._steps >= share * (self._budget.steps or 0):
            return False
        self._steps += 1
        return True


class _Proof:
    """What is known of a situation so far: the `best` plan, and the `bound` that no plan ends before."""

    def __init__(self, situation: Situation, best: Plan | None, effort: _Effort) -> None:
        self._situation, self._effort = situation, effort
        self._task = encode(situation)
        self._tables = tables_of(self._task)
        self._best, self._bound_ms = best, 0
        self._states, self._ended = 0, Outcome.TIMEOUT

    def plans(self) -> Iterator[Plan]:
        """Yield ever better plans until the last one is proven best or the budget is used."""
        if self._best is None:
            yield from self._search(timeless(self._tables), 0, 1.0)
        if self._best is None:
            return
        root = root_bound_ms(self._tables, self._best.makespan_ms + EPSILON_MS) - EPSILON_MS
        self._bound_ms = max(makespan_bound_ms(self._task), root)
        if self._gap_ms > 0:
            yield from self._search(self._tables, self._best.makespan_ms, PROOF_SHARE)
        while self._gap_ms > 0 and self._ended is not Outcome.NO_PLAN and self._effort.goes_on(1.0):
            yield from self._search(self._tables, self._bound_ms + max(1, self._gap_ms // STRIDES), 1.0)

    @property
    def _gap_ms(self) -> int:
        return 0 if self._best is None else self._best.makespan_ms - self._bound_ms

    def _search(self, tables: Tables, below_ms: int, share: float) -> Iterator[Plan]:
        """Yield plans that end before `below_ms`; if the search comes to an end, none ends before the last one."""
        limit = told = below_ms + EPSILON_MS
        entries = MEMORY_BYTES // (8 * (len(tables.traits) + 3))
        search, going = search_of(tables, limit, entries, keyed=tables is self._tables), True
        while True:
            if search.tallies[LIMIT] < told:
                told = int(search.tallies[LIMIT])
                events = search.best[1 : search.tallies[FOUND]]
                self._best = plan_found(self._situation, self._task, self._tables, events, search.shares)
                yield self._best
            if not going or not self._effort.goes_on(share):
                break
            going = advance(tables, search, STEP)
        self._states += int(search.tallies[NODES])
        self._ended = Outcome.TIMEOUT
        if not going:
            self._ended = Outcome.NO_PLAN if search.tallies[LOST] else Outcome.UNSOLVABLE
        if self._ended is Outcome.UNSOLVABLE and self._best is not None and tables is self._tables:
            self._bound_ms = max(self._bound_ms, min(below_ms, self._best.makespan_ms))

    def finished(self, elapsed_s: float) -> Finished:
        """Return how it ended."""
        states = f"{self._states} states"
        if self._best is None:
            return Finished(outcome=self._ended, detail=_WITHOUT_PLAN[self._ended] + states, elapsed_s=elapsed_s)
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


def _first_plans(situation: Situation, start: Plan | None) -> Iterator[Plan]:
    """Yield the plans to begin with: there may be none."""
    valid = start is not None and check(situation, start).valid
    for event in Anytime().solve(situation, Budget(steps=ANNEALING_STEPS), start=start if valid else None):
        if isinstance(event, Improved):
            yield event.plan
