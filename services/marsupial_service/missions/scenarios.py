"""Scenarios as missions of the service: what asks for them, in JSON."""

from __future__ import annotations

from typing import Any

from marsupial.library.missions import reachable_area
from marsupial.mission.placement import place_team
from marsupial.model.grid import FLOOR, OBSTACLE, ROUGH, UNKNOWN, CellArray
from marsupial.model.mission import PlacedRobot
from marsupial.model.planning import Budget
from marsupial.model.robots import RobotType, Role
from marsupial.model.scenario import Scenario
from marsupial_service.missions.values import runs_in

_EVERYWHERE = (OBSTACLE, FLOOR, ROUGH)


def mission_document(scenario: Scenario, *, strategy: str, planner: str, budget: Budget, seed: int) -> dict[str, Any]:
    """Return the body that asks for a mission in this scenario, whose map is unknown at first."""
    grid, team = scenario.grid, place_team(scenario, seed)
    names = {terrain.code: terrain.name for terrain in grid.terrains}
    area: CellArray = reachable_area(scenario, team).astype("uint8")
    area[area == 0] = UNKNOWN
    return {
        "name": scenario.name,
        "frame": {
            "width": grid.width,
            "height": grid.height,
            "resolution_m": grid.resolution_m,
            "origin_m": list(grid.origin_m),
        },
        "terrains": [
            {"name": terrain.name, "code": terrain.code, "blocks_sight": terrain.blocks_sight}
            for terrain in grid.terrains
            if terrain.code not in _EVERYWHERE
        ],
        "robot_types": [_type(kind, names) for kind in scenario.robot_types],
        "team": [_member(robot) for robot in team],
        "goal": {"recover_rovers": scenario.goal.recover_rovers, "return_home": scenario.goal.return_home},
        "strategy": strategy,
        "planner": planner,
        "budget": {"steps": budget.steps} if budget.seconds is None else {"seconds": budget.seconds},
        "planning_time": scenario.planning_time.value,
        "time_limit_ms": scenario.limits.time_ms,
        "area": list(runs_in(area)),
        "seed": seed,
    }


def _type(kind: RobotType, names: dict[int, str]) -> dict[str, Any]:
    common = {
        "name": kind.name,
        "role": kind.role.value,
        "speed_mps": kind.speed_mps,
        "sensor_range_m": kind.sensor_range_m,
        "radius_m": kind.radius_m,
        "terrains": [names[code] for code in sorted(kind.terrains)],
        "energy": {"idle_w": kind.energy.idle_w, "drive_w": kind.energy.drive_w},
    }
    if kind.role is Role.CARRIER:
        return {**common, "capacity": kind.capacity}
    return {**common, "dock_s": kind.dock_ms / 1000, "undock_s": kind.undock_ms / 1000}


def _member(robot: PlacedRobot) -> dict[str, Any]:
    where = {"carrier": robot.carrier} if robot.cell is None else {"cell": list(robot.cell)}
    return {"name": robot.name, "type": robot.type, **where}
