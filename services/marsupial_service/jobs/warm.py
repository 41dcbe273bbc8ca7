"""A situation so small that planning for it costs nothing but loading the planner, and says whether that works."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from marsupial.library.first_use import try_planner
from marsupial.model.planning import Budget, Improved
from marsupial.model.robots import Role
from marsupial.model.situation import UNREACHABLE, PlanningType, RobotState, Situation, TargetInfo
from marsupial.planning.checker import check
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


def load_planners() -> None:
    """Load marsupial's own planners with their compiled code; the first time ever it is compiled, for half a minute.

    Done in the fork server, of which workers are forks: so their first plan comes in milliseconds.
    """
    for planner in PLANNERS:
        try_planner(planner)


def plan_tiny(_: object) -> Iterator[bool]:
    """Yield whether planning gives a valid plan; the function of a job."""
    situation = tiny()
    plans = [e.plan for e in engine("greedy").solve(situation, Budget(steps=1)) if isinstance(e, Improved)]
    yield bool(plans) and check(situation, plans[-1]).valid
