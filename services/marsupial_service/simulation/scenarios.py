"""Scenarios as missions of the service: what asks for them, in JSON."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from marsupial.formats.scenario.write import terrain_fields, type_fields
from marsupial.model.grid import UNKNOWN, CellArray, Mask
from marsupial.model.mission import PlacedRobot
from marsupial.model.planning import Budget
from marsupial.model.scenario import Scenario
from marsupial_service.missions.values import runs_in


def mission_document(
    scenario: Scenario,
    team: Sequence[PlacedRobot],
    reachable: Mask,
    *,
    strategy: str,
    planner: str,
    budget: Budget,
    seed: int,
) -> dict[str, Any]:
    """Return the body that asks for a mission of this team in a scenario, whose map is unknown at first.

    `reachable` are the cells (height, width) that there are to explore.
    """
    grid = scenario.grid
    names = {terrain.code: terrain.name for terrain in grid.terrains}
    area: CellArray = reachable.astype("uint8")
    area[area == 0] = UNKNOWN
    return {
        "name": scenario.name,
        "frame": {
            "width": grid.width,
            "height": grid.height,
            "resolution_m": grid.resolution_m,
            "origin_m": list(grid.origin_m),
        },
        "terrains": terrain_fields(grid),
        "robot_types": [type_fields(kind, names) for kind in scenario.robot_types],
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


def _member(robot: PlacedRobot) -> dict[str, Any]:
    where = {"carrier": robot.carrier} if robot.cell is None else {"cell": list(robot.cell)}
    return {"name": robot.name, "type": robot.type, **where}
