"""Seeded situations for the planner tests: a corridor for everybody, rooms behind meeting points for rovers only."""

from __future__ import annotations

import itertools
import math
import random

import numpy as np

from marsupial.model.robots import Role
from marsupial.model.situation import (
    UNREACHABLE,
    PlanningType,
    RobotState,
    Situation,
    SituationGoal,
    TargetInfo,
)

CARRIER, ROVER = "carrier", "rover"


def corridor(
    *,
    carriers: int,
    rovers: int,
    targets: int,
    meetings: int,
    seed: int = 0,
    goal: SituationGoal | None = None,
    capacity: int | None = None,
) -> Situation:
    """Return a situation in a 60 m corridor with one room per meeting; every third target lies in the corridor."""
    rng = random.Random(seed)
    doors = [(rng.uniform(0, 60), rng.choice((0.0, 4.0))) for _ in range(meetings)]
    where: dict[str, tuple[float, float, int | None]] = {}
    robots = []
    for c in range(1, carriers + 1):
        where[f"start_c{c}"] = (rng.uniform(0, 60), 2.0, None)
        robots.append(RobotState(name=f"c{c}", type=CARRIER, place=f"start_c{c}", home=f"home_c{c}"))
        robots += [RobotState(name=f"r{c}_{r}", type=ROVER, carrier=f"c{c}") for r in range(1, rovers + 1)]
    infos = []
    for t in range(1, targets + 1):
        room = None if t % 3 == 0 or not meetings else rng.randrange(meetings)
        x, y = (rng.uniform(0, 60), rng.uniform(0, 4)) if room is None else doors[room]
        if room is not None:
            x, y = x + rng.uniform(-5, 5), (y - rng.uniform(2, 8) if y == 0 else y + rng.uniform(2, 8))
        where[f"t{t}"] = (x, y, room)
        infos.append(TargetInfo(name=f"t{t}", explorers=frozenset({ROVER} if room is not None else {CARRIER, ROVER})))
    for m, (x, y) in enumerate(doors, start=1):
        where[f"m{m}"] = (x, y, None)
    homes = tuple(f"home_c{c}" for c in range(1, carriers + 1))
    for c in range(1, carriers + 1):
        where[f"home_c{c}"] = where[f"start_c{c}"]
    return Situation(
        types=(
            PlanningType(name=CARRIER, role=Role.CARRIER, capacity=rovers if capacity is None else capacity),
            PlanningType(name=ROVER, role=Role.ROVER, dock_ms=10_000, undock_ms=5_000),
        ),
        robots=tuple(robots),
        targets=tuple(infos),
        meetings=tuple(f"m{m}" for m in range(1, meetings + 1)),
        homes=homes,
        travel_ms={CARRIER: _table(where, doors, 1.0, False), ROVER: _table(where, doors, 0.5, True)},
        goal=goal or SituationGoal(),
    )


def _table(where: dict, doors: list, speed_mps: float, into_rooms: bool) -> np.ndarray:
    places = list(where.values())
    table = np.full((len(places), len(places)), UNREACHABLE, dtype=np.int64)
    for i, a in enumerate(places):
        for j, b in enumerate(places):
            if into_rooms or (a[2] is None and b[2] is None):
                table[i, j] = round(1000 * _length(a, b, doors) / speed_mps)
    return table


def _length(a: tuple, b: tuple, doors: list) -> float:
    if a[2] == b[2]:
        return math.dist(a[:2], b[:2])
    way = [a[:2], *(doors[p[2]] for p in (a, b) if p[2] is not None), b[:2]]
    return sum(math.dist(p, q) for p, q in itertools.pairwise(way))
