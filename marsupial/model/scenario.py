"""A scenario: the world and the team before a mission starts.

It is what scenario files, built-in scenarios and bare maps are read into (`marsupial.formats.scenario`), and all
that a mission needs beside a strategy, a planner, a seed and a budget.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from enum import StrEnum

from marsupial.errors import Problem, ScenarioError
from marsupial.model.grid import Grid
from marsupial.model.robots import RobotType, Routes, TeamMember


class PlanningTime(StrEnum):
    """Whether planning stops the mission clock or runs on it."""

    INSTANT = "instant"
    CHARGED = "charged"


@dataclass(frozen=True, slots=True, kw_only=True)
class Goal:
    """What a mission wants besides no reachable target being left.

    `return_home` implies that rovers come home aboard.
    """

    recover_rovers: bool = True
    return_home: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class MissionLimits:
    """When a mission is given up: simulated time in ms."""

    time_ms: int = 4 * 3600 * 1000


@dataclass(frozen=True, slots=True, kw_only=True)
class Scenario:
    """The hidden world, the team and what is asked of it.

    Parameters
    ----------
    grid
        The truth. Cells unknown in it stay unknown for ever: they block sight and motion.
    team
        Carriers first, each rover with the carrier it starts on or a start of its own.
    start_seed
        Draws the starts of the robots that have none; the mission's seed is used where it is None.
    """

    name: str
    grid: Grid
    robot_types: tuple[RobotType, ...]
    team: tuple[TeamMember, ...]
    goal: Goal = Goal()
    limits: MissionLimits = MissionLimits()
    planning_time: PlanningTime = PlanningTime.INSTANT
    start_seed: int | None = None

    def type_of(self, member: TeamMember) -> RobotType:
        """Return the robot type of a member of the team."""
        return next(kind for kind in self.robot_types if kind.name == member.type)


def with_routes(scenario: Scenario, routes: Routes) -> Scenario:
    """Return the scenario with all robot types taking such routes.

    Raises
    ------
    ScenarioError
        If routes of least energy are asked for and driving takes a type none.
    """
    kinds = tuple(replace(kind, routes=routes) for kind in scenario.robot_types)
    faults = [(kind.name, kind.routes_fault) for kind in kinds]
    problems = [Problem("routes", f"robot type {name!r}: {fault}") for name, fault in faults if fault is not None]
    if problems:
        raise ScenarioError(problems)
    return replace(scenario, robot_types=kinds)


def has_fixed_starts(scenario: Scenario) -> bool:
    """Say whether no start is left to be drawn, so that every seed gives the same mission."""
    return all(member.start is not None or member.carrier is not None for member in scenario.team)
