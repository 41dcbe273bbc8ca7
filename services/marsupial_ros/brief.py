"""The mission that a team with ROS asks the service for."""

from __future__ import annotations

from typing import Any, cast

from marsupial.formats.scenario.write import terrain_fields, type_fields
from marsupial.model.grid import Grid
from marsupial_client.mission_documents import Brief
from marsupial_ros.fleet import RobotFleet
from marsupial_ros.robots import TrackedRobot
from marsupial_ros.settings import Settings


def brief_of(settings: Settings, grid: Grid, fleet: RobotFleet) -> Brief:
    """Return the brief for a team that is placed, in the frame of a map of which nothing is reported yet."""
    names = {terrain.code: terrain.name for terrain in grid.terrains}
    planning = settings.planning
    document: dict[str, Any] = {
        "name": settings.name,
        "frame": frame_of(grid),
        "terrains": terrain_fields(grid),
        "robot_types": [type_fields(kind, names) for kind in settings.kinds],
        "team": [_member(robot) for robot in fleet.robots.values()],
        "goal": {"recover_rovers": settings.goal.recover_rovers, "return_home": settings.goal.return_home},
        "budget": {"seconds": planning.budget_s},
        "planning_time": planning.planning_time.value,
        "time_limit_ms": settings.limits.time_ms,
    }
    document |= {} if planning.strategy is None else {"strategy": planning.strategy}
    document |= {} if planning.planner is None else {"planner": planning.planner}
    return cast(Brief, document)


def frame_of(grid: Grid) -> dict[str, Any]:
    """Return the frame of a map."""
    return {
        "width": grid.width,
        "height": grid.height,
        "resolution_m": grid.resolution_m,
        "origin_m": list(grid.origin_m),
    }


def _member(robot: TrackedRobot) -> dict[str, Any]:
    where = {"carrier": robot.aboard} if robot.anchor is None else {"pose_m": list(robot.anchor)}
    return {"name": robot.name, "type": robot.settings.kind.name, **where}
