"""An engine that plans part by part what another engine can't plan at once.

Its plans serve the targets of the parts only, and of those only where the engine found a plan in time: whoever uses
them checks them with ``check(situation, plan, targets=plan.explored)`` and plans again when they are done. Two parts
are planned at a time; each gets its share of the budget.
"""

from __future__ import annotations

import math
import queue
import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field, replace
from threading import Lock

from marsupial.errors import UsageError
from marsupial.model.plan import Plan
from marsupial.model.planning import Budget, Cancellable, Engine, EngineInfo, Finished, Improved, Outcome
from marsupial.model.robots import Role
from marsupial.model.situation import Situation
from marsupial.planning.checker import check
from marsupial.planning.external.decompose import PartSize, decompose, merge
from marsupial.planning.reachability import impossible

AT_A_TIME = 2


class Decomposed:
    """An engine around `engine` that splits what is too big for it; budgets are in seconds.

    Parameters
    ----------
    limits
        Sizes of parts, the biggest first; the first is taken for which a part's share of the budget suffices. With
        less than the last one needs, the parts that can begin soonest get that much and the others nothing.
    """

    def __init__(self, engine: Engine, *limits: PartSize) -> None:
        self._engine = engine
        self._limits = limits

    @property
    def info(self) -> EngineInfo:
        """That of the engine inside; plans cover the parts' targets only, nothing is proven of the whole."""
        inner = self._engine.info
        return replace(inner, summary=f"{inner.summary}; bigger situations in parts", proves_optimality=False)

    def solve(
        self, situation: Situation, budget: Budget, *, start: Plan | None = None
    ) -> Iterator[Improved | Finished]:
        """Yield plans for growing sets of targets, better ones for the same set, then `Finished`; see `Engine`.

        Where the situation fits as a whole, the engine inside does all. `start` is only of use then: plans that
        serve other targets can't be compared with it.
        """
        if budget.seconds is None:
            raise UsageError(f"{self._engine.info.name} in parts can't count steps: give it a budget in seconds")
        limit = self._limit(situation, budget.seconds)
        if limit.fits(situation):
            return self._engine.solve(situation, budget, start=start)
        return self._in_parts(situation, limit, budget.seconds)

    def _limit(self, situation: Situation, seconds: float) -> PartSize:
        """Return the size of parts by what each may use: at least one part per carrier, a few at a time."""
        rounds = math.ceil(len(situation.of_role(Role.CARRIER)) / AT_A_TIME)
        share = seconds / max(1, rounds)
        return next((limit for limit in self._limits if limit.seconds <= share), self._limits[-1])

    def _in_parts(self, situation: Situation, limit: PartSize, seconds: float) -> Iterator[Improved | Finished]:
        began = time.monotonic()
        parts = decompose(situation, limit)
        proof = None if parts else impossible(situation)
        if not parts:
            outcome = Outcome.NO_PLAN if proof is None else Outcome.UNSOLVABLE
            yield Finished(outcome=outcome, detail=proof or "no part has a target that it can reach")
            return
        work = _Work(engine=self._engine, parts=parts, until=began + seconds, least_s=limit.seconds)
        try:
            yield from work.improvements(situation, began)
        finally:
            work.stop()
        yield work.finished(time.monotonic() - began)


@dataclass(slots=True, kw_only=True)
class _Work:
    """The parts being planned by a few threads, which hand every event to the one that asks."""

    engine: Engine
    parts: tuple[Situation, ...]
    until: float
    least_s: float
    waiting: int = 0
    best: dict[int, Plan] = field(default_factory=dict)
    ends: dict[int, Finished] = field(default_factory=dict)
    running: set[Cancellable] = field(default_factory=set)
    stopped: bool = False
    lock: Lock = field(default_factory=Lock)
    pool: ThreadPoolExecutor = field(default_factory=lambda: ThreadPoolExecutor(AT_A_TIME))

    def improvements(self, situation: Situation, began: float) -> Iterator[Improved]:
        """Yield the merged plan each time a part's plan gets better, once it is valid as a whole."""
        events: queue.SimpleQueue[tuple[int, Improved | Finished | BaseException]] = queue.SimpleQueue()
        self.waiting = len(self.parts)
        for i in range(len(self.parts)):
            self.pool.submit(self._plan, i, events)
        while len(self.ends) < len(self.parts):
            i, event = events.get()
            if isinstance(event, BaseException):
                raise event
            if isinstance(event, Finished):
                self.ends[i] = event
                continue
            self.best[i] = event.plan
            plan = merge(self.best.values())
            if check(situation, plan, targets=plan.explored).valid:
                yield Improved(plan=plan, elapsed_s=time.monotonic() - began)

    def _plan(self, i: int, events: queue.SimpleQueue[tuple[int, Improved | Finished | BaseException]]) -> None:
        try:
            share = self._share()
            if share is None:
                events.put((i, Finished(outcome=Outcome.TIMEOUT, detail="no time was left for it")))
                return
            search = self.engine.solve(self.parts[i], share)
            with self.lock:
                if self.stopped:
                    return
                if isinstance(search, Cancellable):
                    self.running.add(search)
            for event in search:
                events.put((i, event))
        except BaseException as error:
            events.put((i, error))

    def _share(self) -> Budget | None:
        """Return what the next part may use: what is left of the time, shared by the rounds that are left."""
        with self.lock:
            left = self.until - time.monotonic()
            seconds = min(left, max(self.least_s, left / math.ceil(self.waiting / AT_A_TIME)))
            self.waiting -= 1
        return Budget(seconds=seconds) if seconds > 0 else None

    def stop(self) -> None:
        """End every search that is still running and wait for it."""
        with self.lock:
            self.stopped = True
            for search in self.running:
                search.cancel()
        self.pool.shutdown(wait=True, cancel_futures=True)

    def finished(self, elapsed_s: float) -> Finished:
        """Return the end of the whole: parts with a plan count, else how the first part ended."""
        covered = len(frozenset().union(*(plan.explored for plan in self.best.values())))
        detail = f"{len(self.best)} of {len(self.parts)} parts planned, {covered} targets in them"
        failures = [f"part {i + 1}: {end.outcome}" for i, end in sorted(self.ends.items()) if i not in self.best]
        if self.best:
            detail = "; ".join([detail, *failures])
            return Finished(outcome=Outcome.SATISFICING, detail=detail, elapsed_s=elapsed_s)
        first = self.ends[0]
        unsolvable = first.outcome is Outcome.UNSOLVABLE
        return Finished(
            outcome=Outcome.NO_PLAN if unsolvable else first.outcome,
            detail="; ".join([*failures, first.detail]),
            elapsed_s=elapsed_s,
        )
