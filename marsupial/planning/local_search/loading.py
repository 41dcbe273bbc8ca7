"""Linked schedules from lists of events, and lists of events from linked schedules."""

import numpy as np

from marsupial.arrays import Ints, Ints32
from marsupial.native import inlined, native
from marsupial.planning.local_search import columns as col
from marsupial.planning.local_search import linked_schedule as ops
from marsupial.planning.local_search.encoding import ProblemData
from marsupial.planning.local_search.linked_schedule import LinkedSchedule


def empty_schedule(data: ProblemData, transfers: int, seed: int) -> LinkedSchedule:
    """Return an empty schedule with room for `transfers` and for all that the search may add."""
    robots, targets = len(data.robots), int(data.groups[col.TARGETS, 0])
    size = robots + targets + transfers + 2 * robots + 4 * targets
    return LinkedSchedule(
        nodes=np.zeros((size, col.WIDTH), dtype=np.int64),
        log=np.zeros((size, col.WIDTH + 1), dtype=np.int64),
        work=np.zeros((col.ROWS, max(col.SUMS, size)), dtype=np.int64),
        leg=np.minimum(data.leg, col.FAR).astype(np.int32),
        robots=_robots(data),
        groups=data.groups,
        hints=_hints(data),
        seed=np.array([seed], dtype=np.uint64),
        recover=data.recover,
    )


def _robots(data: ProblemData) -> Ints:
    load = np.zeros((len(data.robots), data.leg.shape[0]), dtype=np.int64)
    robots = np.column_stack([data.robots, load, data.seats])
    rovers = data.members(col.ROVERS)
    robots[rovers, col.CAPACITY] = -1
    aboard = rovers[robots[rovers, col.ABOARD] >= 0]
    np.add.at(robots, (robots[aboard, col.ABOARD], col.LOAD + robots[aboard, col.TYPE]), 1)
    return robots


def _hints(data: ProblemData) -> Ints:
    robots, targets = len(data.robots), data.members(col.TARGETS)
    types, places = data.leg.shape[:2]
    node = np.full(places + 1, -1, dtype=np.int64)
    node[targets] = robots + np.arange(len(targets))
    near_meetings = data.near_meetings.transpose(2, 0, 1, 3).reshape(places, 2 * types * col.NEAR_MEETINGS)
    return np.column_stack([node[:-1], data.worth, node[data.near], near_meetings]).astype(np.int64)


@native
def load(sched: LinkedSchedule, events: Ints32) -> bool:
    """Load events (n, 4), queued for timing; return False if a robot does aboard what it can't, or on the ground."""
    _clear(sched)
    heads, hosts = np.arange(len(sched.robots)), sched.robots[:, col.ABOARD].copy()
    for i in range(len(events)):
        kind, robot, carrier, place = events[i, 0], events[i, 1], events[i, 2], events[i, 3]
        if kind == col.START:
            continue
        node = sched.hints[place, col.NODE] if kind == col.EXPLORE else ops.new_transfer(sched, kind, place)
        first_of_type = sched.nodes[robot, col.ROBOT]
        if (kind == col.UNDOCK) != (hosts[robot] >= 0) or node < 0:
            return False
        if kind == col.UNDOCK:
            ops.begin_sortie(sched, node, first_of_type)
            heads[robot], carrier, hosts[robot] = node, hosts[robot], -1
        else:
            ops.insert(sched, node, first_of_type, sched.nodes[heads[robot], col.BEFORE])
        if kind == col.DOCK:
            hosts[robot] = carrier
        if kind != col.EXPLORE:
            ops.assign(sched, node, carrier, sched.nodes[carrier, col.BEFORE])
        # Any increasing number will do: it orders the queue, and timing replaces it.
        sched.nodes[node, col.END] = i
    return True


@inlined
def _clear(sched: LinkedSchedule) -> None:
    robots, targets = len(sched.robots), sched.groups[col.TARGETS, 0]
    for node in range(len(sched.nodes)):
        for column in range(sched.nodes.shape[1]):
            sched.nodes[node, column] = 0
    sched.work[0, col.REACHING] = sched.work[0, col.DRIVING] = sched.work[0, col.LATE] = 0
    ops.begin(sched)
    sched.work[0, col.UNUSED] = 0
    for node in range(len(sched.nodes) - 1, robots + targets - 1, -1):
        sched.nodes[node, col.KIND] = col.FREE
        sched.work[col.SPARE, sched.work[0, col.UNUSED]] = node
        sched.work[0, col.UNUSED] += 1
    for robot in range(robots):
        row = sched.nodes[robot]
        row[col.KIND], row[col.PLACE] = col.START, sched.robots[robot, col.AT]
        row[col.END] = sched.robots[robot, col.READY]
        row[col.ROBOT] = robot if sched.robots[robot, col.CAPACITY] >= 0 else _first_of_type(sched, robot)
        row[col.BEFORE] = row[col.AFTER] = robot
        if sched.robots[robot, col.ABOARD] >= 0:
            row[col.BEFORE] = -1
            ops.check_load(sched, sched.robots[robot, col.ABOARD])
        else:
            ops.enqueue(sched, robot)
    for k in range(targets):
        row = sched.nodes[robots + k]
        row[col.KIND], row[col.PLACE] = col.EXPLORE, sched.groups[col.TARGETS, 1 + k]
        row[col.BEFORE] = -1


@inlined
def _first_of_type(sched: LinkedSchedule, robot: int) -> int:
    first = 0
    while sched.robots[first, col.TYPE] != sched.robots[robot, col.TYPE]:
        first += 1
    return first


def events_in(nodes: Ints, robots: Ints) -> Ints32:
    """Return the list of events (n, 4), starts first, of the nodes of a timed schedule and its robots."""
    numbers = np.flatnonzero(~np.isin(nodes[:, col.KIND], (col.FREE, col.START)) & (nodes[:, col.BEFORE] >= 0))
    waiting: dict[tuple[int, int], list[int]] = {}
    events = [(col.START, i, int(row[col.ABOARD]), int(row[col.AT])) for i, row in enumerate(robots)]
    on_sortie = {i: i for i in range(len(robots))}
    for i, row in enumerate(robots):
        if row[col.ABOARD] >= 0:
            waiting.setdefault((int(row[col.ABOARD]), int(row[col.TYPE])), []).append(i)
    for node in numbers[np.argsort(nodes[numbers, col.END], kind="stable")].tolist():
        kind, robot, carrier, place = map(int, nodes[node, : col.PLACE + 1])
        if kind == col.UNDOCK:
            # First aboard, first set down: any rover of the type would do.
            on_sortie[node] = waiting[carrier, int(robots[robot, col.TYPE])].pop(0)
        if robots[robot, col.CAPACITY] < 0:
            before = node if kind == col.UNDOCK else int(nodes[node, col.BEFORE])
            on_sortie[node] = robot = on_sortie[before]
        if kind == col.DOCK:
            waiting.setdefault((carrier, int(robots[robot, col.TYPE])), []).append(robot)
        events.append((kind, robot, -1 if kind == col.EXPLORE else carrier, place))
    return np.array(events, dtype=np.int32).reshape(-1, 4)
