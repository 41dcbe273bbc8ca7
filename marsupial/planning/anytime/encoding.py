"""Situations as arrays of numbers, and plans as lists of events, for the compiled search.

A plan is one linear list of events: a robot explores a target, a rover is set down, a rover is picked up. Driving to
where an event happens is implied, and so is the carrier that a rover is set down from: the one it is aboard. The list
begins with one `START` per robot, so that everything else can be inserted after something.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from marsupial.model.plan import EPSILON_MS, ActionName, Plan
from marsupial.model.robots import Role
from marsupial.model.situation import UNREACHABLE, Situation
from marsupial.planning.recovery import go_home
from marsupial.planning.timeline import Timeline

Ints = npt.NDArray[Any]
"""int64, but for lists of events (int32)."""

NEVER = 1 << 56
"""A leg from here on has no path."""

EXPLORE, UNDOCK, DOCK, START = 0, 1, 2, 3
"""Kinds of event, the first column; the others are the robot, the carrier (-1 if none) and the place."""

NEIGHBOURS = 10
DOORS = 6


class Task(NamedTuple):
    """A situation; robots, types and places are indices in its own order, times ms, all arrays int64.

    Attributes
    ----------
    leg
        (types, places, places): from being ready at one place to being ready again after driving to the other:
        0 on the diagonal, `NEVER` without a path.
    type_of, start, aboard, ready, capacity, dock, undock, home
        Per robot; `start`, `aboard` (its carrier) and `home` are -1 where it has none. `dock` and `undock` end with
        being ready again.
    weight
        Per place what reaching it sooner is worth, 0 where it is no target.
    targets, meetings, rovers, carriers
        Indices.
    near
        (places, n): the other targets nearest to a target, then -1.
    entries, exits
        (types, places, n): the meetings from which a place is reached soonest, and those reached soonest from it.
    recover
        One flag: whether all rovers have to end aboard.
    """

    leg: Ints
    type_of: Ints
    start: Ints
    aboard: Ints
    ready: Ints
    capacity: Ints
    dock: Ints
    undock: Ints
    home: Ints
    weight: Ints
    targets: Ints
    meetings: Ints
    rovers: Ints
    carriers: Ints
    near: Ints
    entries: Ints
    exits: Ints
    recover: Ints


def encode(situation: Situation) -> Task:
    """Return the situation as arrays."""
    kinds = [kind.name for kind in situation.types]
    robots, index = situation.robots, situation.place_index
    number = {robot.name: i for i, robot in enumerate(robots)}
    leg = _legs(situation)
    targets = _ints([index[target.name] for target in situation.targets])
    meetings = _ints([index[name] for name in situation.meetings])
    weight = np.zeros(len(index), dtype=np.int64)
    weight[targets] = [1000 + round(1000 * target.reveal_m2) for target in situation.targets]
    goal, types = situation.goal, [situation.type_by_name[robot.type] for robot in robots]
    free = [(r if r.carrier is None else situation.robot_by_name[r.carrier]).free_at_ms for r in robots]
    homes = [-1 if r.home is None or not goal.return_home else index[r.home] for r in robots]
    return Task(
        leg=leg,
        type_of=_ints([kinds.index(robot.type) for robot in robots]),
        start=_ints([-1 if robot.place is None else index[robot.place] for robot in robots]),
        aboard=_ints([-1 if robot.carrier is None else number[robot.carrier] for robot in robots]),
        ready=_ints(free),
        capacity=_ints([kind.capacity for kind in types]),
        dock=_ints([max(1, kind.dock_ms) + EPSILON_MS for kind in types]),
        undock=_ints([max(1, kind.undock_ms) + EPSILON_MS for kind in types]),
        home=_ints([home if kind.role is Role.CARRIER else -1 for home, kind in zip(homes, types, strict=True)]),
        weight=weight,
        targets=targets,
        meetings=meetings,
        rovers=_ints([i for i, kind in enumerate(types) if kind.role is Role.ROVER]),
        carriers=_ints([i for i, kind in enumerate(types) if kind.role is Role.CARRIER]),
        near=_near(leg, targets),
        entries=_doors(leg.transpose(0, 2, 1), meetings),
        exits=_doors(leg, meetings),
        recover=_ints([int(goal.recover_rovers or goal.return_home)]),
    )


def events_of(situation: Situation, plan: Plan) -> Ints:
    """Return the events (n, 4) of a plan: its actions but the moves, after the starts."""
    index = situation.place_index
    number = {robot.name: i for i, robot in enumerate(situation.robots)}
    kinds = {ActionName.EXPLORE: EXPLORE, ActionName.UNDOCK: UNDOCK, ActionName.DOCK: DOCK}
    rows = [
        (
            START,
            i,
            -1 if robot.carrier is None else number[robot.carrier],
            -1 if robot.place is None else index[robot.place],
        )
        for i, robot in enumerate(situation.robots)
    ]
    rows += [
        (kinds[a.name], number[a.robot], -1 if a.carrier is None else number[a.carrier], index[a.place])
        for a in plan.actions
        if a.name in kinds
    ]
    return np.array(rows, dtype=np.int32).reshape(-1, 4)


def plan_of(situation: Situation, events: Ints) -> Plan:
    """Return the plan of a feasible list of events."""
    timeline = Timeline.of(situation)
    places, robots = situation.places, [robot.name for robot in situation.robots]
    for kind, robot, carrier, place in events.tolist():
        if kind == EXPLORE:
            timeline.explore(robots[robot], places[place])
        elif kind == UNDOCK:
            timeline.undock(robots[robot], places[place])
        elif kind == DOCK:
            timeline.dock(robots[robot], robots[carrier], places[place])
    if situation.goal.return_home:
        go_home(timeline)
    return timeline.plan


def _legs(situation: Situation) -> Ints:
    places = len(situation.places)
    leg = np.full((len(situation.types), places, places), NEVER, dtype=np.int64)
    for i, kind in enumerate(situation.types):
        table = situation.travel_ms[kind.name]
        leg[i] = np.where(table == UNREACHABLE, NEVER, np.maximum(table, 1) + EPSILON_MS)
        np.fill_diagonal(leg[i], 0)
        for target in situation.targets:
            if kind.name not in target.explorers:
                leg[i, :, situation.place_index[target.name]] = NEVER
    return leg


def _near(leg: Ints, targets: Ints) -> Ints:
    """Return per place the targets from which a type gets there soonest, or that it gets to soonest."""
    places = leg.shape[1]
    near = np.full((places, NEIGHBOURS), -1, dtype=np.int64)
    if len(targets) < 2 or not len(leg):
        return near
    apart = leg[:, targets[:, None], targets].min(axis=0)
    apart = np.minimum(apart, apart.T)
    np.fill_diagonal(apart, 2 * NEVER)
    order = np.argsort(apart, axis=1, kind="stable")[:, :NEIGHBOURS]
    found = np.where(np.take_along_axis(apart, order, axis=1) < NEVER, targets[order], -1)
    near[targets, : found.shape[1]] = found
    return near


def _doors(leg: Ints, meetings: Ints) -> Ints:
    """Return (types, places, n): the meetings with the shortest legs from each place, then -1."""
    types, places = leg.shape[:2]
    doors = np.full((types, places, DOORS), -1, dtype=np.int64)
    if len(meetings):
        apart = leg[:, :, meetings]
        order = np.argsort(apart, axis=2, kind="stable")[:, :, :DOORS]
        found = np.where(np.take_along_axis(apart, order, axis=2) < NEVER, meetings[order], -1)
        doors[:, :, : found.shape[2]] = found
    return doors


def _ints(values: list[int]) -> Ints:
    return np.array(values, dtype=np.int64)
