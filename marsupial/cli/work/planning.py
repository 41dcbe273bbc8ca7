"""The work of `marsupial plan`: ask an engine for plans and print each as it arrives."""

from contextlib import closing
from typing import Any

from marsupial.cli.display.messages import say
from marsupial.cli.process.exit_codes import DONE, INVALID_PLAN, PLANNING_CODES
from marsupial.library.first_use import prepare_planner
from marsupial.library.plans import Plans, Proposal
from marsupial.model import EPSILON_MS, Budget, Situation
from marsupial.planning.engines import engine
from marsupial.wording import counted


def search(situation: Situation, planner: str, budget: Budget) -> Plans:
    """Ask `planner` for plans, and print a line for each on stderr."""
    asked = engine(planner)
    if asked.info.missing is None:
        prepare_planner(planner, say)()
    with closing(Plans(situation, asked, budget)) as found:
        for proposal in found.all():
            say(_line(proposal))
    detail = f": {found.finished.detail}" if found.finished.detail else ""
    say(f"{planner}: {found.finished.outcome}{detail}")
    if found.best is not None:
        say(_judgement(found.best.makespan_ms, found.bound_ms or 0))
    return found


def exit_code(found: Plans) -> int:
    """Return 0 with a plan, 6 if all plans were invalid, else by the outcome."""
    if found.best is not None:
        return DONE
    return INVALID_PLAN if found.proposals else PLANNING_CODES[found.finished.outcome]


def search_json(found: Plans, planner: str) -> dict[str, Any]:
    """Return the output of `plan --json` without the plan itself."""
    bound = found.bound_ms
    return {
        "planner": planner,
        "outcome": str(found.finished.outcome),
        "detail": found.finished.detail,
        "makespan_s": None if found.best is None else found.best.makespan_ms / 1000,
        "lower_bound_s": None if bound is None else bound / 1000,
        "gap": found.gap,
        "elapsed_s": found.finished.elapsed_s,
        "proposals": [
            {"elapsed_s": p.elapsed_s, "makespan_s": p.plan.makespan_ms / 1000, "violation": p.violation}
            for p in found.proposals
        ],
    }


def _line(proposal: Proposal) -> str:
    words = "" if proposal.violation is None else f", refused: {proposal.violation}"
    return (
        f"{proposal.elapsed_s:8.3f} s  makespan {proposal.plan.makespan_ms / 1000:.3f} s, "
        f"{counted(len(proposal.plan.actions), 'action')}{words}"
    )


def _judgement(makespan_ms: int, bound_ms: int) -> str:
    makespan = f"makespan {makespan_ms / 1000:.3f} s"
    if makespan_ms <= bound_ms:
        return f"{makespan}, optimal (to 1 ms, with {EPSILON_MS} ms between the actions of a robot)"
    return f"{makespan}, bound {bound_ms / 1000:.3f} s, gap {100 * (makespan_ms - bound_ms) / makespan_ms:.1f} %"
