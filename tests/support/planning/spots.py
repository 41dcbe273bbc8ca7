"""Situations of robots, targets and meeting points on a line or in a plane.

Each place has a zone per robot type, and a type gets from place to place where both have the same zone. Positions are
in seconds at the carrier's speed; rovers take twice as long.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from marsupial.model.robots import Role
from marsupial.model.situation import (
    UNREACHABLE,
    PlanningType,
    RobotState,
    Situation,
    SituationGoal,
    TargetInfo,
    TravelTable,
)

DOCK_MS, UNDOCK_MS = 10_000, 5_000


@dataclass(frozen=True)
class Spot:
    """The position of a place (ms at the carrier's speed) and its zone for each type; no zone: unreachable."""

    x: int
    zones: Mapping[str, int]
    y: int = 0


def hall(seconds: int, zone: int = 0) -> Spot:
    """Return a spot that the carrier can be at, and no rover."""
    return Spot(seconds * 1000, {"carrier": zone})


def room(seconds: int, zone: int = 0) -> Spot:
    """Return a spot that the rover can be at, and no carrier."""
    return Spot(seconds * 1000, {"rover": zone})


def door(seconds: int, zone: int = 0, *, carrier_zone: int = 0) -> Spot:
    """Return a spot that both can be at."""
    return Spot(seconds * 1000, {"carrier": carrier_zone, "rover": zone})


def default_types(capacity: int = 1) -> tuple[PlanningType, ...]:
    """Return one carrier type and one rover type."""
    return (
        PlanningType(name="carrier", role=Role.CARRIER, capacity=capacity),
        PlanningType(name="rover", role=Role.ROVER, dock_ms=DOCK_MS, undock_ms=UNDOCK_MS),
    )


def situation_of(
    robots: Sequence[RobotState],
    targets: Mapping[str, Spot],
    meetings: Mapping[str, Spot],
    starts: Mapping[str, Spot],
    *,
    homes: Mapping[str, Spot] | None = None,
    types: tuple[PlanningType, ...] | None = None,
    slowness: Mapping[str, int] | None = None,
    goal: SituationGoal | None = None,
) -> Situation:
    """Return the situation of these robots and spots; `slowness` is 1 for carriers and 2 for rovers."""
    types = default_types() if types is None else types
    homes = {} if homes is None else homes
    spots = [starts[robot.place] for robot in robots if robot.place is not None]
    spots += [*targets.values(), *meetings.values(), *homes.values()]
    slow = {kind.name: 1 if kind.role is Role.CARRIER else 2 for kind in types} | dict(slowness or {})
    return Situation(
        types=types,
        robots=tuple(robots),
        targets=tuple(
            TargetInfo(name=name, explorers=frozenset(spot.zones), reveal_m2=1.0) for name, spot in targets.items()
        ),
        meetings=tuple(meetings),
        homes=tuple(homes),
        travel_ms={kind.name: _table(spots, kind.name, slow[kind.name]) for kind in types},
        goal=goal or SituationGoal(),
    )


def _table(spots: Sequence[Spot], kind: str, slowness: int) -> TravelTable:
    table = np.full((len(spots), len(spots)), UNREACHABLE, dtype=np.int64)
    for i, a in enumerate(spots):
        for j, b in enumerate(spots):
            if kind in a.zones and a.zones[kind] == b.zones.get(kind):
                table[i, j] = slowness * (abs(a.x - b.x) + abs(a.y - b.y))
    return table


def carrier(number: int = 1, *, free_at_ms: int = 0, home: str | None = None) -> RobotState:
    """Return the carrier ``c<number>`` at its start ``c<number>_start``."""
    return RobotState(name=f"c{number}", type="carrier", place=f"c{number}_start", free_at_ms=free_at_ms, home=home)


def rover(number: int = 1, on: str | None = None, *, free_at_ms: int = 0) -> RobotState:
    """Return the rover ``r<number>``, on a carrier or at its start ``r<number>_start``."""
    place = None if on else f"r{number}_start"
    return RobotState(name=f"r{number}", type="rover", place=place, carrier=on, free_at_ms=free_at_ms)
