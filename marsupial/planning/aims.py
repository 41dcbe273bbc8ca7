"""Other aims than a short makespan, and the engines that can be given one."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Protocol, runtime_checkable

from marsupial.model.plan import EPSILON_MS, ActionName, Plan
from marsupial.model.planning import Engine


@dataclass(frozen=True, slots=True, kw_only=True)
class Aim:
    """What makes a plan better than another: the lower sum of prices.

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

    worth: Mapping[str, float]
    makespan: float
    driving: float
    undocking_ms: float

    @property
    def total_worth(self) -> float:
        """What all targets are worth together."""
        return sum(self.worth.values())

    def cost(self, plan: Plan) -> float:
        """Return the sum; each action counts with the gap after it, a target left out costs nothing."""
        price = self.makespan * self.total_worth * plan.makespan_ms
        for action in plan.actions:
            if action.name is ActionName.EXPLORE:
                price += self.worth[action.place] * (action.end_ms + EPSILON_MS)
            if action.origin is not None:
                price += self.driving * (action.duration_ms + EPSILON_MS)
            if action.name is ActionName.UNDOCK:
                price += self.undocking_ms
        return price


@runtime_checkable
class Aimable(Protocol):
    """An engine that can be given another aim than a short makespan."""

    def aimed(self, aim: Aim) -> Engine:
        """Return the engine whose plans get better by this aim."""
        ...
