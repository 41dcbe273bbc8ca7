"""The interface of planners: budgets in, improving plans and an outcome out.

A planner is an object with the `Engine` protocol. Its `solve` yields every improving plan and ends with one `Finished`.
If there is no plan, the `Outcome` says so; it is never an exception.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from enum import StrEnum
from typing import Protocol, runtime_checkable

from marsupial.errors import UsageError
from marsupial.model.arguments import number, whole
from marsupial.model.bounds import BOUNDS, Bound
from marsupial.model.objective import MAKESPAN, Objective, ObjectiveName
from marsupial.model.plan import Plan
from marsupial.model.situation import Situation

NO_PLANNER = "none"  # planner name of strategies without a planner

_POSITIVE = Bound(0, math.inf, "s", above=True)


class Outcome(StrEnum):
    """How a planner's run ended."""

    OPTIMAL = "optimal"  # the last plan is proven best
    SATISFICING = "satisficing"  # there is a plan, nothing is proven
    UNSOLVABLE = "unsolvable"  # proven: no plan exists
    NO_PLAN = "no_plan"  # gave up without a plan and without a proof
    TIMEOUT = "timeout"  # budget used up without a plan
    MEMORY = "memory"  # memory limit hit without a plan
    CRASHED = "crashed"  # the engine crashed: signal or exit code in the detail
    KILLED = "killed"  # another process killed it, or it was cancelled
    UNSUPPORTED = "unsupported"  # the engine can't represent this situation


@dataclass(frozen=True, slots=True, kw_only=True)
class Budget:
    """Limit of one planning call: wall-clock seconds, or deterministic steps. Exactly one is set."""

    seconds: float | None = None
    steps: int | None = None

    def __post_init__(self) -> None:
        if (self.seconds is None) == (self.steps is None):
            raise UsageError("a budget is either a number of seconds or a number of steps")
        # convert numpy numbers to plain ones
        if self.seconds is not None:
            object.__setattr__(self, "seconds", number("budget", self.seconds, _POSITIVE))
        if self.steps is not None:
            object.__setattr__(self, "steps", whole("steps", self.steps, BOUNDS["budget_steps"]))


@dataclass(frozen=True, slots=True, kw_only=True)
class Improved:
    """A plan better than all before it, `elapsed_s` wall-clock seconds after the engine was asked."""

    plan: Plan
    elapsed_s: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Finished:
    """Last event of a run: the outcome, details for users, and a lower bound on the makespan if known."""

    outcome: Outcome
    detail: str = ""
    elapsed_s: float = 0.0
    lower_bound_ms: int | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class EngineInfo:
    """Description of an engine for `marsupial planners`; `missing` is the reason why it can't be used here, or None."""

    name: str
    summary: str = ""
    licence: str = "not known"
    anytime: bool = False
    proves_optimality: bool = False
    deterministic_steps: bool = False
    objectives: tuple[ObjectiveName, ...] = (ObjectiveName.MAKESPAN,)
    missing: str | None = None

    def require(self, objective: Objective) -> None:
        """Raise UsageError if the engine does not support an objective."""
        if objective.name not in self.objectives:
            raise UsageError(f"planner {self.name} can't plan for {objective.name}, only for {self.objectives[0]}")


class Engine(Protocol):
    """Turns a situation and a budget into a stream of improving plans."""

    @property
    def info(self) -> EngineInfo:
        """Its description, and whether it can be used on this machine."""

    def solve(
        self, situation: Situation, budget: Budget, *, objective: Objective = MAKESPAN, start: Plan | None = None
    ) -> Iterator[Improved | Finished]:
        """Yield plans that improve by `objective`, then exactly one `Finished`.

        `start` is a valid plan for `situation`, as a first candidate. Closing the iterator early stops the engine and
        everything it started. Plans need not be valid: callers check them (`marsupial.planning.incumbent`).

        Raise `EngineUnavailable` if the engine is not installed here, and `UsageError` if it does not support that kind
        of budget, or the objective (`info.objectives`).
        """


@runtime_checkable
class Cancellable(Protocol):
    """The iterator of an engine whose search can be cancelled from another thread."""

    def cancel(self) -> None:
        """Request the end; returns at once."""
