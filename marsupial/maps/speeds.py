"""Robots that drive slower or faster than their type, as planning sees them.

Travel times are per robot type, so each speed of a type becomes a type of its own in the situation: robots of type
`rover` at half speed have type `rover_at_50`. Planners, checker and PDDL need to know nothing of it. On the map, robots
keep their type.
"""

from collections.abc import Collection, Iterable, Mapping
from dataclasses import replace

import numpy as np

from marsupial.model import UNREACHABLE, PlanningBattery, RobotReport, RobotType, Role, Situation, TravelTable, Unseen

Speeds = Mapping[tuple[str, float], str]
"""The names of further planning types, by the robot type and the share of its speed."""


def speeds_of(robots: Iterable[RobotReport], types: Collection[str]) -> Speeds:
    """Return the further planning types of a team; none if all robots drive at the speed of their type."""
    pairs = {(robot.type, robot.speed) for robot in robots if robot.speed != 1.0}
    names: dict[tuple[str, float], str] = {}
    for kind, share in sorted(pairs):
        name = f"{kind}_at_{round(100 * share)}"
        while name in types or name in names.values():
            name += "_"
        names[kind, share] = name
    return names


def planning_battery(kind: RobotType, speed: float = 1.0) -> PlanningBattery | None:
    """Return the battery of a robot type that drives at a share of its speed."""
    if kind.battery is None:
        return None
    return PlanningBattery(
        capacity_j=kind.battery.capacity_j,
        stand_w=kind.power_w(driving=False),
        drive_w=kind.power_w(driving=True, speed=speed),
        charge_w=kind.battery.charge_w,
    )


def with_speeds(
    situation: Situation, robots: Iterable[RobotReport], speeds: Speeds, types: Mapping[str, RobotType]
) -> Situation:
    """Return the situation in which robots have a type that drives at their own speed."""
    if not speeds:
        return situation
    names = {robot.name: speeds.get((robot.type, robot.speed), robot.type) for robot in robots}
    kinds = situation.type_by_name
    # slow rovers take the seats of their robot type
    seats_as = {k.name: k.name for k in situation.types if k.role is Role.ROVER and situation.has_seats}
    further = tuple(
        replace(
            kinds[kind],
            name=name,
            battery=planning_battery(types[kind], share),
            seats_as=seats_as.get(kind, ""),
        )
        for (kind, share), name in speeds.items()
    )
    tables = {name: _scaled(situation.travel_ms[kind], share) for (kind, share), name in speeds.items()}
    return replace(
        situation,
        types=situation.types + further,
        robots=tuple(replace(robot, type=names[robot.name]) for robot in situation.robots),
        targets=tuple(
            replace(t, explorers=t.explorers | {name for (kind, _), name in speeds.items() if kind in t.explorers})
            for t in situation.targets
        ),
        travel_ms={**situation.travel_ms, **tables},
    )


def unseen_with_speeds(unseen: Unseen, speeds: Speeds) -> Unseen:
    """Return what is known of the unknown map, with the speeds of further planning types."""
    if not speeds:
        return unseen
    further = {name: unseen.speed_mps[kind] * share for (kind, share), name in speeds.items()}
    return replace(unseen, speed_mps={**unseen.speed_mps, **further})


def _scaled(table: TravelTable, share: float) -> TravelTable:
    """Return travel times at a share of the speed."""
    times: TravelTable = np.where(table == UNREACHABLE, UNREACHABLE, np.rint(table / share).astype(np.int64))
    return times
