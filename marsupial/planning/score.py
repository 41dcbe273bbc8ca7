"""How plans for the same situation compare: by makespan, then by how soon targets are reached, then by driving."""

from __future__ import annotations

from marsupial.model.plan import EPSILON_MS, ActionName, Plan
from marsupial.model.situation import Situation, TargetInfo

Score = tuple[int, int, int]
"""Makespan (ms), the sum of the times at which targets are reached (ms times their worth), time spent driving (ms).

Each action counts with the gap after it. Lower is better, the first part that differs decides.
"""


def worth(target: TargetInfo) -> int:
    """Return what reaching a target sooner is worth: a thousandth each for being one and per m2 it may reveal."""
    return 1000 + round(1000 * target.reveal_m2)


def score(situation: Situation, plan: Plan) -> Score:
    """Return the score of a plan as it stands, gaps and all."""
    targets = situation.target_by_name
    reaching = sum(
        worth(targets[a.place]) * (a.end_ms + EPSILON_MS) for a in plan.actions if a.name is ActionName.EXPLORE
    )
    driving = sum(a.duration_ms + EPSILON_MS for a in plan.actions if a.origin is not None)
    return (plan.makespan_ms + EPSILON_MS if plan.actions else 0, reaching, driving)
