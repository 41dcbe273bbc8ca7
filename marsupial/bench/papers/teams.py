"""Scenarios of robots that carry none."""

from __future__ import annotations

from marsupial.model.grid import Grid
from marsupial.model.robots import RobotType, TeamMember
from marsupial.model.scenario import Goal, Scenario


def explorers(name: str, grid: Grid, kind: RobotType, robots: int) -> Scenario:
    """Return the scenario of that many robots of one type on a map, their starts drawn by the mission's seed."""
    team = tuple(TeamMember(name=f"{kind.name}{i}", type=kind.name) for i in range(1, robots + 1))
    return Scenario(name=name, grid=grid, robot_types=(kind,), team=team, goal=Goal(recover_rovers=False))
