"""A scenario: the true map, the team and the goal of a mission.

Scenario files, built-in scenarios and bare maps are all read into a `Scenario` (`marsupial.formats.scenario`). Together
with a strategy, a planner, a seed and a budget it determines a mission.
"""

from dataclasses import dataclass, replace
from enum import StrEnum

from marsupial.errors import Problem, ScenarioError
from marsupial.model.faults import Fault
from marsupial.model.grid import Grid
from marsupial.model.robots import RobotType, Routes, TeamMember
from marsupial.model.zones import DatedZone


class PlanningTime(StrEnum):
    """Whether the mission clock stands still or runs during planning."""

    INSTANT = "instant"
    CHARGED = "charged"


@dataclass(frozen=True, slots=True, kw_only=True)
class ReturnGoal:
    """What a team has to do besides exploring; `return_home` implies that rovers come home aboard."""

    recover_rovers: bool = True
    return_home: bool = False

    @property
    def aboard(self) -> bool:
        """Whether all rovers have to end aboard: carriers return home with them."""
        return self.recover_rovers or self.return_home


@dataclass(frozen=True, slots=True, kw_only=True)
class Goal(ReturnGoal):
    """The goal of a mission."""

    # how much new ground a frontier has to lead to, in footprints of a robot; 0: any. With less, missions in real
    # buildings end later; more gains nothing (docs/strategies.md)
    least_ground: float = 4.0


@dataclass(frozen=True, slots=True, kw_only=True)
class MissionLimits:
    """When a mission ends at the latest."""

    time_ms: int = 4 * 3600 * 1000  # simulated time
    coverage: float = 1.0  # explored share of the reachable area that is enough; the team then returns


@dataclass(frozen=True, slots=True, kw_only=True)
class Scenario:
    """The true map, the team and its goal."""

    name: str
    grid: Grid  #: the true map. Its unknown cells block sight and motion, and stay unknown.
    robot_types: tuple[RobotType, ...]
    team: tuple[TeamMember, ...]  #: carriers first; each rover has a carrier or a start of its own
    goal: Goal = Goal()
    limits: MissionLimits = MissionLimits()
    planning_time: PlanningTime = PlanningTime.INSTANT
    start_seed: int | None = None  #: seed for starts that are not fixed; None for the mission's seed
    interference: bool = False  #: whether robots keep out of each other's footprints; if not, they share cells
    faults: tuple[Fault, ...] = ()  #: what goes wrong
    zones: tuple[DatedZone, ...] = ()  #: where robots must not go, and where they should explore

    def type_of(self, member: TeamMember) -> RobotType:
        """Return the robot type of a team member."""
        return next(kind for kind in self.robot_types if kind.name == member.type)


def with_routes(scenario: Scenario, routes: Routes) -> Scenario:
    """Return the scenario with these routes for all types; raise ScenarioError if driving then uses no energy."""
    kinds = tuple(replace(kind, routes=routes) for kind in scenario.robot_types)
    faults = [(kind.name, kind.routes_fault) for kind in kinds]
    problems = [Problem("routes", f"robot type {name!r}: {fault}") for name, fault in faults if fault is not None]
    if problems:
        raise ScenarioError(problems)
    return replace(scenario, robot_types=kinds)


def has_fixed_starts(scenario: Scenario) -> bool:
    """Return whether all starts are fixed, so that every seed gives the same mission."""
    return all(member.start is not None or member.carrier is not None for member in scenario.team)
