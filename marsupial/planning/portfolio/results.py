"""The results of a portfolio's members so far: the incumbent, what is proven, how members ended."""

from __future__ import annotations

from collections import Counter

from marsupial.model.objective import Objective
from marsupial.model.plan import Plan
from marsupial.model.planning import Finished, Outcome
from marsupial.model.situation import Situation
from marsupial.planning.incumbent import Incumbent
from marsupial.wording import counted

_FAILURES = frozenset({Outcome.CRASHED, Outcome.KILLED, Outcome.MEMORY})
_LAST_TO_REPORT = (Outcome.UNSUPPORTED, *_FAILURES)


class Results:
    """Who has found and proven what, by the engines' names, for one situation. Proofs are of makespans."""

    def __init__(self, situation: Situation, objective: Objective) -> None:
        self._incumbent = Incumbent(situation, objective)
        self._finder = ""
        self._shortest_ms: dict[str, int] = {}
        self._bounds_ms: dict[str, int] = {}
        self._ends: dict[str, Finished] = {}
        self._refused: Counter[str] = Counter()

    @property
    def plan(self) -> Plan | None:
        """The best plan of all."""
        return self._incumbent.plan

    def take(self, name: str, plan: Plan) -> bool:
        """Take a plan of an engine; return whether it is the new incumbent."""
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
        trouble = [
            f"{name} {end.outcome}{f' ({end.detail})' if end.detail else ''}"
            for name, end in self._ends.items()
            if end.outcome in _FAILURES
        ]
        trouble += [f"{name}: {counted(count, 'plan')} refused by the checker" for name, count in self._refused.items()]
        return Finished(
            outcome=outcome,
            detail="; ".join([detail, *trouble]),
            elapsed_s=elapsed_s,
            lower_bound_ms=None if outcome is Outcome.UNSOLVABLE else self.bound_ms,
        )

    def _tenable(self) -> list[tuple[str, int]]:
        # A bound above a checked plan's makespan is wrong, whoever claims it.
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
