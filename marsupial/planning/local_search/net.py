"""The state of a search: events linked into one chain per carrier (its route) and one per sortie.

Rovers of a type are as good as each other once they are aboard. So a plan is told in sorties and not in rovers: a
sortie begins where a rover is set down, or stands at first, and ends where it is picked up, or with its last target.
Who goes on a sortie is decided when the plan is read off; the search only sees to it that a rover is aboard. So a
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
from marsupial.planning.local_search import columns as col


class Net(NamedTuple):
    """What a search remembers between calls: few arrays, for each of them costs time in every compiled call.

    Attributes
    ----------
    nodes
        (nodes, `WIDTH`), times in ms.
    log
        (nodes, `WIDTH` + 1): rows as they were before the change, and which they are.
    work
        (`ROWS`, n): see `SUMS` and `QUEUE`.
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
    first = col.NEAR + col.NEIGHBOURS + (side * types + net.robots[robot, col.TYPE]) * col.DOORS
    count = 0
    while count < col.DOORS and net.hints[place, first + count] >= 0:
        count += 1
    return net.hints[place, first + min(draw(net, count), draw(net, count))] if count else -1


@inlined
def after(net: Net, node: int, robot: int) -> int:
    """Return the node after one in the chain of a robot."""
    return net.nodes[node, col.AFTER] if net.nodes[node, col.ROBOT] == robot else net.nodes[node, col.CARRIER_AFTER]


@inlined
def driver(net: Net, node: int) -> int:
    """Return the carrier that a transfer is for, or the robot that explores a target."""
    return net.nodes[node, col.ROBOT if net.nodes[node, col.KIND] == col.EXPLORE else col.CARRIER]


@inlined
def before(net: Net, node: int, robot: int) -> int:
    """Return the node before one in the chain of a robot."""
    return net.nodes[node, col.BEFORE] if net.nodes[node, col.ROBOT] == robot else net.nodes[node, col.CARRIER_BEFORE]


@inlined
def is_transfer(net: Net, node: int) -> bool:
    """Say whether a node is a dock or an undock."""
    return net.nodes[node, col.KIND] == col.DOCK or net.nodes[node, col.KIND] == col.UNDOCK


@inlined
def boarding(net: Net, node: int) -> int:
    """Return by how many rovers a node changes what a carrier has aboard."""
    if net.nodes[node, col.KIND] == col.DOCK:
        return 1
    return -1 if net.nodes[node, col.KIND] == col.UNDOCK else 0


@inlined
def carries(net: Net, robot: int) -> bool:
    """Say whether a robot is a carrier."""
    return net.robots[robot, col.CAPACITY] >= 0


@inlined
def leg_ms(net: Net, robot: int, one: int, other: int) -> int:
    """Return how long a robot takes from one place to another, `FAR` without a path."""
    return np.int64(net.leg[net.robots[robot, col.TYPE], one, other])  # type: ignore[return-value]


@inlined
def touch(net: Net, node: int) -> None:
    """Log a node before it is written to."""
    if net.nodes[node, col.STAMP] != net.work[0, col.EPOCH]:
        at = net.work[0, col.LOGGED]
        for k in range(col.WIDTH):
            net.log[at, k] = net.nodes[node, k]
        net.log[at, col.WIDTH] = node
        net.work[0, col.LOGGED] = at + 1
        net.nodes[node, col.STAMP] = net.work[0, col.EPOCH]


@inlined
def first_load(net: Net, carrier: int) -> int:
    """Return how many rovers are aboard a carrier at first."""
    load = 0
    for kind in range(len(net.leg)):
        load += net.robots[carrier, col.LOAD + kind]
    return load


@inlined
def ask(net: Net, node: int, sooner: bool = True) -> None:
    """Have a node timed again; `sooner` says whether it may end sooner than before."""
    asked, now = net.work[col.ASKED, node], 2 * net.work[0, col.EPOCH]
    if asked < now:
        net.work[col.QUEUE, net.work[0, col.QUEUED]] = node
        net.work[0, col.QUEUED] += 1
    if sooner and asked <= now:
        net.work[0, col.SOONER] += 1
    net.work[col.ASKED, node] = max(asked, now + sooner)


@inlined
def check_load(net: Net, carrier: int) -> None:
    """Have the load of a carrier checked."""
    n = net.work[0, col.CHECKS]
    for i in range(n):
        if net.work[col.CHECK, i] == carrier:
            return
    net.work[col.CHECK, n] = carrier
    net.work[0, col.CHECKS] = n + 1


@inlined
def link(net: Net, one: int, other: int, robot: int) -> None:
    """Let two nodes follow each other in the chain of a robot."""
    touch(net, one)
    touch(net, other)
    net.nodes[one, col.AFTER if net.nodes[one, col.ROBOT] == robot else col.CARRIER_AFTER] = other
    net.nodes[other, col.BEFORE if net.nodes[other, col.ROBOT] == robot else col.CARRIER_BEFORE] = one
    ask(net, other)


@inlined
def insert(net: Net, node: int, robot: int, at: int) -> None:
    """Put a node into the chain of its robot, behind node `at`."""
    touch(net, node)
    net.nodes[node, col.ROBOT] = robot
    if not net.nodes[node, col.COUNTED]:
        net.nodes[node, col.END] = net.nodes[at, col.END]
    _put_behind(net, node, robot, at)


@inlined
def assign(net: Net, transfer: int, carrier: int, at: int) -> None:
    """Put a transfer into the route of a carrier, behind node `at`."""
    touch(net, transfer)
    net.nodes[transfer, col.CARRIER] = carrier
    if not net.nodes[transfer, col.COUNTED]:
        net.nodes[transfer, col.END] = max(net.nodes[transfer, col.END], net.nodes[at, col.END])
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
    net.nodes[undock, col.ROBOT] = rover
    net.nodes[undock, col.BEFORE] = net.nodes[undock, col.AFTER] = undock
    ask(net, undock)


@inlined
def unassign(net: Net, transfer: int) -> None:
    """Take a transfer out of the route of its carrier."""
    carrier = net.nodes[transfer, col.CARRIER]
    link(net, net.nodes[transfer, col.CARRIER_BEFORE], net.nodes[transfer, col.CARRIER_AFTER], carrier)
    check_load(net, carrier)


@inlined
def end_of(net: Net, node: int) -> int:
    """Return when what a node stands for ends; that of a start is the way home."""
    return net.nodes[node, col.CARRIER_BEFORE if net.nodes[node, col.KIND] == col.START else col.END]


@inlined
def lateness(net: Net, end: int) -> int:
    """Return how much of a time is late."""
    return max(0, end - net.work[0, col.DUE])


@inlined
def set_times(net: Net, node: int, end: int, drive: int) -> None:
    """Let what a node stands for end at a time, after so much driving, and bring the sums up to date."""
    touch(net, node)
    _add_to_sums(net, node, end, drive)
    net.nodes[node, col.CARRIER_BEFORE if net.nodes[node, col.KIND] == col.START else col.END] = end
    net.nodes[node, col.DRIVE], net.nodes[node, col.COUNTED] = drive, 1


@inlined
def discount(net: Net, node: int) -> None:
    """Take what a node adds to the sums out of them."""
    touch(net, node)
    _add_to_sums(net, node, 0, 0)
    net.nodes[node, col.COUNTED] = 0


@inlined
def _add_to_sums(net: Net, node: int, end: int, drive: int) -> None:
    """Have the sums contain an end and driving of a node in place of those that they contain now, if any."""
    counted = net.nodes[node, col.COUNTED]
    former = counted * end_of(net, node)
    net.work[0, col.DRIVING] += drive - counted * net.nodes[node, col.DRIVE]
    net.work[0, col.LATE] += lateness(net, end) - lateness(net, former)
    if net.nodes[node, col.KIND] == col.EXPLORE:
        net.work[0, col.REACHING] += net.hints[net.nodes[node, col.PLACE], col.WORTH] * (end - former)


@inlined
def take_out(net: Net, node: int) -> None:
    """Take a node out of all chains; a target has to be put back, a transfer is gone."""
    discount(net, node)
    link(net, net.nodes[node, col.BEFORE], net.nodes[node, col.AFTER], net.nodes[node, col.ROBOT])
    touch(net, node)
    net.nodes[node, col.BEFORE] = -1
    if net.nodes[node, col.KIND] != col.EXPLORE:
        unassign(net, node)
        net.nodes[node, col.KIND] = col.FREE
        net.work[col.DROP, net.work[0, col.DROPPED]] = node
        net.work[0, col.DROPPED] += 1


@inlined
def new_transfer(net: Net, kind: int, place: int) -> int:
    """Return a transfer that is not yet in any chain, or -1 if there are too many."""
    if not net.work[0, col.UNUSED]:
        return -1
    net.work[0, col.UNUSED] -= 1
    node = net.work[col.SPARE, net.work[0, col.UNUSED]]
    touch(net, node)
    net.nodes[node, col.KIND] = kind
    net.nodes[node, col.PLACE] = place
    net.nodes[node, col.COUNTED] = 0
    net.nodes[node, col.DRIVE] = 0
    net.nodes[node, col.END] = 0
    return node


@inlined
def begin(net: Net) -> None:
    """Begin a change."""
    net.work[0, col.EPOCH] += 1
    net.work[0, col.OLD_REACHING] = net.work[0, col.REACHING]
    net.work[0, col.OLD_DRIVING] = net.work[0, col.DRIVING]
    net.work[0, col.OLD_LATE] = net.work[0, col.LATE]
    net.work[0, col.OLD_UNUSED] = net.work[0, col.UNUSED]
    net.work[0, col.LOGGED] = 0
    net.work[0, col.QUEUED] = net.work[0, col.SOONER] = 0
    net.work[0, col.CHECKS] = 0
    net.work[0, col.DROPPED] = 0


@inlined
def undo(net: Net) -> None:
    """Take back everything since `begin`."""
    for i in range(net.work[0, col.LOGGED]):
        node = net.log[i, col.WIDTH]
        for k in range(col.WIDTH):
            net.nodes[node, k] = net.log[i, k]
    net.work[0, col.REACHING] = net.work[0, col.OLD_REACHING]
    net.work[0, col.DRIVING] = net.work[0, col.OLD_DRIVING]
    net.work[0, col.LATE] = net.work[0, col.OLD_LATE]
    net.work[0, col.UNUSED] = net.work[0, col.OLD_UNUSED]


@inlined
def accept(net: Net) -> None:
    """Keep everything since `begin`."""
    for i in range(net.work[0, col.DROPPED]):
        net.work[col.SPARE, net.work[0, col.UNUSED]] = net.work[col.DROP, i]
        net.work[0, col.UNUSED] += 1


@inlined
def head_of(net: Net, node: int) -> int:
    """Return the undock or start that the sortie of a node begins with."""
    while net.nodes[node, col.KIND] != col.START and net.nodes[node, col.KIND] != col.UNDOCK:
        node = net.nodes[node, col.AFTER]
    return node


@inlined
def is_aboard(net: Net, node: int, robot: int) -> bool:
    """Say whether after a node a robot is aboard a carrier: the node ends its sortie."""
    return net.nodes[node, col.KIND] == col.DOCK and net.nodes[node, col.ROBOT] == robot
