"""The objective of planning: what makes one plan better than another.

There are two. The *makespan* is what the paper minimises: the plan that is done soonest, then the one that reaches
targets sooner, then the one that drives less. *Priced arrival* is what missions ask for while most of the work has yet
to turn up: a sum of prices, above all of how late each target is reached.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum
from typing import ClassVar

from marsupial.model.plan import EPSILON_MS, ActionName, Plan
from marsupial.model.situation import Situation, TargetInfo

Value = tuple[float, ...]
"""How good a plan is by an objective: lower is better, the first part that differs decides."""


class ObjectiveName(StrEnum):
    """The objectives, by the names that engines list those with that they can take."""

    MAKESPAN = "makespan"
    PRICED_ARRIVAL = "priced arrival"


@dataclass(frozen=True, slots=True)
class Makespan:
    """The shortest makespan, then the least weighted time at which targets are reached, then the least driving."""

    name: ClassVar[ObjectiveName] = ObjectiveName.MAKESPAN

    def weight(self, target: TargetInfo) -> int:
        """Return what reaching a target sooner counts: in thousandths, 1 and 1 per m2 that it may reveal."""
        return 1000 + round(1000 * target.reveal_m2)

    def value(self, situation: Situation, plan: Plan) -> Value:
        """Return makespan (ms), sum of the times at which targets are reached (ms times weight), time driving (ms).

        Each action counts with the gap after it.
        """
        targets = situation.target_by_name
        reaching = sum(
            self.weight(targets[a.place]) * (a.end_ms + EPSILON_MS)
            for a in plan.actions
            if a.name is ActionName.EXPLORE
        )
        driving = sum(a.duration_ms + EPSILON_MS for a in plan.actions if a.origin is not None)
        return (plan.makespan_ms + EPSILON_MS if plan.actions else 0, reaching, driving)


@dataclass(frozen=True, slots=True, kw_only=True)
class PricedArrival:
    """The least sum of prices.

    Parameters
    ----------
    worth
        Of each target, by name: the price of each ms until it is reached.
    makespan
        The price of each ms of the makespan, as a share of what all targets are worth together.
    driving
        The price of each ms that a robot drives.
    undocking_ms
        The price of setting a rover down.
    """

    name: ClassVar[ObjectiveName] = ObjectiveName.PRICED_ARRIVAL

    worth: Mapping[str, float]
    makespan: float
    driving: float
    undocking_ms: float

    @property
    def total_worth(self) -> float:
        """What all targets are worth together."""
        return sum(self.worth.values())

    def weight(self, target: TargetInfo) -> int:
        """Return the worth of a target in thousandths."""
        return round(1000 * self.worth[target.name])

    def value(self, situation: Situation, plan: Plan) -> Value:
        """Return the sum; each action counts with the gap after it, a target left out costs nothing."""
        price = self.makespan * self.total_worth * plan.makespan_ms
        for action in plan.actions:
            if action.name is ActionName.EXPLORE:
                price += self.worth[action.place] * (action.end_ms + EPSILON_MS)
            if action.origin is not None:
                price += self.driving * (action.duration_ms + EPSILON_MS)
            if action.name is ActionName.UNDOCK:
                price += self.undocking_ms
        return (price,)


Objective = Makespan | PricedArrival

MAKESPAN = Makespan()
