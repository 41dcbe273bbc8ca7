"""What passes between the mission loop and a strategy.

At each replanning the loop hands over a `Briefing` and follows the plan of the `Decision` it gets back, once the
checker has accepted it. A plan need not serve every target: whatever it leaves is decided at a later replanning.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import Protocol

from marsupial.model.arguments import instance
from marsupial.model.plan import Action, Plan, checked_plan
from marsupial.model.planning import Outcome
from marsupial.model.situation import Situation
from marsupial.model.unseen import Unseen


@dataclass(frozen=True, slots=True, kw_only=True)
class Briefing:
    """All a strategy may know at one replanning.

    Parameters
    ----------
    situation
        The moment to decide for; its times count from now. While targets are left its goal asks for exploring only;
        recovery and return are asked for once none is left.
    previous
        What is left of the plan followed so far, times from now, without what is no longer possible; None at first.
    direct_ms
        Computes, per carrier and target, the travel time at the carrier's speed over the known cells of terrain that
        any robot type can drive on, whatever its footprint. Pairs without such a path are absent. (The baseline
        assigns carriers regardless of access.)
    connects
        Per meeting point: the targets in the rover-only areas that it gives access to.
    deployed_at
        Per rover on the ground: the meeting point it was last set down at, where that is still one.
    unseen
        Finds what has not been seen yet.
    """

    situation: Situation
    previous: Plan | None
    direct_ms: Callable[[], Mapping[str, Mapping[str, int]]]
    connects: Mapping[str, frozenset[str]]
    deployed_at: Mapping[str, str]
    unseen: Callable[[], Unseen] = Unseen


@dataclass(frozen=True, slots=True, kw_only=True)
class PlanningReport:
    """How one planning went: wall-clock seconds in all and to the engine's first own plan, its end, plans refused."""

    planner: str
    outcome: Outcome
    wall_s: float
    first_plan_s: float | None = None
    refused: int = 0
    detail: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class Decision:
    """The plan to follow from now on (times from now) and, where a planner was asked, how that went."""

    plan: Plan
    report: PlanningReport = PlanningReport(planner="none", outcome=Outcome.SATISFICING, wall_s=0.0)


def checked_decision(name: str, value: object) -> Decision:
    """Return what a strategy of that name decided, once it is a decision.

    Raises
    ------
    UsageError
        Naming what is not of the type that it has to be.
    """
    decision = instance(f"strategy {name}: what decide returns", value, Decision)
    checked_plan(f"strategy {name}: Decision.plan", decision.plan)
    instance(f"strategy {name}: Decision.report", decision.report, PlanningReport)
    return decision


class Strategy(Protocol):
    """Decides, at each replanning, what every robot does next.

    One that is to be asked at other moments than the usual ones, or about other targets, also has a method
    ``replanning(world, kinds, homes, goal)`` that returns its policy (`marsupial.mission.replanning`) or None; one that
    is not made for every team has a method ``suits(roles)`` that raises a `ScenarioError`.
    """

    @property
    def name(self) -> str:
        """Its name in the registry."""

    def decide(self, briefing: Briefing) -> Decision:
        """Return the plan to follow; an empty plan means that nothing can be done."""


class PlanProgress(Protocol):
    """What the team is doing: the plan that is followed, as far as it is not carried out."""

    @property
    def idle(self) -> bool:
        """Whether nothing runs and nothing waits to run."""

    @property
    def deployed_at(self) -> Mapping[str, str]:
        """Meeting point at which each rover on the ground was last set down."""

    def remainder(self) -> tuple[Action, ...]:
        """Return the actions that run or wait, in plan order; times are those of the plan they came with."""

    def unemployed(self, robots: Iterable[str]) -> bool:
        """Say whether one of `robots` has nothing left to do."""
