"""The state of a search: events linked into one chain per carrier (its route) and one per sortie.

Rovers of a type are as good as each other once they are aboard. So a plan is told in sorties and not in rovers: a
sortie begins where a rover is set down, or stands at first, and ends where it is picked up, or with its last target.
Who goes on a sortie is decided when the plan is read off; the search only sees to it that somebody is aboard. So a
transfer (a dock or an undock) may go from one carrier to another without anything else being changed.

Each event knows the one before it and the one after it in its sortie, and in the route of its carrier where it has
one. A route is closed to a ring by the carrier's `START`, a sortie by the undock or `START` it begins with. A change
touches a few rows and not a list: whatever is about to be written is logged first, and an unsuccessful change is undone
from the log.

Nodes are numbered: the starts of all robots, then the targets, then the transfers, which come and go.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from marsupial.arrays import Ints, Ints32, Words
from marsupial.native import inlined
from marsupial.planning.local_search.encoding import (
    CAPACITY,
    DOCK,
    DOORS,
    EXPLORE,
    NEIGHBOURS,
    START,
    TYPE,
    UNDOCK,
)

FREE = 4
"""Kind of a transfer that is not in use."""

KIND, ROBOT, CARRIER, PLACE, BEFORE, AFTER, CARRIER_BEFORE, CARRIER_AFTER, END, DRIVE, STAMP, COUNTED = range(12)
WIDTH = 12
"""Columns of nodes. `END` is from when the robots are ready again, `DRIVE` the driving it takes, `COUNTED` whether the
sums contain it; a start's `CARRIER_BEFORE` holds when its robot is home, 0 where it has no home to go to. `ROBOT` of
what a rover does is the first rover of its type. `BEFORE` is -1 out of all chains."""

LOAD = 8
"""Column of robots: how many rovers of the first type are aboard at first; those of the other types follow."""

EPOCH, LOGGED, QUEUED, CHECKS, UNUSED, DROPPED = range(6)
REACHING, DRIVING, LATE, OLD_REACHING, OLD_DRIVING, OLD_LATE, OLD_UNUSED, DUE, TOLL = range(6, 15)
SUMS = 15
"""Columns of the first row of `work`: lengths of its other rows, sums over the nodes, the time that is late, and what
setting a rover down counts as driving."""

QUEUE, CHECK, SPARE, DROP, TAKEN = range(1, 6)
"""Other rows of `work`: nodes to be timed, carriers whose load is to be checked, transfers not in use, transfers no
longer in use once the change is accepted, targets taken out."""

NODE, WORTH, NEAR = 0, 1, 2
"""Columns of `hints`; after the nodes of the nearest targets come the doors: entries and exits per type."""

FAR = (1 << 31) - 1
"""A leg that is this long has no path."""


class Net(NamedTuple):
    """What a search remembers between calls: few arrays, for each of them costs time in every compiled call.

    Attributes
    ----------
    nodes
        (nodes, `WIDTH`), times in ms.
    log
        (nodes, `WIDTH` + 1): rows as they were before the change, and which they are.
    work
        (6, n): see `SUMS` and `QUEUE`.
    leg
        (types, places, places): ms, as in `ProblemData`, `FAR` without a path.
    robots, groups
        As in `ProblemData`, but that the capacity of rovers is -1, and with `LOAD`.
    hints
        (places, n): see `NODE`.
    seed
        (1,): state of the random numbers.
    recover
        Whether all rovers have to end aboard.
    """

    nodes: Ints
    log: Ints
    work: Ints
    leg: Ints32
    robots: Ints
    groups: Ints
    hints: Ints
    seed: Words
    recover: bool


@inlined
def draw(net: Net, n: int) -> int:
    """Return a random number from 0 to n - 1 (xorshift)."""
    x = net.seed[0]
    x ^= x << np.uint64(13)
    x ^= x >> np.uint64(7)
    x ^= x << np.uint64(17)
    net.seed[0] = x
    return np.int64(x >> np.uint64(33)) % n  # type: ignore[return-value]


@inlined
def pick(net: Net, group: int) -> int:
    """Return a random member of a group that has any."""
    return net.groups[group, 1 + draw(net, net.groups[group, 0])]


@inlined
def door(net: Net, side: int, robot: int, place: int) -> int:
    """Return one of the `ENTRIES` or `EXITS` (`side`) of a place for a robot, the best ones more often, or -1."""
    types = net.leg.shape[0]
    first = NEAR + NEIGHBOURS + (side * types + net.robots[robot, TYPE]) * DOORS
    count = 0
    while count < DOORS and net.hints[place, first + count] >= 0:
        count += 1
    return net.hints[place, first + min(draw(net, count), draw(net, count))] if count else -1


@inlined
def after(net: Net, node: int, robot: int) -> int:
    """Return the node after one in the chain of a robot."""
    return net.nodes[node, AFTER] if net.nodes[node, ROBOT] == robot else net.nodes[node, CARRIER_AFTER]


@inlined
def driver(net: Net, node: int) -> int:
    """Return the carrier that a transfer is for, or the robot that explores a target."""
    return net.nodes[node, ROBOT if net.nodes[node, KIND] == EXPLORE else CARRIER]


@inlined
def before(net: Net, node: int, robot: int) -> int:
    """Return the node before one in the chain of a robot."""
    return net.nodes[node, BEFORE] if net.nodes[node, ROBOT] == robot else net.nodes[node, CARRIER_BEFORE]


@inlined
def is_transfer(net: Net, node: int) -> bool:
    """Say whether a node is a dock or an undock."""
    return net.nodes[node, KIND] == DOCK or net.nodes[node, KIND] == UNDOCK


@inlined
def boarding(net: Net, node: int) -> int:
    """Return by how many rovers a node changes what a carrier has aboard."""
    if net.nodes[node, KIND] == DOCK:
        return 1
    return -1 if net.nodes[node, KIND] == UNDOCK else 0


@inlined
def carries(net: Net, robot: int) -> bool:
    """Say whether a robot is a carrier."""
    return net.robots[robot, CAPACITY] >= 0


@inlined
def leg_ms(net: Net, robot: int, one: int, other: int) -> int:
    """Return how long a robot takes from one place to another, `FAR` without a path."""
    return np.int64(net.leg[net.robots[robot, TYPE], one, other])  # type: ignore[return-value]


@inlined
def touch(net: Net, node: int) -> None:
    """Log a node before it is written to."""
    if net.nodes[node, STAMP] != net.work[0, EPOCH]:
        at = net.work[0, LOGGED]
        for k in range(WIDTH):
            net.log[at, k] = net.nodes[node, k]
        net.log[at, WIDTH] = node
        net.work[0, LOGGED] = at + 1
        net.nodes[node, STAMP] = net.work[0, EPOCH]


@inlined
def first_load(net: Net, carrier: int) -> int:
    """Return how many rovers are aboard a carrier at first."""
    load = 0
    for kind in range(len(net.leg)):
        load += net.robots[carrier, LOAD + kind]
    return load


@inlined
def ask(net: Net, node: int) -> None:
    """Have a node timed again."""
    _note(net, QUEUE, QUEUED, node)


@inlined
def check_load(net: Net, carrier: int) -> None:
    """Have the load of a carrier checked."""
    _note(net, CHECK, CHECKS, carrier)


@inlined
def _note(net: Net, row: int, length: int, number: int) -> None:
    """Add a number to a row of `work`, unless it stands there."""
    n = net.work[0, length]
    for i in range(n):
        if net.work[row, i] == number:
            return
    net.work[row, n] = number
    net.work[0, length] = n + 1


@inlined
def link(net: Net, one: int, other: int, robot: int) -> None:
    """Let two nodes follow each other in the chain of a robot."""
    touch(net, one)
    touch(net, other)
    net.nodes[one, AFTER if net.nodes[one, ROBOT] == robot else CARRIER_AFTER] = other
    net.nodes[other, BEFORE if net.nodes[other, ROBOT] == robot else CARRIER_BEFORE] = one
    ask(net, other)


@inlined
def insert(net: Net, node: int, robot: int, at: int) -> None:
    """Put a node into the chain of its robot, behind node `at`."""
    touch(net, node)
    net.nodes[node, ROBOT] = robot
    if not net.nodes[node, COUNTED]:
        net.nodes[node, END] = net.nodes[at, END]
    _put_behind(net, node, robot, at)


@inlined
def assign(net: Net, transfer: int, carrier: int, at: int) -> None:
    """Put a transfer into the route of a carrier, behind node `at`."""
    touch(net, transfer)
    net.nodes[transfer, CARRIER] = carrier
    if not net.nodes[transfer, COUNTED]:
        net.nodes[transfer, END] = max(net.nodes[transfer, END], net.nodes[at, END])
    _put_behind(net, transfer, carrier, at)
    check_load(net, carrier)


@inlined
def _put_behind(net: Net, node: int, robot: int, at: int) -> None:
    following = after(net, at, robot)
    link(net, node, following, robot)
    link(net, at, node, robot)


@inlined
def append(net: Net, at: int, head: int, robot: int, tail: tuple[int, int], empty: bool) -> None:
    """End the chain of a robot that begins with `head` behind node `at`, by a tail (first, last) if not empty."""
    if empty:
        link(net, at, head, robot)
    else:
        link(net, at, tail[0], robot)
        link(net, tail[1], head, robot)


@inlined
def begin_sortie(net: Net, undock: int, rover: int) -> None:
    """Let an undock begin a sortie with nothing in it."""
    touch(net, undock)
    net.nodes[undock, ROBOT] = rover
    net.nodes[undock, BEFORE] = net.nodes[undock, AFTER] = undock
    ask(net, undock)


@inlined
def unassign(net: Net, transfer: int) -> None:
    """Take a transfer out of the route of its carrier."""
    carrier = net.nodes[transfer, CARRIER]
    link(net, net.nodes[transfer, CARRIER_BEFORE], net.nodes[transfer, CARRIER_AFTER], carrier)
    check_load(net, carrier)


@inlined
def end_of(net: Net, node: int) -> int:
    """Return when what a node stands for ends; that of a start is the way home."""
    return net.nodes[node, CARRIER_BEFORE if net.nodes[node, KIND] == START else END]


@inlined
def lateness(net: Net, end: int) -> int:
    """Return how much of a time is late."""
    return max(0, end - net.work[0, DUE])


@inlined
def discount(net: Net, node: int) -> None:
    """Take what a node adds to the sums out of them."""
    if net.nodes[node, COUNTED]:
        touch(net, node)
        net.nodes[node, COUNTED] = 0
        _add(net, node, -1)


@inlined
def count(net: Net, node: int) -> None:
    """Add a node to the sums."""
    net.nodes[node, COUNTED] = 1
    _add(net, node, 1)


@inlined
def _add(net: Net, node: int, times: int) -> None:
    net.work[0, DRIVING] += times * net.nodes[node, DRIVE]
    end = end_of(net, node)
    if net.nodes[node, KIND] == EXPLORE:
        net.work[0, REACHING] += times * net.hints[net.nodes[node, PLACE], WORTH] * end
    if end > net.work[0, DUE]:
        net.work[0, LATE] += times * lateness(net, end)


@inlined
def take_out(net: Net, node: int) -> None:
    """Take a node out of all chains; a target has to be put back, a transfer is gone."""
    discount(net, node)
    link(net, net.nodes[node, BEFORE], net.nodes[node, AFTER], net.nodes[node, ROBOT])
    touch(net, node)
    net.nodes[node, BEFORE] = -1
    if net.nodes[node, KIND] != EXPLORE:
        unassign(net, node)
        net.nodes[node, KIND] = FREE
        net.work[DROP, net.work[0, DROPPED]] = node
        net.work[0, DROPPED] += 1


@inlined
def new_transfer(net: Net, kind: int, place: int) -> int:
    """Return a transfer that is not yet in any chain, or -1 if there are too many."""
    if not net.work[0, UNUSED]:
        return -1
    net.work[0, UNUSED] -= 1
    node = net.work[SPARE, net.work[0, UNUSED]]
    touch(net, node)
    net.nodes[node, KIND] = kind
    net.nodes[node, PLACE] = place
    net.nodes[node, COUNTED] = 0
    net.nodes[node, DRIVE] = 0
    net.nodes[node, END] = 0
    return node


@inlined
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


@inlined
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


@inlined
def accept(net: Net) -> None:
    """Keep everything since `begin`."""
    for i in range(net.work[0, DROPPED]):
        net.work[SPARE, net.work[0, UNUSED]] = net.work[DROP, i]
        net.work[0, UNUSED] += 1


@inlined
def head_of(net: Net, node: int) -> int:
    """Return the undock or start that the sortie of a node begins with."""
    while net.nodes[node, KIND] != START and net.nodes[node, KIND] != UNDOCK:
        node = net.nodes[node, AFTER]
    return node


@inlined
def is_aboard(net: Net, node: int, robot: int) -> bool:
    """Say whether after a node a robot is aboard a carrier: the node ends its sortie."""
    return net.nodes[node, KIND] == DOCK and net.nodes[node, ROBOT] == robot
