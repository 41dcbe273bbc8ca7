"""The interface between the mission loop and a strategy: `Briefing` in, `Decision` out.

The loop asks for a decision at each replanning and follows its plan once the checker has accepted it. A plan need not
serve every target: the loop asks again later. `Strategy` is the base class; its optional methods have defaults.
"""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any, ClassVar, Protocol

from marsupial.errors import UsageError
from marsupial.model.arguments import instance, text, with_parts
from marsupial.model.grid import Cell
from marsupial.model.plan import Action, Plan, checked_plan
from marsupial.model.planning import Outcome
from marsupial.model.robots import RobotType, Role
from marsupial.model.scenario import Goal
from marsupial.model.situation import Situation
from marsupial.model.strategyinfo import StrategyInfo
from marsupial.model.world import World


@dataclass(frozen=True, slots=True, kw_only=True)
class Square:
    """A square of the map that is largely unknown."""

    name: str  # stays the same during a mission
    # x_m, y_m: centre of its unknown cells, from the corner of the map
    x_m: float
    y_m: float
    share: float  # unknown share of the square, above 0 and up to 1
    draw: float  # a random number from 0 to 1 that stays the same during a mission, to choose some of the squares
    priority: float = 1.0  # how much more it is worth than others


@dataclass(frozen=True, slots=True, kw_only=True)
class Unseen:
    """The unknown squares, and statistics for guessing their contents."""

    squares: tuple[Square, ...] = ()
    # position of each target, in metres from the corner of the map
    at_m: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    # shares from 0 to 1 of the ground seen so far: what only rovers can drive on or get to, of all ground; and what
    # rovers can drive on as well, of the carriers' ground
    rovers_only: float = 0.0
    shared: float = 0.0
    speed_mps: Mapping[str, float] = field(default_factory=dict)  # by robot type


@dataclass(frozen=True, slots=True, kw_only=True)
class Briefing:
    """Everything a strategy may use at one replanning."""

    #: the planning problem; its times count from now. While targets are left, its goal is to explore them; once none is
    #: left, its goal is to recover the rovers or to return home.
    situation: Situation
    #: the rest of the plan followed so far, times from now, without actions that are no longer possible; None at first
    previous: Plan | None
    #: computes, per carrier and target, the travel time at the carrier's speed over the known cells of terrain that any
    #: robot type can drive on, whatever its footprint. Pairs without such a path are absent. (The baseline assigns
    #: carriers regardless of access.)
    direct_ms: Callable[[], Mapping[str, Mapping[str, int]]]
    #: per meeting point: the targets in the rover-only areas that it gives access to
    connects: Mapping[str, frozenset[str]]
    #: per rover on the ground: the meeting point where it was last set down, if that meeting point still exists
    deployed_at: Mapping[str, str]
    unseen: Callable[[], Unseen] = Unseen  #: computes which parts of the map are still unknown
    #: the situation with its batteries, of which `situation` knows nothing; None without batteries. Whatever a strategy
    #: decides is changed so that they suffice.
    charged: Situation | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class PlanningReport:
    """One planning call: wall-clock seconds in total and to the first plan, outcome, number of invalid plans."""

    planner: str
    outcome: Outcome
    wall_s: float
    first_plan_s: float | None = None
    refused: int = 0
    detail: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class Decision:
    """The plan to follow from now on (times from now) and how the planning went."""

    plan: Plan
    report: PlanningReport = PlanningReport(planner="none", outcome=Outcome.SATISFICING, wall_s=0.0)


def checked_decision(name: str, value: object) -> Decision:
    """Return the decision of a third-party strategy after checking its types; UsageError names the wrong part."""
    decision = instance(f"strategy {name}: what decide returns", value, Decision)
    checked_plan(f"strategy {name}: Decision.plan", decision.plan)
    instance(f"strategy {name}: Decision.report", decision.report, PlanningReport)
    return decision


class Decider(Protocol):
    """The minimal interface of a strategy: a name and a decision at each replanning."""

    @property
    def name(self) -> str:
        """Its name in logs."""

    def decide(self, briefing: Briefing) -> Decision:
        """Return the plan to follow; an empty plan means that nothing can be done."""


class Strategy:
    """Base class of strategies: decides, at each replanning, what every robot does next.

    A strategy sets `name` and overrides `decide`; the rest has defaults. An object with `name` and `decide` that does
    not derive from this class works as well (`as_strategy`).
    """

    name: str
    asks_planner: ClassVar[bool] = False  # whether it is created with an engine and a budget, rather than no arguments
    info: ClassVar[StrategyInfo | None] = None  # for `marsupial strategies`; None: the first line of its docstring

    def decide(self, briefing: Briefing) -> Decision:
        """Return the plan to follow; an empty plan means that nothing can be done."""
        raise NotImplementedError

    def replanning(
        self, world: World, kinds: Mapping[str, RobotType], homes: Mapping[str, Cell], goal: Goal
    ) -> Any:  # a `marsupial.mission.replanning.Replanning`, which this layer can't import
        """Return when this mission replans and from which survey; None for the usual policy."""
        return None

    def suits(self, roles: Iterable[Role]) -> None:
        """Raise a `ScenarioError` if the strategy can't lead a team of robots with these roles."""


def checked_decider(name: str, value: Decider) -> Decider:
    """Return a strategy of the caller's own; raise a `UsageError` that names what it lacks."""
    with_parts(name, value, "name", "decide")
    if getattr(value.decide, "__func__", None) is Strategy.decide:
        raise UsageError(f"{name}: {type(value).__name__} has no decide of its own")
    text(f"{name}: name", value.name)
    return value


class _Adapted(Strategy):
    """Gives an object that does not derive from `Strategy` the defaults of its missing methods."""

    def __init__(self, decider: Decider) -> None:
        self._decider = decider
        self.name = decider.name

    def decide(self, briefing: Briefing) -> Decision:
        return self._decider.decide(briefing)

    def replanning(self, *circumstances: Any) -> Any:
        return getattr(self._decider, "replanning", super().replanning)(*circumstances)

    def suits(self, roles: Iterable[Role]) -> None:
        getattr(self._decider, "suits", super().suits)(roles)


def as_strategy(decider: Decider) -> Strategy:
    """Return the strategy itself, or an object with `name` and `decide` as a strategy."""
    return decider if isinstance(decider, Strategy) else _Adapted(decider)


class PlanProgress(Protocol):
    """The team's unfinished actions of the current plan."""

    @property
    def idle(self) -> bool:
        """Whether nothing runs and nothing waits to run."""

    @property
    def deployed_at(self) -> Mapping[str, str]:
        """Meeting point at which each rover on the ground was last set down."""

    def remainder(self) -> tuple[Action, ...]:
        """Return the running and waiting actions in plan order, with the times of their plan."""

    def unemployed(self, robots: Iterable[str]) -> bool:
        """Return whether at least one of `robots` has nothing left to do."""
