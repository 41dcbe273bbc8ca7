"""Rovers out of contact, as planning sees them.

A rover out of contact can't be told anything, but a carrier can pick it up where it waits. So it has a type of its own
in the situation: one that drives only to the meeting points at which a carrier is in contact with it, and from these
nowhere else, unless it is carried. Planners, checker and PDDL need to know nothing of it. On the map, rovers keep their
type.
"""

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace

import numpy as np

from marsupial.maps.targets import Target
from marsupial.maps.territory import contact_range_cells
from marsupial.model import UNREACHABLE, MapMeeting, RobotReport, RobotType, Situation, Unseen


def unclaimed(
    targets: tuple[Target, ...], robots: Iterable[RobotReport], ranges_cells: Mapping[str, float]
) -> tuple[Target, ...]:
    """Return the targets to which no rover out of contact was sent.

    As in plans that are carried over, a target may move by half the sensor range and still be the same.
    """
    for robot in robots:
        if robot.away and not robot.lost:
            kind, near = robot.type, 0.5 * ranges_cells[robot.type]
            targets = tuple(
                target
                for target in targets
                if kind not in target.viewpoints
                or min(math.dist(target.viewpoints[kind], cell) for cell in robot.away) > near
            )
    return targets


def with_waiting(
    situation: Situation,
    robots: Sequence[RobotReport],
    meetings: Iterable[MapMeeting],
    kinds: Mapping[str, RobotType],
    resolution_m: float,
) -> tuple[Situation, dict[str, str]]:
    """Return the situation in which rovers out of contact wait for a carrier, and their types, with those before."""
    names: dict[str, str] = {}
    for robot in robots:
        if robot.away is None or robot.cell is None:
            continue
        state = situation.robot_by_name[robot.name]
        before, name = situation.type_by_name[state.type], f"{state.type}_as_{robot.name}"
        while name in situation.type_by_name:
            name += "_"
        names[name] = before.name
        limit, index = contact_range_cells(kinds[robot.type], kinds.values(), resolution_m), situation.place_index
        heard = [index[one.name] for one in meetings if math.dist(one.carrier_cell, robot.cell) <= limit]
        bound = [index[f"s_{robot.name}"], *heard]
        table = np.array(situation.travel_ms[before.name])
        kept = table[np.ix_(bound, heard)]
        table[bound] = UNREACHABLE
        table[np.ix_(bound, heard)] = kept
        situation = replace(
            situation,
            types=(*situation.types, replace(before, name=name, seats_as=before.seat if situation.has_seats else "")),
            robots=tuple(replace(one, type=name) if one.name == robot.name else one for one in situation.robots),
            targets=tuple(
                replace(target, explorers=target.explorers | {name}) if before.name in target.explorers else target
                for target in situation.targets
            ),
            travel_ms={**situation.travel_ms, name: table},
        )
    return situation, names


def unseen_with_waiting(unseen: Unseen, names: Mapping[str, str]) -> Unseen:
    """Return what is known of the unknown map, with the speeds of the types of rovers out of contact."""
    speeds = unseen.speed_mps
    return replace(unseen, speed_mps={**speeds, **{name: speeds[before] for name, before in names.items()}})
