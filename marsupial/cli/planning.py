"""Asks an engine for plans and keeps the best one that the checker accepts; the work of `marsupial plan`."""

from __future__ import annotations

from collections.abc import Generator
from contextlib import closing
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from marsupial.cli.display.messages import say
from marsupial.cli.exit_codes import DONE, INVALID_PLAN, PLANNING_CODES
from marsupial.cli.first_use import prepare
from marsupial.cli.inputs import about, read_text
from marsupial.errors import SituationError
from marsupial.formats.pddl.text import read_problem
from marsupial.formats.situation import situation_from_json
from marsupial.model.plan import Plan
from marsupial.model.planning import Budget, Finished, Improved, Outcome
from marsupial.model.situation import Situation
from marsupial.planning.engines import engine
from marsupial.planning.incumbent import Incumbent
from marsupial.planning.local_search.bounds import makespan_bound_ms
from marsupial.planning.local_search.encoding import encode


@dataclass(frozen=True, slots=True, kw_only=True)
class Proposal:
    """One plan of the engine: when it came, how long it is, and what the checker has against it."""

    elapsed_s: float
    makespan_ms: int
    violation: str | None


@dataclass(slots=True, kw_only=True)
class Search:
    """What came of asking an engine: the incumbent, and a time no plan ends before if known."""

    situation: Situation
    planner: str
    incumbent: Incumbent
    proposals: list[Proposal] = field(default_factory=list)
    finished: Finished = field(default_factory=lambda: Finished(outcome=Outcome.NO_PLAN))
    bound_ms: int | None = None

    @property
    def plan(self) -> Plan | None:
        """The best plan that was accepted."""
        return self.incumbent.plan

    @property
    def gap(self) -> float | None:
        """What the makespan has above the lower bound, as a share of the makespan: 0 where it is optimal."""
        if self.plan is None or self.bound_ms is None:
            return None
        return (self.plan.makespan_ms - self.bound_ms) / max(1, self.plan.makespan_ms)

    @property
    def exit_code(self) -> int:
        """0 with a plan, 6 where only invalid ones came, else by the outcome."""
        if self.plan is not None:
            return DONE
        return INVALID_PLAN if self.proposals else PLANNING_CODES[self.finished.outcome]


def read_situation(path: Path) -> Situation:
    """Read a situation from JSON, or from PDDL where the name ends in ``.pddl``.

    Raises
    ------
    SituationError
        With every problem found.
    """
    text = read_text(path, SituationError)
    with about(path):
        return read_problem(text) if path.suffix.lower() == ".pddl" else situation_from_json(text)


def search(situation: Situation, planner: str, budget: Budget) -> Search:
    """Ask `planner` for plans and say on stderr what comes."""
    found = Search(situation=situation, planner=planner, incumbent=Incumbent(situation))
    if engine(planner).info.missing is None:
        prepare(planner)()
    with closing(_asked(planner, situation, budget)) as events:
        for event in events:
            if isinstance(event, Finished):
                found.finished = event
            else:
                _weigh(found, event)
    detail = f": {found.finished.detail}" if found.finished.detail else ""
    say(f"{planner}: {found.finished.outcome}{detail}")
    found.bound_ms = found.finished.lower_bound_ms
    if found.plan is not None:
        found.bound_ms = _bound_ms(situation, found.plan, found.finished)
        say(_judgement(found.plan.makespan_ms, found.bound_ms))
    return found


def search_json(found: Search) -> dict[str, Any]:
    """Return what `plan --json` prints besides the plan itself."""
    bound = found.bound_ms
    return {
        "planner": found.planner,
        "outcome": str(found.finished.outcome),
        "detail": found.finished.detail,
        "makespan_s": None if found.plan is None else found.plan.makespan_ms / 1000,
        "lower_bound_s": None if bound is None else bound / 1000,
        "gap": found.gap,
        "elapsed_s": found.finished.elapsed_s,
        "proposals": [
            {"elapsed_s": p.elapsed_s, "makespan_s": p.makespan_ms / 1000, "violation": p.violation}
            for p in found.proposals
        ],
    }


def _asked(planner: str, situation: Situation, budget: Budget) -> Generator[Improved | Finished]:
    """Ask an engine; closing this ends the engine."""
    yield from engine(planner).solve(situation, budget)


def _weigh(found: Search, event: Improved) -> None:
    found.incumbent.take(event.plan)
    fault, makespan_ms = found.incumbent.violation, event.plan.makespan_ms
    violation = None if fault is None else str(fault)
    found.proposals.append(Proposal(elapsed_s=event.elapsed_s, makespan_ms=makespan_ms, violation=violation))
    words = "" if violation is None else f", refused: {violation}"
    say(f"{event.elapsed_s:8.3f} s  makespan {makespan_ms / 1000:.3f} s, {len(event.plan.actions)} actions{words}")


def _bound_ms(situation: Situation, plan: Plan, end: Finished) -> int:
    """Return the better of the engine's bound and the one every situation has; one that `plan` refutes is none."""
    bounds = (end.lower_bound_ms, makespan_bound_ms(encode(situation)))
    return max((bound for bound in bounds if bound is not None and bound <= plan.makespan_ms), default=0)


def _judgement(makespan_ms: int, bound_ms: int) -> str:
    makespan = f"makespan {makespan_ms / 1000:.3f} s"
    if makespan_ms <= bound_ms:
        return f"{makespan}, optimal"
    return f"{makespan}, bound {bound_ms / 1000:.3f} s, gap {100 * (makespan_ms - bound_ms) / makespan_ms:.1f} %"
