"""Engines of other people, cut off when their budget is up.

marsupial's own engines look at the clock, and external ones are processes that are killed. An engine in this process
may do neither, and Python can't end a thread: so it searches in one of its own, which is left alone when the time is
up, and what it says from then on is heard by nobody. Until that thread ends the engine is not asked again.
"""

from __future__ import annotations

import time
from collections.abc import Iterator

from marsupial.model.objective import MAKESPAN, Objective
from marsupial.model.plan import Plan
from marsupial.model.planning import Budget, Engine, Finished, Improved, Outcome
from marsupial.model.situation import Situation
from marsupial.planning.race import PATIENCE_S, Race

GRACE_S = 0.25
"""Time after the end of its budget in which an engine may still yield."""


class Punctual:
    """An engine that is cut off `GRACE_S` after the end of a budget in seconds; budgets in steps are its own affair."""

    def __init__(self, engine: Engine) -> None:
        self.info = engine.info
        self._engine = engine
        self._last: Race | None = None

    def solve(
        self, situation: Situation, budget: Budget, *, objective: Objective = MAKESPAN, start: Plan | None = None
    ) -> Iterator[Improved | Finished]:
        """Yield what the engine yields in time, then `Finished`; see `Engine`."""
        if budget.seconds is None:
            yield from self._engine.solve(situation, budget, objective=objective, start=start)
            return
        if self._last is not None and self._last.alive:
            yield Finished(outcome=Outcome.TIMEOUT, detail="not asked: still busy with what it was asked before")
            return
        begun = time.monotonic()
        end, patience_s = begun + budget.seconds + GRACE_S, PATIENCE_S
        race = self._last = Race(time.monotonic)
        race.enter(self.info.name, lambda _: self._engine.solve(situation, budget, objective=objective, start=start))
        outcome = Outcome.TIMEOUT
        try:
            while race.running:
                said = race.next(end - time.monotonic())
                if said is None and race.running:
                    patience_s = 0.0
                    detail = f"cut off {GRACE_S:g} s after its budget of {budget.seconds:g} s"
                    yield Finished(outcome=outcome, detail=detail, elapsed_s=time.monotonic() - begun)
                    return
                if said is not None:
                    _, event = said
                    if isinstance(event, Exception):
                        raise event
                    outcome = Outcome.SATISFICING
                    yield event
        finally:
            race.stop(patience_s)


def punctual(engine: Engine) -> Engine:
    """Return an engine that is cut off when its budget is up; one that can't be used here as it is."""
    return engine if isinstance(engine, Punctual) or engine.info.missing is not None else Punctual(engine)
