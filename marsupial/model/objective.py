"""The objectives of planning, which define when one plan is better than another.

*Makespan* is the paper's objective: the plan that ends first; among equals the one that reaches targets sooner, then
the one that drives less. *Priced arrival* is for missions in which most targets are still unknown: a sum of prices,
mainly for the time at which each target is reached.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum
from typing import ClassVar

from marsupial.model.plan import EPSILON_MS, ActionName, Plan
from marsupial.model.situation import Situation, TargetInfo

Value = tuple[float, ...]  # cost of a plan: lower is better; compared lexicographically


class ObjectiveName(StrEnum):
    """Names of the objectives, by which engines list the objectives they support."""

    MAKESPAN = "makespan"
    PRICED_ARRIVAL = "priced arrival"


@dataclass(frozen=True, slots=True)
class Makespan:
    """Minimises the makespan, then the weighted sum of the times at which targets are reached, then driving."""

    name: ClassVar[ObjectiveName] = ObjectiveName.MAKESPAN

    def weight(self, target: TargetInfo) -> int:
        """Return the weight of a target in thousandths: 1, plus 1 per m2 that it may reveal, times its priority."""
        weight = 1000 + round(1000 * target.reveal_m2)
        return weight if target.priority == 1 else round(target.priority * weight)

    def value(self, situation: Situation, plan: Plan) -> Value:
        """Return the makespan, the weighted sum of the times when targets are reached, and the driving time (ms)."""
        targets = situation.target_by_name
        # each action counts with the gap after it
        reaching = sum(
            self.weight(targets[a.place]) * (a.end_ms + EPSILON_MS)
            for a in plan.actions
            if a.name is ActionName.EXPLORE
        )
        driving = sum(a.duration_ms + EPSILON_MS for a in plan.actions if a.origin is not None)
        return (plan.makespan_ms + EPSILON_MS if plan.actions else 0, reaching, driving)


@dataclass(frozen=True, slots=True, kw_only=True)
class PricedArrival:
    """Minimises a sum of prices."""

    name: ClassVar[ObjectiveName] = ObjectiveName.PRICED_ARRIVAL

    worth: Mapping[str, float]  # price of each ms until a target is reached, by target
    makespan: float  # price of each ms of the makespan, as a share of the worth of all targets
    driving: float  # price of each ms that a robot drives

    @property
    def total_worth(self) -> float:
        """Worth of all targets together."""
        return sum(self.worth.values())

    def weight(self, target: TargetInfo) -> int:
        """Return the worth of a target in thousandths."""
        return round(1000 * self.worth[target.name])

    def value(self, situation: Situation, plan: Plan) -> Value:
        """Return the sum of prices; each action counts with the gap after it, an omitted target costs nothing."""
        price = self.makespan * self.total_worth * plan.makespan_ms
        for action in plan.actions:
            if action.name is ActionName.EXPLORE:
                price += self.worth[action.place] * (action.end_ms + EPSILON_MS)
            if action.origin is not None:
                price += self.driving * (action.duration_ms + EPSILON_MS)
        return (price,)


Objective = Makespan | PricedArrival

MAKESPAN = Makespan()
