"""Terrains and robot types as a scenario file describes them (``docs/scenario-format.md``), tasks as the service."""

from collections.abc import Sequence
from dataclasses import asdict
from typing import Any

from marsupial.model import SQRT2, TERRAINS, Goal, Grid, MissionLimits, PlanningTime, RobotType, Role, Routes


def terrain_fields(grid: Grid) -> list[dict[str, Any]]:
    own = (terrain for terrain in grid.terrains if terrain.code >= len(TERRAINS))
    return [{"name": one.name, "code": one.code, "blocks_sight": one.blocks_sight} for one in own]


def type_fields(kind: RobotType, terrain_names: dict[int, str]) -> dict[str, Any]:
    fields: dict[str, Any] = {
        "name": kind.name,
        "role": str(kind.role),
        "speed_mps": kind.speed_mps,
        "sensor_range_m": kind.sensor_range_m,
        "radius_m": kind.radius_m,
        "terrains": [terrain_names[code] for code in sorted(kind.terrains)],
    }
    if kind.role is Role.CARRIER:
        fields["capacity"] = kind.capacity
        fields |= {"seats": dict(kind.seats)} if kind.seats else {}
    else:
        fields |= {"dock_s": kind.dock_ms / 1000, "undock_s": kind.undock_ms / 1000}
    energy = kind.energy
    fields["energy"] = {"idle_w": energy.idle_w, "drive_w": energy.drive_w}
    # Energy of distance, stops and turns is left out where it is 0, as it is by default.
    fields["energy"] |= {key: value for key in ("metre_j", "stop_j") if (value := getattr(energy, key))}
    fields["energy"] |= {"turn_j": list(energy.turn_j)} if any(energy.turn_j) else {}
    if kind.battery is not None:
        fields["battery"] = {"capacity_j": kind.battery.capacity_j, "charge_w": kind.battery.charge_w}
    fields |= {key: value for key in ("sensor_angle_deg", "radio_range_m") if (value := getattr(kind, key)) is not None}
    if kind.diagonal != SQRT2:
        fields["diagonal"] = kind.diagonal
    return fields if kind.routes is Routes.SHORTEST else fields | {"routes": str(kind.routes)}


def task_document(
    grid: Grid, kinds: Sequence[RobotType], goal: Goal, limits: MissionLimits, planning_time: PlanningTime
) -> dict[str, Any]:
    """Return the fields of a mission's request body that say where robots of which types explore, and to what end."""
    names = {terrain.code: terrain.name for terrain in grid.terrains}
    return {
        "frame": {
            "width": grid.width,
            "height": grid.height,
            "resolution_m": grid.resolution_m,
            "origin_m": list(grid.origin_m),
        },
        "terrains": terrain_fields(grid),
        "robot_types": [type_fields(kind, names) for kind in kinds],
        "goal": asdict(goal),
        "planning_time": planning_time.value,
        "time_limit_ms": limits.time_ms,
        **({"coverage": limits.coverage} if limits.coverage < 1 else {}),
        **({"chargers": [{"cell": list(cell)} for cell in grid.chargers]} if grid.chargers else {}),
    }
