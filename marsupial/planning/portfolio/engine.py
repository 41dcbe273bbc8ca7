"""Several engines as one: a lead, others in parallel where useful, and the best checked plan of all.

With a budget in seconds they run side by side, and each new incumbent (`marsupial.planning.incumbent`) is yielded as it
comes; members can ask for the best plan of all at any time. The search ends at the end of the budget, when all members
have ended, or when one proves that there is no plan. Once the makespan is proven optimal, the lead continues for as
long again, and a little more, to reach targets sooner, from the plan of the member that found it; unless the lead has
already ended.

    lead       |-- plans -->----------------------|-- polish -->|    (makespan proven: others stop)
    member           |-- begins after its head start, gets the incumbent -->|
    incumbent  best checked plan of all, yielded when it gets better

With a budget in steps they run one after another, each from the best plan so far: the same steps give the same plans.
An engine that crashes, or whose plans the checker refuses, costs nothing but its share of the processor.
"""

import time
from collections import Counter
from collections.abc import Callable, Generator, Iterator
from contextlib import closing
from dataclasses import dataclass

from marsupial.model import MAKESPAN, Objective, Plan, Situation
from marsupial.model.planning import Budget, Engine, EngineInfo, Finished, Improved, Outcome
from marsupial.planning.incumbent import Incumbent
from marsupial.planning.race import EngineEvent, Race, WallClock
from marsupial.wording import counted

_FAILURES = frozenset({Outcome.CRASHED, Outcome.KILLED, Outcome.MEMORY})
_LAST_TO_REPORT = (Outcome.UNSUPPORTED, *_FAILURES)


class Results:
    """The plans and proofs of each engine, by name, for one situation. Proofs concern makespans."""

    def __init__(self, situation: Situation, objective: Objective) -> None:
        self.situation, self.objective = situation, objective
        self._incumbent = Incumbent(situation, objective)
        self._finder = ""
        self._shortest_ms: dict[str, int] = {}
        self._bounds_ms: dict[str, int] = {}
        self._ends: dict[str, Finished] = {}
        self._refused: Counter[str] = Counter()

    @property
    def plan(self) -> Plan | None:
        return self._incumbent.plan

    def take(self, name: str, plan: Plan) -> bool:
        """Accept a plan of an engine; return whether it is the new incumbent."""
        better = self._incumbent.take(plan)
        if self._incumbent.violation is not None:
            self._refused[name] += 1
        else:
            self._shortest_ms[name] = min(plan.makespan_ms, self._shortest_ms.get(name, plan.makespan_ms))
        if better:
            self._finder = name
        return better

    def ended(self, name: str, end: Finished) -> None:
        """Note how an engine ended. Where it says OPTIMAL without a bound, its shortest plan's makespan is one."""
        self._ends[name] = end
        bound_ms = end.lower_bound_ms
        if bound_ms is None and end.outcome is Outcome.OPTIMAL:
            bound_ms = self._shortest_ms.get(name)
        if bound_ms is not None:
            self._bounds_ms[name] = bound_ms

    @property
    def bound_ms(self) -> int | None:
        """The highest lower bound on the makespan that no plan refutes."""
        return max((bound for _, bound in self._tenable()), default=None)

    @property
    def optimal(self) -> bool:
        """Whether no plan can have a shorter makespan."""
        return self.plan is not None and self.plan.makespan_ms == self.bound_ms

    def has_shortest(self, name: str) -> bool:
        """Return whether the engine of that name found a plan with the best makespan itself."""
        return self.plan is not None and self._shortest_ms.get(name) == self.plan.makespan_ms

    @property
    def unsolvable(self) -> bool:
        """Whether it is proven that there is no plan."""
        return self.plan is None and any(end.outcome is Outcome.UNSOLVABLE for end in self._ends.values())

    def finished(self, elapsed_s: float, *, time_is_up: bool) -> Finished:
        """Return the joint result of all engines."""
        outcome, detail = self._without_plan(time_is_up) if self.plan is None else self._with_plan(self.plan)
        failed = {name: end for name, end in self._ends.items() if end.outcome in _FAILURES}
        trouble = [f"{name} {end.outcome}{f' ({end.detail})' if end.detail else ''}" for name, end in failed.items()]
        trouble += [f"{name}: {counted(count, 'plan')} refused by the checker" for name, count in self._refused.items()]
        return Finished(
            outcome=outcome,
            detail="; ".join([detail, *trouble]),
            elapsed_s=elapsed_s,
            lower_bound_ms=None if outcome is Outcome.UNSOLVABLE else self.bound_ms,
        )

    def _tenable(self) -> list[tuple[str, int]]:
        # A bound above a checked plan's makespan is wrong, whichever engine claims it.
        limit = None if self.plan is None else self.plan.makespan_ms
        return [(name, bound) for name, bound in self._bounds_ms.items() if limit is None or bound <= limit]

    def _with_plan(self, plan: Plan) -> tuple[Outcome, str]:
        if not self.optimal:
            return Outcome.SATISFICING, f"plan by {self._finder}, not proven best"
        prover = next(name for name, bound in self._tenable() if bound == plan.makespan_ms)
        return Outcome.OPTIMAL, f"plan by {self._finder}, its makespan proven optimal by {prover}"

    def _without_plan(self, time_is_up: bool) -> tuple[Outcome, str]:
        proof = next((end for end in self._ends.values() if end.outcome is Outcome.UNSOLVABLE), None)
        if proof is not None:
            return proof.outcome, proof.detail
        if time_is_up:
            return Outcome.TIMEOUT, "no engine had a plan in time"
        ends = sorted(self._ends.values(), key=lambda end: end.outcome in _LAST_TO_REPORT)
        reports = [end for end in ends if end.outcome not in (Outcome.OPTIMAL, Outcome.SATISFICING)]
        return (reports[0].outcome, reports[0].detail or "no plan") if reports else (Outcome.NO_PLAN, "no plan")


GRACE_S = 0.05  # time after the end of the budget in which engines may finish their step and report bounds
FIRST_PLAN_S = 1.0  # the same without a plan

POLISH_S = 0.1  # least time that the lead continues after the makespan is proven optimal
GIVEN = "the one before"  # name of the finder of `start`

Latest = Callable[[], Plan | None]


@dataclass(frozen=True, slots=True)
class PortfolioMember:
    """An engine of a portfolio."""

    name: str
    # makes the engine with a clock (seconds), which it has to keep its budget by unless its events can be cancelled,
    # and a function that returns the best plan of all so far
    make: Callable[[WallClock, Latest], Engine]
    suits: Callable[[Situation], bool] = lambda situation: True  # whether it is of use in a situation
    # how long the lead runs alone first; a member does not begin if less than twice this time is left
    head_start_s: float = 0.0


class Portfolio:
    """The engine; `clock` gives wall-clock seconds. The first of the members that suit a situation is in the lead."""

    def __init__(
        self, info: EngineInfo, *members: PortfolioMember, clock: Callable[[], float] = time.perf_counter
    ) -> None:
        self.info = info
        self._members = members
        self._clock = clock

    def solve(
        self, situation: Situation, budget: Budget, *, objective: Objective = MAKESPAN, start: Plan | None = None
    ) -> Iterator[Improved | Finished]:
        self.info.require(objective)
        begun = self._clock()
        results = Results(situation, objective)
        if start is not None and results.take(GIVEN, start):
            yield Improved(plan=start, elapsed_s=self._clock() - begun)
        members = tuple(member for member in self._members if member.suits(situation))
        if budget.seconds is None:
            events = self._in_turn(members, budget, results)
        else:
            events = _SideBySide(members, results, self._clock, begun + budget.seconds).events()
        with closing(events):
            for name, event in events:
                if isinstance(event, Improved):
                    if results.take(name, event.plan):
                        yield Improved(plan=event.plan, elapsed_s=self._clock() - begun)
                elif isinstance(event, Finished):
                    results.ended(name, event)
                else:
                    crash = f"{type(event).__name__}: {event}"
                    results.ended(name, Finished(outcome=Outcome.CRASHED, detail=crash))
        elapsed_s = self._clock() - begun
        time_is_up = budget.seconds is not None and elapsed_s >= budget.seconds
        yield results.finished(elapsed_s, time_is_up=time_is_up)

    def _in_turn(
        self, members: tuple[PortfolioMember, ...], budget: Budget, results: Results
    ) -> Generator[tuple[str, EngineEvent]]:
        for member in members:
            try:
                engine, start = member.make(self._clock, lambda: results.plan), results.plan
                if engine.info.deterministic_steps:
                    for event in engine.solve(results.situation, budget, objective=results.objective, start=start):
                        yield member.name, event
            except Exception as error:  # a crash ends this member only
                yield member.name, error
            if results.optimal or results.unsolvable:
                return


class _SideBySide:
    """The members of a portfolio in threads, the first of them in the lead, until a moment of the clock."""

    def __init__(self, members: tuple[PortfolioMember, ...], results: Results, clock: WallClock, end: float) -> None:
        self._lead, *self._waiting = members
        self._results, self._clock = results, clock
        self._begun, self._end = clock(), end
        self._proven = False
        self._race = Race(clock)

    def events(self) -> Generator[tuple[str, EngineEvent]]:
        """Yield the events of all members, for the caller to enter in the results; closing this stops them."""
        self._enter(self._lead)
        try:
            while self._goes_on():
                if self._results.optimal and not self._proven:
                    self._polish()
                self._let_in()
                due = min([self._end + self._grace_s, *(self._begun + m.head_start_s for m in self._waiting)])
                event = self._race.next(due - self._clock())
                if event is not None:
                    yield event
        finally:
            self._race.stop()

    def _goes_on(self) -> bool:
        if self._results.unsolvable or not (self._race.running or self._waiting):
            return False
        if self._results.optimal and self._lead.name not in self._race.running:
            return False
        return self._clock() < self._end + self._grace_s

    @property
    def _grace_s(self) -> float:
        if self._results.plan is None:
            return FIRST_PLAN_S
        return 0.0 if self._proven else GRACE_S

    def _polish(self) -> None:
        """Stop all but the lead and give it a little more time, with a plan of the optimal makespan."""
        now = self._clock()
        self._proven, self._waiting = True, []
        self._end = min(self._end, 2 * now - self._begun + POLISH_S)
        # With another member's plan the lead has to restart; with its own plan it continues.
        if not self._results.has_shortest(self._lead.name):
            self._race.stop()
            self._race = Race(self._clock)
            self._enter(self._lead)

    def _let_in(self) -> None:
        """Start the members whose head start is over, or all if no other runs."""
        now = self._clock()
        for member in tuple(self._waiting):
            if now - self._begun >= member.head_start_s or not self._race.running:
                self._waiting.remove(member)
                least_s = 2 * member.head_start_s if self._race.running else 0.0
                if self._end - now > least_s:
                    self._enter(member)

    def _enter(self, member: PortfolioMember) -> None:
        left, results = Budget(seconds=max(1e-3, self._end - self._clock())), self._results
        start = results.plan

        def search(clock: WallClock) -> Iterator[Improved | Finished]:
            engine = member.make(clock, lambda: results.plan)
            return engine.solve(results.situation, left, objective=results.objective, start=start)

        self._race.enter(member.name, search)
