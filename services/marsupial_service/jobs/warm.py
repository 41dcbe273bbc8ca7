"""Imported by the launcher of workers ahead of their use: loads marsupial's own planners with their compiled code.

A worker is a fork of that process; so its first plan comes in milliseconds. The first time ever, the code is compiled,
which takes most of a minute.
"""

from __future__ import annotations

import numpy as np

import marsupial_service.jobs.work  # noqa: F401 - the worker's own code, loaded for it
from marsupial.model.planning import Budget
from marsupial.model.robots import Role
from marsupial.model.situation import UNREACHABLE, PlanningType, RobotState, Situation, TargetInfo
from marsupial.planning.engines import engine

PLANNERS = ("greedy", "anytime", "exact", "auto")


def tiny() -> Situation:
    """Return: a carrier with a rover aboard, a door 1 s away, and a target behind it that only the rover reaches."""
    carrier = np.array([[0, UNREACHABLE, 1000], [UNREACHABLE] * 3, [1000, UNREACHABLE, 0]])
    rover = np.array([[UNREACHABLE] * 3, [UNREACHABLE, 0, 1000], [UNREACHABLE, 1000, 0]])
    return Situation(
        types=(
            PlanningType(name="carrier", role=Role.CARRIER, capacity=1),
            PlanningType(name="rover", role=Role.ROVER, dock_ms=1000, undock_ms=1000),
        ),
        robots=(
            RobotState(name="c", type="carrier", place="start"),
            RobotState(name="r", type="rover", carrier="c"),
        ),
        targets=(TargetInfo(name="target", explorers=frozenset({"rover"})),),
        meetings=("door",),
        travel_ms={"carrier": carrier, "rover": rover},
    )


for _planner in PLANNERS:
    for _ in engine(_planner).solve(tiny(), Budget(steps=1)):
        pass
