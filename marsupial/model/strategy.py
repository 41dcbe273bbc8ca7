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
from marsupial.model.mission import GuessedGround
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

    name: str
    """Its name, which stays the same during a mission."""
    x_m: float
    """Centre of its unknown cells, in metres to the right of the lower left corner of the map."""
    y_m: float
    """Centre of its unknown cells, in metres above the lower left corner of the map."""
    share: float
    """Unknown share of the square, above 0 and up to 1."""
    draw: float
    """A random number from 0 to 1 that stays the same during a mission, to choose some of the squares."""
    priority: float = 1.0
    """How much more it is worth than others."""
    at: Cell | None = None
    """Its column and row among the squares, from the lower left corner of the map; None outside such a lattice."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Unseen:
    """The unknown squares, and statistics for guessing their contents."""

    squares: tuple[Square, ...] = ()
    """The squares that are largely unknown."""
    at_m: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    """Position (x, y) of each target by name, in metres from the lower left corner of the map."""
    rovers_only: float = 0.0
    """Share, from 0 to 1, of the ground seen so far that only rovers can drive on or get to."""
    shared: float = 0.0
    """Share, from 0 to 1, of the carriers' ground seen so far that rovers can drive on as well."""
    speed_mps: Mapping[str, float] = field(default_factory=dict)
    """Speed in metres per second by robot type."""
    side: int = 0
    """Length of the side of a square, in cells."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Briefing:
    """Everything a strategy may use at one replanning."""

    situation: Situation
    """The planning problem; its times count from now, in ms.

    While targets are left, its goal is to explore them; once none is left, to recover the rovers or to return home.
    """
    previous: Plan | None
    """The rest of the plan followed so far, times from now, without actions that are no longer possible; None at first.
    """
    direct_ms: Callable[[], Mapping[str, Mapping[str, int]]]
    """Computes travel times in ms, by carrier and target, at the carrier's speed wherever any robot type can drive.

    The way is over the known cells of such terrain, whatever the carrier's footprint. Pairs without one are absent.
    (The baseline assigns carriers regardless of access.)
    """
    connects: Mapping[str, frozenset[str]]
    """By meeting point: the targets in the rover-only areas that it gives access to."""
    deployed_at: Mapping[str, str]
    """By rover on the ground: the meeting point where it was last set down, if that meeting point still exists."""
    unseen: Callable[[], Unseen] = Unseen
    """Computes which parts of the map are still unknown."""
    charged: Situation | None = None
    """The situation with its batteries, of which `situation` knows nothing; None without batteries.

    Whatever a strategy decides is changed so that they suffice.
    """


@dataclass(frozen=True, slots=True, kw_only=True)
class PlanningReport:
    """One planning call."""

    planner: str
    """The name of the planner."""
    outcome: Outcome
    """How it ended."""
    wall_s: float
    """Wall-clock seconds in total."""
    first_plan_s: float | None = None
    """Wall-clock seconds to the first plan; None without one."""
    refused: int = 0
    """How many of its plans the checker refused."""
    detail: str = ""
    """More on how it ended, in words."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Reasons:
    """Why a plan was chosen, for those who read the log; nothing depends on it."""

    guess: GuessedGround | None = None
    """The unknown ground that it plans for."""
    compared: tuple[tuple[str, int, int], ...] = ()
    """The plans that were compared, the chosen one first: whose plan it is, its price in ms, the targets it leaves out.

    The price is the makespan, or with other objectives about the mean time until a target is reached.
    """
    instead: tuple[tuple[str, tuple[str, ...]], ...] = ()
    """By robot: the places where it would go first by the best plan that differs, if this one sends it elsewhere."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Decision:
    """The plan to follow from now on (times from now) and how the planning went."""

    plan: Plan
    """The plan to follow, times from now in ms; an empty one means that nothing can be done."""
    report: PlanningReport = PlanningReport(planner="none", outcome=Outcome.SATISFICING, wall_s=0.0)
    """How the planning went, if a planner was asked."""
    reasons: Reasons = Reasons()
    """Why it is this plan."""


def checked_decision(name: str, value: object) -> Decision:
    """Return the decision of a third-party strategy after checking its types; UsageError names the wrong part."""
    decision = instance(f"strategy {name}: what decide returns", value, Decision)
    checked_plan(f"strategy {name}: Decision.plan", decision.plan)
    instance(f"strategy {name}: Decision.report", decision.report, PlanningReport)
    instance(f"strategy {name}: Decision.reasons", decision.reasons, Reasons)
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
