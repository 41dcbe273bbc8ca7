"""Several engines as one: the lead at once, others beside it where they are of use, the best checked plan of all.

With a budget in seconds they run side by side and improvements are passed on as they come, those with a better score
(`marsupial.planning.score`) only. It is over at the end of the budget, when all have ended, or when one proves that
there is no plan. Once the makespan is proven optimal the lead goes on for as long again as it has taken, and a little
more, to get targets reached sooner, unless it has ended by itself.

With a budget in steps they run one after the other, each beginning with the best plan so far, so that the same steps
give the same plans.

An engine that crashes, or whose plans the checker refuses, costs nothing but its share of the processor.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Generator, Iterator
from contextlib import closing
from dataclasses import dataclass

from marsupial.model.plan import Plan
from marsupial.model.planning import Budget, Engine, EngineInfo, Finished, Improved
from marsupial.model.situation import Situation
from marsupial.planning.race import Clock, Race, crash
from marsupial.planning.standings import Standings

GRACE_S, FIRST_PLAN_S = 0.05, 1.0
"""How long after the end of the budget the lead may still finish the step it is in, with a plan and without any."""

POLISH_S = 0.1
"""How long the lead goes on at least where the makespan can't get shorter."""

GIVEN = "the one before"
"""Whose plan `start` is."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Member:
    """An engine of a portfolio.

    Parameters
    ----------
    make
        Makes it around a clock (seconds), which it has to keep its budget by unless its events can be cancelled.
    suits
        Whether it is of use in a situation.
    head_start_s
        How long the lead runs alone before it.
    """

    name: str
    make: Callable[[Clock], Engine]
    suits: Callable[[Situation], bool] = lambda situation: True
    head_start_s: float = 0.0


class Portfolio:
    """The engine; `clock` gives wall-clock seconds."""

    def __init__(
        self, info: EngineInfo, lead: Member, *beside: Member, clock: Callable[[], float] = time.perf_counter
    ) -> None:
        self.info = info
        self._lead, self._beside = lead, beside
        self._clock = clock

    def solve(
        self, situation: Situation, budget: Budget, *, start: Plan | None = None
    ) -> Iterator[Improved | Finished]:
        """Yield `start` if it is valid, the plans that are better, then `Finished`; see `Engine`."""
        begun = self._clock()
        standings = Standings(situation)
        if start is not None and standings.take(GIVEN, start):
            yield Improved(plan=start, elapsed_s=self._clock() - begun)
        members = (self._lead, *(member for member in self._beside if member.suits(situation)))
        if budget.seconds is None:
            events = self._in_turn(situation, budget, standings, members)
        else:
            events = self._side_by_side(situation, begun + budget.seconds, standings, members)
        with closing(events):
            for name, event in events:
                if isinstance(event, Finished):
                    standings.ended(name, event)
                elif standings.take(name, event.plan):
                    yield Improved(plan=event.plan, elapsed_s=self._clock() - begun)
        elapsed_s = self._clock() - begun
        time_is_up = budget.seconds is not None and elapsed_s >= budget.seconds
        yield standings.finished(elapsed_s, time_is_up=time_is_up)

    def _in_turn(
        self, situation: Situation, budget: Budget, standings: Standings, members: tuple[Member, ...]
    ) -> Generator[tuple[str, Improved | Finished]]:
        for member in members:
            try:
                engine = member.make(self._clock)
                if engine.info.deterministic_steps:
                    for event in engine.solve(situation, budget, start=standings.plan):
                        yield member.name, event
            except Exception as error:
                yield member.name, crash(error)
            if standings.optimal or standings.unsolvable:
                return

    def _side_by_side(
        self, situation: Situation, end: float, standings: Standings, members: tuple[Member, ...]
    ) -> Generator[tuple[str, Improved | Finished]]:
        begun = self._clock()
        lead, *waiting = members
        race = Race(situation, self._clock)
        race.enter(lead.name, lead.make, Budget(seconds=max(1e-3, end - begun)), standings.plan)
        proven = False
        try:
            while (race.running or waiting) and not standings.unsolvable:
                now = self._clock()
                grace_s = FIRST_PLAN_S if standings.plan is None else 0.0 if proven else GRACE_S
                alone = lead.name not in race.running
                if now >= end + grace_s or (alone and (now >= end or standings.optimal)):
                    return
                if standings.optimal and not proven:
                    proven, end = True, min(end, 2 * now - begun + POLISH_S)
                    continue
                while waiting and now < end and (now - begun >= waiting[0].head_start_s or not race.running):
                    member = waiting.pop(0)
                    race.enter(member.name, member.make, Budget(seconds=max(1e-3, end - now)), standings.plan)
                due = min([end + grace_s, *(begun + member.head_start_s for member in waiting[:1])])
                event = race.next(due - now)
                if event is not None:
                    yield event
        finally:
            race.stop()
