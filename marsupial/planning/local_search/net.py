"""The state of a search: events linked into one chain per carrier and one per outing.

Rovers of a type are as good as each other once they are aboard. So a plan is told in outings and not in rovers: an
outing begins where a rover is set down, or stands at first, and ends where it is picked up, or with its last target.
Who goes on an outing is decided when the plan is read off; the search only sees to it that somebody is aboard. So a
ride may go from one carrier to another without anything else being changed.

Each event knows the one before it and the one after it in its outing, and in the route of its carrier where it has
one. A route is closed to a ring by the carrier's `START`, an outing by the undock or `START` it begins with. A change
touches a few rows and not a list: whatever is about to be written is logged first, and an unsuccessful change is undone
from the log.

Nodes are numbered: the starts of all robots, then the targets, then the rides, which come and go.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numba import njit

from marsupial.native import native
from marsupial.planning.local_search.encoding import (
    ABOARD,
    AT,
    CAPACITY,
    DOCK,
    DOORS,
    EXPLORE,
    NEIGHBOURS,
    READY,
    ROVERS,
    START,
    TARGETS,
    TYPE,
    UNDOCK,
    Ints,
    Task,
)

compiled = njit(nogil=True, _nrt=False, forceinline=True)
"""For functions that only compiled functions call and that make no arrays: nobody counts references to those passed.

They become part of whoever calls them, since a call would copy the whole `Net`.
"""

FREE = 4
"""Kind of a ride that is not in use."""

KIND, ROBOT, CARRIER, PLACE, BEFORE, AFTER, CARRIER_BEFORE, CARRIER_AFTER, END, DRIVE, STAMP, COUNTED = range(12)
WIDTH = 12
"""Columns of nodes. `END` is from when the robots are ready again, `DRIVE` the driving it takes, `COUNTED` whether the
sums contain it; a start's `CARRIER_BEFORE` holds when its robot is home, 0 where it has no home to go to. `ROBOT` of
what a rover does is the first rover of its type. `BEFORE` is -1 out of all chains."""

LOAD = 8
"""Column of robots: how many rovers of the first type are aboard at first; those of the other types follow."""

EPOCH, LOGGED, QUEUED, CHECKS, UNUSED, DROPPED, HELD = range(7)
REACHING, DRIVING, LATE, OLD_REACHING, OLD_DRIVING, OLD_LATE, OLD_UNUSED, DUE, TOLL = range(7, 16)
SUMS = 16
"""Columns of the first row of `work`: lengths of its other rows, sums over the nodes, the time that is late, and what
setting a rover down counts as driving."""

QUEUE, CHECK, RIDES, DROP, TAKEN = range(1, 6)
"""Other rows of `work`: nodes to be timed, carriers whose load is to be checked, rides not in use, rides no longer in
use once the change is accepted, targets taken out."""

NODE, WORTH, NEAR = 0, 1, 2
"""Columns of `hints`; after the nodes of the nearest targets come the doors: entries and exits per type."""

FAR = (1 << 31) - 1
"""A leg that is this long has no path."""

LONGEST_SEGMENT = 8
"""How many targets are moved at once at most."""


class Net(NamedTuple):
    """What a search remembers between calls: few arrays, for each of them costs time in every compiled call.

    Attributes
    ----------
    nodes
        int64 (nodes, `WIDTH`).
    log
        int64 (nodes, `WIDTH` + 1): rows as they were before the change, and which they are.
    work
        int64 (6, n): see `SUMS` and `QUEUE`.
    leg
        int32 (types, places, places), as in `Task`, `FAR` without a path.
    robots, groups
        As in `Task`, but that the capacity of rovers is -1, and with `LOAD`.
    hints
        int32 (places, n): see `NODE`.
    seed
        uint64 (1,): state of the random numbers.
    """

    nodes: Ints
    log: Ints
    work: Ints
    leg: Ints
    robots: Ints
    groups: Ints
    hints: Ints
    seed: Ints
    recover: bool


def net_of(task: Task, rides: int, seed: int) -> Net:
    """Return an empty net with room for that many rides more than there could be use for."""
    robots, targets = len(task.robots), int(task.groups[TARGETS, 0])
    size = robots + targets + rides + 2 * robots + 4 * targets
    work = np.zeros((6, max(SUMS, size)), dtype=np.int64)
    work[0, TOLL] = task.toll
    return Net(
        nodes=np.zeros((size, WIDTH), dtype=np.int64),
        log=np.zeros((size, WIDTH + 1), dtype=np.int64),
        work=work,
        leg=np.minimum(task.leg, FAR).astype(np.int32),
        robots=_robots(task),
        groups=task.groups,
        hints=_hints(task),
        seed=np.array([seed], dtype=np.uint64),
        recover=task.recover,
    )


def _robots(task: Task) -> Ints:
    robots = np.column_stack([task.robots, np.zeros((len(task.robots), task.leg.shape[0]), dtype=np.int64)])
    rovers = task.members(ROVERS)
    robots[rovers, CAPACITY] = -1
    aboard = rovers[robots[rovers, ABOARD] >= 0]
    np.add.at(robots, (robots[aboard, ABOARD], LOAD + robots[aboard, TYPE]), 1)
    return robots


def _hints(task: Task) -> Ints:
    robots, targets = len(task.robots), task.members(TARGETS)
    types, places = task.leg.shape[:2]
    node = np.full(places + 1, -1, dtype=np.int64)
    node[targets] = robots + np.arange(len(targets))
    doors = task.doors.transpose(2, 0, 1, 3).reshape(places, 2 * types * DOORS)
    return np.column_stack([node[:-1], task.worth, node[task.near], doors]).astype(np.int64)


@compiled
def draw(net: Net, n: int) -> Any:
    """Return a random number from 0 to n - 1 (xorshift)."""
    x = net.seed[0]
    x ^= x << np.uint64(13)
    x ^= x >> np.uint64(7)
    x ^= x << np.uint64(17)
    net.seed[0] = x
    return np.int64(x >> np.uint64(33)) % n


@compiled
def pick(net: Net, group: int) -> Any:
    """Return a random member of a group that has any."""
    return net.groups[group, 1 + draw(net, net.groups[group, 0])]


@compiled
def door(net: Net, way: int, robot: int, place: int) -> Any:
    """Return one of the few meetings best for getting to a place or away from it, the first ones more often, or -1."""
    types = net.leg.shape[0]
    first = NEAR + NEIGHBOURS + (way * types + net.robots[robot, 0]) * DOORS
    count = 0
    while count < DOORS and net.hints[place, first + count] >= 0:
        count += 1
    return net.hints[place, first + min(draw(net, count), draw(net, count))] if count else -1


@compiled
def after(net: Net, node: int, robot: int) -> Any:
    """Return the node after one in the chain of a robot."""
    return net.nodes[node, AFTER] if net.nodes[node, ROBOT] == robot else net.nodes[node, CARRIER_AFTER]


@compiled
def before(net: Net, node: int, robot: int) -> Any:
    """Return the node before one in the chain of a robot."""
    return net.nodes[node, BEFORE] if net.nodes[node, ROBOT] == robot else net.nodes[node, CARRIER_BEFORE]


@compiled
def touch(net: Net, node: int) -> None:
    """Log a node before it is written to."""
    if net.nodes[node, STAMP] != net.work[0, EPOCH]:
        at = net.work[0, LOGGED]
        for k in range(WIDTH):
            net.log[at, k] = net.nodes[node, k]
        net.log[at, WIDTH] = node
        net.work[0, LOGGED] = at + 1
        net.nodes[node, STAMP] = net.work[0, EPOCH]


@compiled
def first_load(net: Net, carrier: int) -> Any:
    """Return how many rovers are aboard a carrier at first."""
    load = np.int64(0)
    for kind in range(len(net.leg)):
        load += net.robots[carrier, LOAD + kind]
    return load


@compiled
def ask(net: Net, node: int) -> None:
    """Have a node timed again."""
    _note(net, QUEUE, QUEUED, node)


@compiled
def check_load(net: Net, carrier: int) -> None:
    """Have the load of a carrier checked."""
    _note(net, CHECK, CHECKS, carrier)


@compiled
def _note(net: Net, row: int, length: int, number: int) -> None:
    """Add a number to a row of `work`, unless it stands there."""
    n = net.work[0, length]
    for i in range(n):
        if net.work[row, i] == number:
            return
    net.work[row, n] = number
    net.work[0, length] = n + 1


@compiled
def link(net: Net, one: int, other: int, robot: int) -> None:
    """Let two nodes follow each other in the chain of a robot."""
    touch(net, one)
    touch(net, other)
    net.nodes[one, AFTER if net.nodes[one, ROBOT] == robot else CARRIER_AFTER] = other
    net.nodes[other, BEFORE if net.nodes[other, ROBOT] == robot else CARRIER_BEFORE] = one
    ask(net, other)


@compiled
def insert(net: Net, node: int, robot: int, at: int) -> None:
    """Put a node into the chain of its robot, behind node `at`."""
    following = after(net, at, robot)
    touch(net, node)
    net.nodes[node, ROBOT] = robot
    if not net.nodes[node, COUNTED]:
        net.nodes[node, END] = net.nodes[at, END]
    link(net, node, following, robot)
    link(net, at, node, robot)


@compiled
def begin_outing(net: Net, undock: int, rover: int) -> None:
    """Let an undock begin an outing with nothing in it."""
    touch(net, undock)
    net.nodes[undock, ROBOT] = rover
    net.nodes[undock, BEFORE] = net.nodes[undock, AFTER] = undock
    ask(net, undock)


@compiled
def host(net: Net, ride: int, carrier: int, at: int) -> None:
    """Put a ride into the chain of a carrier, behind node `at`."""
    following = after(net, at, carrier)
    touch(net, ride)
    net.nodes[ride, CARRIER] = carrier
    if not net.nodes[ride, COUNTED]:
        net.nodes[ride, END] = max(net.nodes[ride, END], net.nodes[at, END])
    link(net, ride, following, carrier)
    link(net, at, ride, carrier)
    check_load(net, carrier)


@compiled
def unhost(net: Net, ride: int) -> None:
    """Take a ride out of the chain of its carrier."""
    carrier = net.nodes[ride, CARRIER]
    link(net, net.nodes[ride, CARRIER_BEFORE], net.nodes[ride, CARRIER_AFTER], carrier)
    check_load(net, carrier)


@compiled
def lateness(net: Net, end: int) -> Any:
    """Return how much of a time is late."""
    return max(np.int64(0), end - net.work[0, DUE])


@compiled
def discount(net: Net, node: int) -> None:
    """Take what a node adds to the sums out of them."""
    if net.nodes[node, COUNTED]:
        touch(net, node)
        net.nodes[node, COUNTED] = 0
        _add(net, node, -1)


@compiled
def count(net: Net, node: int) -> None:
    """Add a node to the sums."""
    net.nodes[node, COUNTED] = 1
    _add(net, node, 1)


@compiled
def _add(net: Net, node: int, times: int) -> None:
    net.work[0, DRIVING] += times * net.nodes[node, DRIVE]
    kind, end = net.nodes[node, KIND], net.nodes[node, END]
    if kind == START:
        end = net.nodes[node, CARRIER_BEFORE]
    elif kind == EXPLORE:
        net.work[0, REACHING] += times * net.hints[net.nodes[node, PLACE], WORTH] * end
    if end > net.work[0, DUE]:
        net.work[0, LATE] += times * lateness(net, end)


@compiled
def take_out(net: Net, node: int) -> None:
    """Take a node out of all chains; a target has to be put back, a ride is gone."""
    discount(net, node)
    link(net, net.nodes[node, BEFORE], net.nodes[node, AFTER], net.nodes[node, ROBOT])
    touch(net, node)
    net.nodes[node, BEFORE] = -1
    if net.nodes[node, KIND] != EXPLORE:
        unhost(net, node)
        net.nodes[node, KIND] = FREE
        net.work[DROP, net.work[0, DROPPED]] = node
        net.work[0, DROPPED] += 1


@compiled
def new_ride(net: Net, kind: int, place: int) -> Any:
    """Return a ride that is not yet in any chain, or -1 if there are too many."""
    if not net.work[0, UNUSED]:
        return -1
    net.work[0, UNUSED] -= 1
    node = net.work[RIDES, net.work[0, UNUSED]]
    touch(net, node)
    net.nodes[node, KIND] = kind
    net.nodes[node, PLACE] = place
    net.nodes[node, COUNTED] = 0
    net.nodes[node, DRIVE] = 0
    net.nodes[node, END] = 0
    return node


@compiled
def begin(net: Net) -> None:
    """Begin a change."""
    net.work[0, EPOCH] += 1
    net.work[0, OLD_REACHING] = net.work[0, REACHING]
    net.work[0, OLD_DRIVING] = net.work[0, DRIVING]
    net.work[0, OLD_LATE] = net.work[0, LATE]
    net.work[0, OLD_UNUSED] = net.work[0, UNUSED]
    net.work[0, LOGGED] = 0
    net.work[0, QUEUED] = 0
    net.work[0, CHECKS] = 0
    net.work[0, DROPPED] = 0


@compiled
def undo(net: Net) -> None:
    """Take back everything since `begin`."""
    for i in range(net.work[0, LOGGED]):
        node = net.log[i, WIDTH]
        for k in range(WIDTH):
            net.nodes[node, k] = net.log[i, k]
    net.work[0, REACHING] = net.work[0, OLD_REACHING]
    net.work[0, DRIVING] = net.work[0, OLD_DRIVING]
    net.work[0, LATE] = net.work[0, OLD_LATE]
    net.work[0, UNUSED] = net.work[0, OLD_UNUSED]


@compiled
def keep(net: Net) -> None:
    """Keep everything since `begin`."""
    for i in range(net.work[0, DROPPED]):
        net.work[RIDES, net.work[0, UNUSED]] = net.work[DROP, i]
        net.work[0, UNUSED] += 1


@compiled
def head_of(net: Net, node: int) -> Any:
    """Return the undock or start that the outing of a node begins with."""
    while net.nodes[node, KIND] != START and net.nodes[node, KIND] != UNDOCK:
        node = net.nodes[node, AFTER]
    return node


@compiled
def is_aboard(net: Net, node: int, robot: int) -> bool:
    """Say whether after a node a robot is aboard a carrier: the node ends its outing."""
    return net.nodes[node, KIND] == DOCK and net.nodes[node, ROBOT] == robot


@compiled
def _alike(net: Net, robot: int) -> Any:
    """Return the first rover of the same type."""
    first = 0
    while net.robots[first, TYPE] != net.robots[robot, TYPE]:
        first += 1
    return first


@native
def load(net: Net, events: Ints) -> bool:
    """Make the net that of a list of events (n, 4); nothing is timed yet, everything is asked for.

    False if somebody does what can't be done aboard, or on the ground.
    """
    robots, targets = len(net.robots), net.groups[TARGETS, 0]
    net.nodes[:] = 0
    net.work[0, REACHING] = net.work[0, DRIVING] = net.work[0, LATE] = 0
    begin(net)
    net.work[0, UNUSED] = 0
    for node in range(len(net.nodes) - 1, robots + targets - 1, -1):
        net.nodes[node, KIND] = FREE
        net.work[RIDES, net.work[0, UNUSED]] = node
        net.work[0, UNUSED] += 1
    heads, hosts = np.arange(robots), net.robots[:, ABOARD].copy()
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
    for i in range(len(events)):
        kind, robot, carrier, place = events[i, 0], events[i, 1], events[i, 2], events[i, 3]
        if kind == START:
            continue
        node = net.hints[place, NODE] if kind == EXPLORE else new_ride(net, kind, place)
        alike = net.nodes[robot, ROBOT]
        if (kind == UNDOCK) != (hosts[robot] >= 0) or node < 0:
            return False
        if kind == UNDOCK:
            begin_outing(net, node, alike)
            heads[robot], carrier, hosts[robot] = node, hosts[robot], -1
        else:
            insert(net, node, alike, net.nodes[heads[robot], BEFORE])
        if kind == DOCK:
            hosts[robot] = carrier
        if kind != EXPLORE:
            host(net, node, carrier, net.nodes[carrier, BEFORE])
        net.nodes[node, END] = i
    return True


def events_in(nodes: Ints, robots: Ints) -> Ints:
    """Return the list of events int32 (n, 4), starts first, of the nodes of a timed net and its robots."""
    numbers = np.flatnonzero((nodes[:, KIND] != FREE) & (nodes[:, BEFORE] >= 0) & (nodes[:, KIND] != START))
    waiting: dict[tuple[int, int], list[int]] = {}
    events = [(START, i, int(row[ABOARD]), int(row[AT])) for i, row in enumerate(robots)]
    on_outing = {i: i for i in range(len(robots))}
    for i, row in enumerate(robots):
        if row[ABOARD] >= 0:
            waiting.setdefault((int(row[ABOARD]), int(row[TYPE])), []).append(i)
    for node in numbers[np.argsort(nodes[numbers, END], kind="stable")].tolist():
        kind, robot, carrier, place = map(int, nodes[node, : PLACE + 1])
        if kind == UNDOCK:
            on_outing[node] = waiting[carrier, int(robots[robot, TYPE])].pop(0)
        if robots[robot, CAPACITY] < 0:
            before = node if kind == UNDOCK else int(nodes[node, BEFORE])
            on_outing[node] = robot = on_outing[before]
        if kind == DOCK:
            waiting.setdefault((carrier, int(robots[robot, TYPE])), []).append(robot)
        events.append((kind, robot, -1 if kind == EXPLORE else carrier, place))
    return np.array(events, dtype=np.int32).reshape(-1, 4)
