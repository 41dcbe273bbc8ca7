"""An engine that splits situations too big for another engine into parts.

Its plans serve the targets of the parts only, and of those only where the engine found a plan in time: the caller
checks them with ``check(situation, plan, targets=plan.explored)`` and plans again when they are done. Two parts
are planned at a time; each gets its share of the budget.
"""

import math
import time
from collections import deque
from collections.abc import Generator, Iterator
from contextlib import closing
from dataclasses import replace

from marsupial.errors import UsageError
from marsupial.model import MAKESPAN, Budget, Engine, Finished, Improved, Objective, Outcome, Plan, Role
from marsupial.model.situation import Situation
from marsupial.planning.external.decompose import PartSize, decompose
from marsupial.planning.incumbent import Incumbent
from marsupial.planning.race import Race
from marsupial.planning.reachability import impossible

AT_A_TIME = 2


class Decomposed:
    """An engine around `engine` that splits what is too big for it; budgets are in seconds.

    Plans cover the parts' targets only, and nothing is proven of the whole.

    `limits`: sizes of parts, the biggest first; the first is taken for which a part's share of the budget suffices.
    If even the last size needs more, the parts that can begin soonest get enough time and the others none.
    """

    def __init__(self, engine: Engine, *limits: PartSize) -> None:
        self._engine, self._limits = engine, limits
        summary = f"{engine.info.summary}; bigger situations in parts"
        self.info = replace(engine.info, summary=summary, proves_optimality=False)

    def solve(
        self, situation: Situation, budget: Budget, *, objective: Objective = MAKESPAN, start: Plan | None = None
    ) -> Iterator[Improved | Finished]:
        # If the whole situation fits, the inner engine plans it all. `start` is useful only then: plans that serve
        # other targets can't be compared with it.
        if budget.seconds is None:
            name = self._engine.info.name
            raise UsageError(f"planner {name} in parts can't count steps: give it a budget in seconds")
        # Parts must be small enough for their time: at least one part per carrier, a few at a time.
        rounds = math.ceil(len(situation.of_role(Role.CARRIER)) / AT_A_TIME)
        share = budget.seconds / max(1, rounds)
        limit = next((one for one in self._limits if one.seconds <= share), self._limits[-1])
        if limit.fits(situation):
            return self._engine.solve(situation, budget, objective=objective, start=start)
        return self._in_parts(situation, limit, budget.seconds, objective)

    def _in_parts(
        self, situation: Situation, limit: PartSize, seconds: float, objective: Objective
    ) -> Iterator[Improved | Finished]:
        began = time.monotonic()
        parts = decompose(situation, limit)
        if not parts:
            proof = impossible(situation)
            outcome = Outcome.NO_PLAN if proof is None else Outcome.UNSOLVABLE
            yield Finished(outcome=outcome, detail=proof or "no part has a target that it can reach")
            return
        work = _Parts(self._engine, parts, objective, until=began + seconds, least_s=limit.seconds)
        incumbent = Incumbent(situation, objective, partial=True)
        with closing(work.plans()) as plans:
            for plan in plans:
                if incumbent.take(plan):
                    yield Improved(plan=plan, elapsed_s=time.monotonic() - began)
        yield work.finished(time.monotonic() - began)


class _Parts:
    """The parts being planned, a few at a time, until a time limit."""

    def __init__(
        self, engine: Engine, parts: tuple[Situation, ...], objective: Objective, *, until: float, least_s: float
    ) -> None:
        self._engine, self._objective, self._until, self._least_s = engine, objective, until, least_s
        self._parts, self._waiting = parts, deque(range(len(parts)))
        self._race = Race(time.monotonic)
        self._best: dict[int, Plan] = {}
        self._ends: dict[int, Finished] = {}

    def plans(self) -> Generator[Plan]:
        """Yield the merged plan each time a part's plan improves; closing the iterator ends every search."""
        try:
            while self._waiting or self._race.running:
                self._let_in()
                found = self._race.next() if self._race.running else None
                if found is None:
                    continue
                name, event = found
                if isinstance(event, Exception):
                    raise event
                if isinstance(event, Finished):
                    self._ends[int(name)] = event
                    continue
                self._best[int(name)] = event.plan
                yield Plan.of(action for plan in self._best.values() for action in plan.actions)
        finally:
            self._race.stop()

    def _let_in(self) -> None:
        while self._waiting and len(self._race.running) < AT_A_TIME:
            # the time left, shared by the rounds left
            left = self._until - time.monotonic()
            seconds = min(left, max(self._least_s, left / math.ceil(len(self._waiting) / AT_A_TIME)))
            i = self._waiting.popleft()
            if seconds > 0:
                self._enter(i, Budget(seconds=seconds))
            else:
                self._ends[i] = Finished(outcome=Outcome.TIMEOUT, detail="no time was left for it")

    def _enter(self, i: int, share: Budget) -> None:
        # A separate method, so that each search binds its part and share: the loop advances before they are used.
        self._race.enter(str(i), lambda _: self._engine.solve(self._parts[i], share, objective=self._objective))

    def finished(self, elapsed_s: float) -> Finished:
        """Return the joint result: by the parts with a plan, or else the first part's."""
        covered = len(frozenset().union(*(plan.explored for plan in self._best.values())))
        detail = f"{len(self._best)} of {len(self._parts)} parts planned, {covered} targets in them"
        failures = [f"part {i + 1}: {end.outcome}" for i, end in sorted(self._ends.items()) if i not in self._best]
        if self._best:
            detail = "; ".join([detail, *failures])
            return Finished(outcome=Outcome.SATISFICING, detail=detail, elapsed_s=elapsed_s)
        first = self._ends[0]
        # a part without a plan proves nothing about the whole
        outcome = Outcome.NO_PLAN if first.outcome is Outcome.UNSOLVABLE else first.outcome
        return Finished(outcome=outcome, detail="; ".join([*failures, first.detail]), elapsed_s=elapsed_s)
