"""Situations as arrays of numbers, and plans as lists of events, for the compiled search.

A plan is one linear list of events: a robot explores a target, a rover is set down, a rover is picked up. Driving to
where an event happens is implied, and so is the carrier that a rover is set down from: the one it is aboard. The list
begins with one `START` per robot, so that everything else can be inserted after something.
"""

from typing import NamedTuple

import numpy as np

from marsupial.arrays import Ints, Ints32
from marsupial.model import MAKESPAN, Objective, RobotState, Role, Situation
from marsupial.model.plan import EPSILON_MS, ActionName, Plan
from marsupial.model.seats import most_aboard
from marsupial.planning.local_search import columns as col
from marsupial.planning.schedule.costs import NEVER, driving_ms, staying_ms
from marsupial.planning.schedule.recovery import go_home
from marsupial.planning.schedule.timeline import Timeline, free_at_ms


class ProblemData(NamedTuple):
    """A situation as arrays; robots, types and places are indices in its order, times in ms."""

    # (types, places, places): from being ready at one place to being ready again after driving to the other: `NEVER`
    # without a path; on the diagonal 0, or `NEVER` where the type can't stand
    leg: Ints
    robots: Ints  # (robots, 8): `TYPE` and so on
    # (robots, types), without columns where all rovers fit on all carriers: for carriers the most rovers aboard that
    # take the seats of each type, for rovers whether they take the same seats as each type
    seats: Ints
    worth: Ints  # per place the weight of the time when it is reached, 0 where it is no target
    groups: Ints  # (4, n): the number of targets, meetings, rovers and carriers, followed by their indices
    near: Ints  # (places, n): the other targets nearest to a target, then -1
    # (2, types, places, n): the meetings from which a place is reached soonest (`ENTRIES`), and those reached soonest
    # from it (`EXITS`), then -1
    near_meetings: Ints
    recover: bool  # whether all rovers have to end aboard

    def members(self, group: int) -> Ints:
        return self.groups[group, 1 : 1 + self.groups[group, 0]]

    def fits(self, rover: int, carrier: int) -> bool:
        """Return whether a carrier can carry a rover."""
        most = self.robots[carrier, col.CAPACITY]
        return bool((self.seats[carrier, self.robots[rover, col.TYPE]] if self.seats.size else most) > 0)


def encode(situation: Situation, objective: Objective = MAKESPAN) -> ProblemData:
    """Return the situation as arrays; worths are in thousandths."""
    kinds = [kind.name for kind in situation.types]
    index = situation.place_index
    leg = _legs(situation)
    targets = np.array([index[target.name] for target in situation.targets], dtype=np.int64)
    meetings = np.array([index[name] for name in situation.meetings], dtype=np.int64)
    worth = np.zeros(len(index), dtype=np.int64)
    worth[targets] = [objective.weight(target) for target in situation.targets]
    roles = [situation.type_by_name[robot.type].role for robot in situation.robots]
    rovers, carriers = (np.flatnonzero([role is sought for role in roles]) for sought in (Role.ROVER, Role.CARRIER))
    robots = np.array([_row(situation, robot, kinds) for robot in situation.robots], dtype=np.int64).reshape(-1, 8)
    from_meetings, to_meetings = leg.transpose(0, 2, 1)[:, :, meetings], leg[:, :, meetings]
    near_meetings = np.stack([_least_apart(to, meetings, col.NEAR_MEETINGS) for to in (from_meetings, to_meetings)])
    rover_kinds, carrier_kinds = (np.unique(robots[members, col.TYPE]) for members in (rovers, carriers))
    return ProblemData(
        leg=leg,
        robots=robots,
        seats=_seats(situation),
        worth=worth,
        groups=_groups(targets, meetings, rovers, carriers),
        near=_near(leg, targets, rover_kinds, carrier_kinds, near_meetings[col.ENTRIES]),
        near_meetings=near_meetings,
        recover=situation.goal.aboard,
    )


def _row(situation: Situation, robot: RobotState, kinds: list[str]) -> tuple[int, ...]:
    kind, index = situation.type_by_name[robot.type], situation.place_index
    goes_home = situation.goal.return_home and kind.role is Role.CARRIER and robot.home is not None
    return (
        kinds.index(kind.name),
        -1 if robot.place is None else index[robot.place],
        -1 if robot.carrier is None else situation.robots.index(situation.robot_by_name[robot.carrier]),
        free_at_ms(situation, robot),
        kind.capacity,
        max(1, kind.dock_ms) + EPSILON_MS,
        max(1, kind.undock_ms) + EPSILON_MS,
        index[robot.home or ""] if goes_home else -1,
    )


def _seats(situation: Situation) -> Ints:
    if not situation.has_seats:
        return np.zeros((len(situation.robots), 0), dtype=np.int64)
    kinds = [situation.type_by_name[robot.type] for robot in situation.robots]
    rows = [
        [
            most_aboard(kind, other.seat) if kind.role is Role.CARRIER else kind.seat == other.seat
            for other in situation.types
        ]
        for kind in kinds
    ]
    return np.array(rows, dtype=np.int64).reshape(len(kinds), len(situation.types))


def _groups(*members: Ints) -> Ints:
    groups = np.full((len(members), 1 + max(map(len, members))), -1, dtype=np.int64)
    for group, row in zip(members, groups, strict=True):
        row[0] = len(group)
        row[1 : 1 + len(group)] = group
    return groups


def events_of(situation: Situation, plan: Plan) -> Ints32:
    """Return the events (n, 4) of a plan, after the starts: its actions but the moves, and each target only once.

    Plans may visit a target again, but a linked schedule has one node per target: twice in it, it would close a circle.
    """
    places: dict[str | None, int] = {None: -1, **{name: i for i, name in enumerate(situation.places)}}
    robots: dict[str | None, int] = {None: -1, **{robot.name: i for i, robot in enumerate(situation.robots)}}
    first = {a.place: a for a in reversed(plan.actions) if a.name is ActionName.EXPLORE}
    kinds = {ActionName.EXPLORE: col.EXPLORE, ActionName.UNDOCK: col.UNDOCK, ActionName.DOCK: col.DOCK}
    events = [(col.START, robot.name, robot.carrier, robot.place) for robot in situation.robots]
    for action in plan.actions:
        if action.name in kinds and first.get(action.place, action) is action:
            events.append((kinds[action.name], action.robot, action.carrier, action.place))
    rows = [(kind, robots[robot], robots[carrier], places[place]) for kind, robot, carrier, place in events]
    return np.array(rows, dtype=np.int32).reshape(-1, 4)


def plan_of(situation: Situation, events: Ints32) -> Plan:
    """Return the plan of a feasible list of events."""
    timeline = Timeline.of(situation)
    places, robots = situation.places, [robot.name for robot in situation.robots]
    for kind, robot, carrier, place in events.tolist():
        if kind == col.EXPLORE:
            timeline.explore(robots[robot], places[place])
        elif kind == col.UNDOCK:
            timeline.undock(robots[robot], places[place])
        elif kind == col.DOCK:
            timeline.dock(robots[robot], robots[carrier], places[place])
    if situation.goal.return_home:
        go_home(timeline)
    return timeline.plan


def _legs(situation: Situation) -> Ints:
    places = len(situation.places)
    leg = np.full((len(situation.types), places, places), NEVER, dtype=np.int64)
    for i, kind in enumerate(situation.types):
        leg[i] = np.minimum(driving_ms(situation.travel_ms[kind.name]) + EPSILON_MS, NEVER)
        np.fill_diagonal(leg[i], staying_ms(situation, kind.name))
        for target in situation.targets:
            if kind.name not in target.explorers:
                leg[i, :, situation.place_index[target.name]] = NEVER
    return leg


def _near(leg: Ints, targets: Ints, rovers: Ints, carriers: Ints, entries: Ints) -> Ints:
    """Return per target the nearest others, by the time a robot drives, or is carried from meeting to meeting."""
    places = leg.shape[1]
    near = np.full((places, col.NEIGHBOURS), -1, dtype=np.int64)
    if len(targets) < 2 or not len(leg):
        return near
    apart = leg[:, targets[:, None], targets].min(axis=0)
    for carrier in carriers:
        for rover in rovers:
            base, walk = targets.copy(), np.zeros(len(targets), dtype=np.int64)
            near_meetings = entries[rover, targets, 0]
            walks = (near_meetings >= 0) & (leg[rover, near_meetings, targets] < NEVER)
            base[walks], walk[walks] = near_meetings[walks], leg[rover, near_meetings[walks], targets[walks]]
            apart = np.minimum(apart, leg[carrier, base[:, None], base] + walk[:, None] + walk)
    apart = np.minimum(apart, apart.T)
    np.fill_diagonal(apart, 4 * NEVER)
    near[targets] = _least_apart(apart, targets, col.NEIGHBOURS)
    return near


def _least_apart(apart: Ints, members: Ints, n: int) -> Ints:
    """Return (..., n): the nearest members by a table of distances (..., members), then -1."""
    order = np.argsort(apart, axis=-1, kind="stable")[..., :n]
    found = np.full((*apart.shape[:-1], n), -1, dtype=np.int64)
    found[..., : order.shape[-1]] = np.where(np.take_along_axis(apart, order, axis=-1) < NEVER, members[order], -1)
    return found
