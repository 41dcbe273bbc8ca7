"""The exact engine: plans with the shortest makespan, proven so, for small teams and few targets."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator

from marsupial.model.plan import EPSILON_MS, Plan
from marsupial.model.planning import Budget, EngineInfo, Finished, Improved, Outcome
from marsupial.model.robots import Role
from marsupial.model.situation import Situation
from marsupial.planning.anytime.bounds import makespan_bound_ms
from marsupial.planning.anytime.encoding import Ints, encode
from marsupial.planning.anytime.engine import Anytime
from marsupial.planning.checker import check
from marsupial.planning.exact.memory import MAX_CARRIERS, MAX_CODES, MAX_ROVERS, MAX_TARGETS
from marsupial.planning.exact.plans import plan_found
from marsupial.planning.exact.search import FOUND, LEVEL, LIMIT, LOST, NODES, Search, advance, root_bound_ms, search_of
from marsupial.planning.exact.tables import Tables, tables_of, timeless
from marsupial.planning.reachability import impossible

STEP = 2000
"""States entered between two looks at the clock."""

ANNEALING_STEPS = 100
"""How long the anytime engine looks for a good plan first."""

MEMORY_BYTES = 1 << 27
"""For states that have been seen."""


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
        task = encode(situation)
        tables = tables_of(task)
        effort = _Effort(budget, self._clock, begun)
        if best is None:
            search = _search(timeless(tables), EPSILON_MS, keyed=False)
            for found in _found(timeless(tables), search, EPSILON_MS, effort):
                best = plan_found(situation, task, tables, *found)
                yield Improved(plan=best, elapsed_s=self._clock() - begun)
            if best is None:
                yield _without_plan(search, self._clock() - begun)
                return
        limit = best.makespan_ms + EPSILON_MS
        bound = max(makespan_bound_ms(task), root_bound_ms(tables, limit) - EPSILON_MS)
        states = 0
        if bound < best.makespan_ms:
            search = _search(tables, limit)
            for found in _found(tables, search, limit, effort):
                best = plan_found(situation, task, tables, *found)
                yield Improved(plan=best, elapsed_s=self._clock() - begun)
            states = int(search.tallies[NODES])
            if _is_over(search):
                bound = best.makespan_ms
        yield _finished(best, bound, states, self._clock() - begun)


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
    return None


class _Effort:
    """How much of the budget is used."""

    def __init__(self, budget: Budget, clock: Callable[[], float], begun: float) -> None:
        self._budget, self._clock, self._begun, self._steps = budget, clock, begun, 0

    def goes_on(self) -> bool:
        """Count a step, and say whether it may be made."""
        self._steps += 1
        if self._budget.steps is not None:
            return self._steps <= self._budget.steps
        return self._clock() - self._begun < (self._budget.seconds or 0.0)


def _first_plans(situation: Situation, start: Plan | None) -> Iterator[Plan]:
    """Yield the plans to begin with: there may be none."""
    valid = start is not None and check(situation, start).valid
    for event in Anytime().solve(situation, Budget(steps=ANNEALING_STEPS), start=start if valid else None):
        if isinstance(event, Improved):
            yield event.plan


def _search(tables: Tables, limit: int, *, keyed: bool = True) -> Search:
    return search_of(tables, limit, MEMORY_BYTES // (8 * (len(tables.traits) + 3)), keyed=keyed)


def _found(tables: Tables, search: Search, limit: int, effort: _Effort) -> Iterator[tuple[Ints, Ints]]:
    """Yield what a search with that limit finds: events, and sets of targets explored after them."""
    told, going = limit, True
    while True:
        if search.tallies[LIMIT] < told:
            told = int(search.tallies[LIMIT])
            yield search.best[1 : search.tallies[FOUND]].copy(), search.shares.copy()
        if not going or not effort.goes_on():
            return
        going = advance(tables, search, STEP)


def _is_over(search: Search) -> bool:
    """Say whether a search has left nothing out."""
    return bool(search.tallies[LEVEL] < 0 and not search.tallies[LOST])


def _without_plan(search: Search, elapsed_s: float) -> Finished:
    if _is_over(search):
        outcome, detail = Outcome.UNSOLVABLE, "every way of setting down and picking up rovers has been tried"
    elif search.tallies[LEVEL] < 0:
        outcome, detail = Outcome.NO_PLAN, "no plan with a moderate number of docks and undocks"
    else:
        outcome, detail = Outcome.TIMEOUT, f"no plan among {search.tallies[NODES]} states"
    return Finished(outcome=outcome, detail=detail, elapsed_s=elapsed_s)


def _finished(best: Plan, bound: int, states: int, elapsed_s: float) -> Finished:
    optimal = bound >= best.makespan_ms
    return Finished(
        outcome=Outcome.OPTIMAL if optimal else Outcome.SATISFICING,
        detail=(
            f"the makespan is optimal, proven with {states} states"
            if optimal
            else f"no plan ends before {bound / 1000:.3f} s; nothing more proven with {states} states"
        ),
        elapsed_s=elapsed_s,
        lower_bound_ms=bound,
    )
