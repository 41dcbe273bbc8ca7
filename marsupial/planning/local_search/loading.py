"""Nets made of lists of events, and the lists of events of nets."""

from __future__ import annotations

import numpy as np

from marsupial.arrays import Ints, Ints32
from marsupial.native import inlined, native
from marsupial.planning.local_search.encoding import (
    ABOARD,
    AT,
    CAPACITY,
    DOCK,
    DOORS,
    EXPLORE,
    READY,
    ROVERS,
    START,
    TARGETS,
    TYPE,
    UNDOCK,
    ProblemData,
)
from marsupial.planning.local_search.net import (
    AFTER,
    BEFORE,
    DRIVING,
    END,
    FAR,
    FREE,
    KIND,
    LATE,
    LOAD,
    NODE,
    PLACE,
    REACHING,
    ROBOT,
    SPARE,
    SUMS,
    TOLL,
    UNUSED,
    WIDTH,
    Net,
    ask,
    assign,
    begin,
    begin_sortie,
    check_load,
    insert,
    new_transfer,
)


def net_of(data: ProblemData, transfers: int, seed: int) -> Net:
    """Return an empty net with room for that many transfers more than there could be use for."""
    robots, targets = len(data.robots), int(data.groups[TARGETS, 0])
    size = robots + targets + transfers + 2 * robots + 4 * targets
    work = np.zeros((6, max(SUMS, size)), dtype=np.int64)
    work[0, TOLL] = data.toll
    return Net(
        nodes=np.zeros((size, WIDTH), dtype=np.int64),
        log=np.zeros((size, WIDTH + 1), dtype=np.int64),
        work=work,
        leg=np.minimum(data.leg, FAR).astype(np.int32),
        robots=_robots(data),
        groups=data.groups,
        hints=_hints(data),
        seed=np.array([seed], dtype=np.uint64),
        recover=data.recover,
    )


def _robots(data: ProblemData) -> Ints:
    robots = np.column_stack([data.robots, np.zeros((len(data.robots), data.leg.shape[0]), dtype=np.int64)])
    rovers = data.members(ROVERS)
    robots[rovers, CAPACITY] = -1
    aboard = rovers[robots[rovers, ABOARD] >= 0]
    np.add.at(robots, (robots[aboard, ABOARD], LOAD + robots[aboard, TYPE]), 1)
    return robots


def _hints(data: ProblemData) -> Ints:
    robots, targets = len(data.robots), data.members(TARGETS)
    types, places = data.leg.shape[:2]
    node = np.full(places + 1, -1, dtype=np.int64)
    node[targets] = robots + np.arange(len(targets))
    doors = data.doors.transpose(2, 0, 1, 3).reshape(places, 2 * types * DOORS)
    return np.column_stack([node[:-1], data.worth, node[data.near], doors]).astype(np.int64)


@native
def load(net: Net, events: Ints32) -> bool:
    """Make the net that of a list of events (n, 4); nothing is timed yet, everything is asked for.

    False if somebody does what can't be done aboard, or on the ground.
    """
    _clear(net)
    heads, hosts = np.arange(len(net.robots)), net.robots[:, ABOARD].copy()
    for i in range(len(events)):
        kind, robot, carrier, place = events[i, 0], events[i, 1], events[i, 2], events[i, 3]
        if kind == START:
            continue
        node = net.hints[place, NODE] if kind == EXPLORE else new_transfer(net, kind, place)
        alike = net.nodes[robot, ROBOT]
        if (kind == UNDOCK) != (hosts[robot] >= 0) or node < 0:
            return False
        if kind == UNDOCK:
            begin_sortie(net, node, alike)
            heads[robot], carrier, hosts[robot] = node, hosts[robot], -1
        else:
            insert(net, node, alike, net.nodes[heads[robot], BEFORE])
        if kind == DOCK:
            hosts[robot] = carrier
        if kind != EXPLORE:
            assign(net, node, carrier, net.nodes[carrier, BEFORE])
        net.nodes[node, END] = i
    return True


@inlined
def _clear(net: Net) -> None:
    """Make the net one in which nothing is done."""
    robots, targets = len(net.robots), net.groups[TARGETS, 0]
    net.nodes[:] = 0
    net.work[0, REACHING] = net.work[0, DRIVING] = net.work[0, LATE] = 0
    begin(net)
    net.work[0, UNUSED] = 0
    for node in range(len(net.nodes) - 1, robots + targets - 1, -1):
        net.nodes[node, KIND] = FREE
        net.work[SPARE, net.work[0, UNUSED]] = node
        net.work[0, UNUSED] += 1
    for robot in range(robots):
        row = net.nodes[robot]
        row[KIND], row[PLACE], row[END] = START, net.robots[robot, AT], net.robots[robot, READY]
        row[ROBOT] = robot if net.robots[robot, CAPACITY] >= 0 else _alike(net, robot)
        row[BEFORE] = row[AFTER] = robot
        if net.robots[robot, ABOARD] >= 0:
            row[BEFORE] = -1
            check_load(net, net.robots[robot, ABOARD])
        else:
            ask(net, robot)
    for k in range(targets):
        row = net.nodes[robots + k]
        row[KIND], row[PLACE] = EXPLORE, net.groups[TARGETS, 1 + k]
        row[BEFORE] = -1


@inlined
def _alike(net: Net, robot: int) -> int:
    """Return the first rover of the same type."""
    first = 0
    while net.robots[first, TYPE] != net.robots[robot, TYPE]:
        first += 1
    return first


def events_in(nodes: Ints, robots: Ints) -> Ints32:
    """Return the list of events (n, 4), starts first, of the nodes of a timed net and its robots."""
    numbers = np.flatnonzero((nodes[:, KIND] != FREE) & (nodes[:, BEFORE] >= 0) & (nodes[:, KIND] != START))
    waiting: dict[tuple[int, int], list[int]] = {}
    events = [(START, i, int(row[ABOARD]), int(row[AT])) for i, row in enumerate(robots)]
    on_sortie = {i: i for i in range(len(robots))}
    for i, row in enumerate(robots):
        if row[ABOARD] >= 0:
            waiting.setdefault((int(row[ABOARD]), int(row[TYPE])), []).append(i)
    for node in numbers[np.argsort(nodes[numbers, END], kind="stable")].tolist():
        kind, robot, carrier, place = map(int, nodes[node, : PLACE + 1])
        if kind == UNDOCK:
            on_sortie[node] = waiting[carrier, int(robots[robot, TYPE])].pop(0)
        if robots[robot, CAPACITY] < 0:
            before = node if kind == UNDOCK else int(nodes[node, BEFORE])
            on_sortie[node] = robot = on_sortie[before]
        if kind == DOCK:
            waiting.setdefault((carrier, int(robots[robot, TYPE])), []).append(robot)
        events.append((kind, robot, -1 if kind == EXPLORE else carrier, place))
    return np.array(events, dtype=np.int32).reshape(-1, 4)
