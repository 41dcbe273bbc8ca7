"""`marsupial.plan`: run an engine and iterate over its improving plans that the checker accepts."""

from collections.abc import Generator, Iterator, Mapping
from contextlib import closing
from dataclasses import dataclass
from os import PathLike
from typing import Any

from marsupial.library.arguments import planner_argument
from marsupial.library.choices import DEFAULT_PLANNER, budget_of
from marsupial.library.first_use import prepare_planner
from marsupial.library.situations import situation_of
from marsupial.model import Budget, Engine, Finished, Improved, Outcome, Plan, Situation
from marsupial.model.arguments import instance
from marsupial.model.plan import checked_plan
from marsupial.planning import checker
from marsupial.planning.checker import Verdict
from marsupial.planning.engines import engine_of
from marsupial.planning.incumbent import Incumbent
from marsupial.planning.local_search.bounds import makespan_bound_ms
from marsupial.planning.local_search.encoding import encode
from marsupial.wording import counted


@dataclass(frozen=True, slots=True, kw_only=True)
class Proposal:
    """One plan of an engine: when it came, the checker's violation if any, and whether it is the best so far."""

    plan: Plan
    elapsed_s: float
    violation: str | None
    best: bool


class Plans(Iterator[Plan]):
    """The improving plans of one search, as they come. `close`, or garbage collection, ends the engine.

    `situation` is planned for, `proposals` are all plans of the engine so far, with those that the checker refused, and
    `finished` is how the engine ended, "no plan" before it has.
    """

    def __init__(self, situation: Situation, engine: Engine, budget: Budget) -> None:
        self.situation = situation
        self.proposals: list[Proposal] = []
        self.finished = Finished(outcome=Outcome.NO_PLAN)
        self._incumbent = Incumbent(situation)
        self._search = self._run(engine, budget)

    def __next__(self) -> Plan:
        """Return the next plan that is better than all before it."""
        return next(proposal.plan for proposal in self._search if proposal.best)

    def __repr__(self) -> str:
        best = "no plan yet" if self.best is None else f"makespan {self.best.makespan_ms / 1000:g} s"
        return f"<{counted(len(self.proposals), 'plan')} so far: {best}>"

    def all(self) -> Iterator[Proposal]:
        """Yield every further plan, better or not, accepted or not."""
        return self._search

    def close(self) -> None:
        """End the engine."""
        self._search.close()

    @property
    def best(self) -> Plan | None:
        """The best plan so far that the checker accepts."""
        return self._incumbent.plan

    @property
    def bound_ms(self) -> int | None:
        """The best lower bound on the makespan: the engine's proof, or a bound from the situation alone."""
        proven = self.finished.lower_bound_ms
        if self.best is None:
            return proven
        bounds = (proven, makespan_bound_ms(encode(self.situation)))
        return max((bound for bound in bounds if bound is not None and bound <= self.best.makespan_ms), default=0)

    @property
    def gap(self) -> float | None:
        """The gap of the best makespan above the lower bound, as a share of the makespan; 0 if it is optimal."""
        bound = self.bound_ms
        if self.best is None or bound is None:
            return None
        return (self.best.makespan_ms - bound) / max(1, self.best.makespan_ms)

    def _run(self, engine: Engine, budget: Budget) -> Generator[Proposal]:
        with closing(engine_events(engine, self.situation, budget)) as events:
            for event in events:
                if isinstance(event, Finished):
                    self.finished = event
                    continue
                best, found = self._incumbent.take(event.plan), self._incumbent.violation
                violation = None if found is None else str(found)
                proposal = Proposal(plan=event.plan, elapsed_s=event.elapsed_s, violation=violation, best=best)
                self.proposals.append(proposal)
                yield proposal


def plan(
    situation: Situation | Mapping[str, Any] | str | PathLike[str],
    planner: str | Engine = DEFAULT_PLANNER,
    budget: float | None = 1.0,
    *,
    steps: int | None = None,
) -> Plans:
    """Return an iterator of plans for a situation, each better than those before it and accepted by the checker.

    Parameters
    ----------
    situation
        A situation, its JSON as a dict, or the path of a ``situation.json`` or ``problem.pddl``.
    planner
        The name of an engine, ``cmd:COMMAND {domain} {problem}``, or an object (see `marsupial.Engine`).
    budget, steps
        Wall-clock seconds, or counted steps instead.

    Raises
    ------
    SituationError
        If the situation can't be planned for, with every problem found.
    EngineUnavailable, UsageError
        If the planner or budget can't be used; an engine may raise them with its first plan.
    """
    limit = budget_of(budget if steps is None else None, steps)
    found = engine_of(planner_argument(planner))
    wanted = situation_of(situation)
    # Compile before the budget runs. The caller's own engine is not tried: it may have side effects.
    if isinstance(planner, str) and found.info.missing is None:
        prepare_planner(planner)()
    return Plans(wanted, found, limit)


def check(situation: Situation, plan: Plan, *, targets: frozenset[str] | None = None) -> Verdict:
    """Check that `plan` can be carried out in `situation` and reaches the goal.

    `targets` names the targets to explore instead of all; the other goals are the situation's. The verdict has the
    earliest violation; among actions that start together, the first in the order of the plan. Raise a `UsageError` if
    an argument is of the wrong type.
    """
    if targets is not None:
        instance("targets", targets, frozenset)
    return checker.check(instance("situation", situation, Situation), checked_plan("plan", plan), targets=targets)


def engine_events(engine: Engine, situation: Situation, budget: Budget) -> Generator[Improved | Finished]:
    """Yield the events of an engine; closing this generator ends the engine, even one whose iterator has no `close`."""
    yield from engine.solve(situation, budget)
