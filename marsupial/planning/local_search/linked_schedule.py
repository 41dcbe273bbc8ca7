"""The schedule that a search changes: events linked into one route per carrier and one chain per sortie.

Theory of operation
-------------------
**Sorties, not rovers.** Rovers of one type are interchangeable aboard a carrier, so the search does not assign
individual rovers. A *sortie* begins with the undock that sets a rover down, or where a rover stands at first (its
`START`). It ends with the dock that picks the rover up, or with its last target. Rovers are assigned to sorties when
the plan is read off (`loading.events_in`); the search only checks that some rover of the type is aboard. So a transfer
(a dock or an undock) can move from one carrier to another and nothing else has to change.

**Nodes and links.** A node is an event: a start, a target explored, a dock or an undock. A target or a start is in one
chain, always by `BEFORE` and `AFTER`, even in a carrier's route. A transfer is in two: in its sortie (`BEFORE`,
`AFTER`) and in the route of its carrier (`CARRIER_BEFORE`, `CARRIER_AFTER`). Both kinds of chain are rings: a route is
closed by the carrier's start, a sortie by its first node. So inserting and removing need no special case at the ends,
and the last node of a chain is the one before its head.

    route of c1    START c1 ---- undock ------- explore t3 -------- dock ---- (back to START c1)
                                   |                                 |
    sortie                         undock -- explore t1 -- explore t2 -- dock -- (back to the undock)

Rows of robots come first in `nodes`, then targets, then transfers. Transfers come and go; free rows are on a stack.
`BEFORE` is -1 for a node out of all chains.

**Times.** A node's `END` is when its robots are ready again. It follows from the nodes before it: the later of the two
arrivals for a dock, the carrier's arrival for an undock. Times can be derived from the links, but are stored so that a
change retimes only the nodes it affects (`timing`). Sums over all nodes (lateness, arrivals, driving) are updated with
each node, so a cost takes three multiplications.

**Changes.** Between `begin` and `accept` or `undo`, every row is copied to a log before it is first written to
(`log_node`; a stamp in the row tells whether it was copied). Undoing copies the logged rows back: it costs as much as
the change, not as much as the schedule. Changing a link also queues the node behind it for timing.
"""

from typing import NamedTuple

import numpy as np

from marsupial.arrays import Ints, Ints32, Words
from marsupial.native import inlined
from marsupial.planning.local_search import columns as col


class LinkedSchedule(NamedTuple):
    """The state of a search. It has few arrays, as each costs time in every compiled call."""

    nodes: Ints  # (nodes, `WIDTH`), times in ms
    log: Ints  # (nodes, `WIDTH` + 1): rows as they were before the change, and their numbers
    work: Ints  # (`ROWS`, n): sums and stacks, see `SUMS` and `QUEUE`
    leg: Ints32  # (types, places, places): ms, as in `ProblemData`, `FAR` without a path
    # robots, groups: as in `ProblemData`; in addition `LOAD` and `seats`, and the capacity of rovers is -1
    robots: Ints
    groups: Ints
    hints: Ints  # (places, n): see `NODE`
    seed: Words  # (1,): state of the random number generator
    recover: bool  # whether all rovers have to end aboard


@inlined
def draw(sched: LinkedSchedule, n: int) -> int:
    """Return a random number from 0 to n - 1 (xorshift)."""
    x = sched.seed[0]
    x ^= x << np.uint64(13)
    x ^= x >> np.uint64(7)
    x ^= x << np.uint64(17)
    sched.seed[0] = x
    return np.int64(x >> np.uint64(33)) % n  # type: ignore[return-value]


@inlined
def pick(sched: LinkedSchedule, group: int) -> int:
    """Return a random member of a group that has any."""
    return sched.groups[group, 1 + draw(sched, sched.groups[group, 0])]


@inlined
def near_meeting(sched: LinkedSchedule, side: int, robot: int, place: int) -> int:
    """Return a random near meeting of a place for a robot (`ENTRIES` or `EXITS`), nearer ones more often, or -1."""
    types = sched.leg.shape[0]
    first = col.NEAR + col.NEIGHBOURS + (side * types + sched.robots[robot, col.TYPE]) * col.NEAR_MEETINGS
    count = 0
    while count < col.NEAR_MEETINGS and sched.hints[place, first + count] >= 0:
        count += 1
    return sched.hints[place, first + min(draw(sched, count), draw(sched, count))] if count else -1


@inlined
def after(sched: LinkedSchedule, node: int, robot: int) -> int:
    """Return the node after one in the chain of a robot."""
    nodes = sched.nodes
    return nodes[node, col.AFTER] if nodes[node, col.ROBOT] == robot else nodes[node, col.CARRIER_AFTER]


@inlined
def route_robot(sched: LinkedSchedule, node: int) -> int:
    """Return the robot whose route a node is in: the carrier of a transfer, or the robot that explores a target."""
    return sched.nodes[node, col.ROBOT if sched.nodes[node, col.KIND] == col.EXPLORE else col.CARRIER]


@inlined
def before(sched: LinkedSchedule, node: int, robot: int) -> int:
    """Return the node before one in the chain of a robot."""
    nodes = sched.nodes
    return nodes[node, col.BEFORE] if nodes[node, col.ROBOT] == robot else nodes[node, col.CARRIER_BEFORE]


@inlined
def is_transfer(sched: LinkedSchedule, node: int) -> bool:
    return sched.nodes[node, col.KIND] == col.DOCK or sched.nodes[node, col.KIND] == col.UNDOCK


@inlined
def load_change(sched: LinkedSchedule, node: int) -> int:
    """Return the change in the number of rovers aboard that a node makes."""
    if sched.nodes[node, col.KIND] == col.DOCK:
        return 1
    return -1 if sched.nodes[node, col.KIND] == col.UNDOCK else 0


@inlined
def is_carrier(sched: LinkedSchedule, robot: int) -> bool:
    return sched.robots[robot, col.CAPACITY] >= 0


@inlined
def seats_matter(sched: LinkedSchedule) -> bool:
    """Return whether some rovers don't fit on some carriers, or only a few of them."""
    return sched.robots.shape[1] > col.LOAD + len(sched.leg)


@inlined
def seats(sched: LinkedSchedule, robot: int, other: int) -> int:
    """Return the entry of `ProblemData.seats` of a robot and the type of another one."""
    return sched.robots[robot, col.LOAD + len(sched.leg) + sched.robots[other, col.TYPE]]


@inlined
def leg_ms(sched: LinkedSchedule, robot: int, one: int, other: int) -> int:
    """Return the time from one place to another, `FAR` without a path."""
    return np.int64(sched.leg[sched.robots[robot, col.TYPE], one, other])  # type: ignore[return-value]


@inlined
def log_node(sched: LinkedSchedule, node: int) -> None:
    """Copy a node to the log before it is first written to in this change."""
    if sched.nodes[node, col.STAMP] != sched.work[0, col.EPOCH]:
        at = sched.work[0, col.LOGGED]
        for k in range(col.WIDTH):
            sched.log[at, k] = sched.nodes[node, k]
        sched.log[at, col.WIDTH] = node
        sched.work[0, col.LOGGED] = at + 1
        sched.nodes[node, col.STAMP] = sched.work[0, col.EPOCH]


@inlined
def initial_load(sched: LinkedSchedule, carrier: int) -> int:
    """Return the number of rovers aboard a carrier at first."""
    load = 0
    for kind in range(len(sched.leg)):
        load += sched.robots[carrier, col.LOAD + kind]
    return load


@inlined
def enqueue(sched: LinkedSchedule, node: int, sooner: bool = True) -> None:
    """Queue a node for timing; `sooner` says whether it may end sooner than before."""
    # Twice the change's number, plus one if it may end sooner: one number encodes both, and needs no clearing.
    queued_in, now = sched.work[col.QUEUED_IN, node], 2 * sched.work[0, col.EPOCH]
    if queued_in < now:
        sched.work[col.QUEUE, sched.work[0, col.QUEUED]] = node
        sched.work[0, col.QUEUED] += 1
    if sooner and queued_in <= now:
        sched.work[0, col.SOONER] += 1
    sched.work[col.QUEUED_IN, node] = max(queued_in, now + sooner)


@inlined
def check_load(sched: LinkedSchedule, carrier: int) -> None:
    """Queue a carrier for a check of its load."""
    n = sched.work[0, col.CHECKS]
    for i in range(n):
        if sched.work[col.CHECK, i] == carrier:
            return
    sched.work[col.CHECK, n] = carrier
    sched.work[0, col.CHECKS] = n + 1


@inlined
def link(sched: LinkedSchedule, one: int, other: int, robot: int) -> None:
    """Link two nodes in the chain of a robot."""
    log_node(sched, one)
    log_node(sched, other)
    sched.nodes[one, col.AFTER if sched.nodes[one, col.ROBOT] == robot else col.CARRIER_AFTER] = other
    sched.nodes[other, col.BEFORE if sched.nodes[other, col.ROBOT] == robot else col.CARRIER_BEFORE] = one
    enqueue(sched, other)


@inlined
def insert(sched: LinkedSchedule, node: int, robot: int, at: int) -> None:
    """Insert a node into the chain of its robot, behind node `at`."""
    log_node(sched, node)
    sched.nodes[node, col.ROBOT] = robot
    # Without a former end the queue would not know when to time it: take a guess from the node before.
    if not sched.nodes[node, col.COUNTED]:
        sched.nodes[node, col.END] = sched.nodes[at, col.END]
    _put_behind(sched, node, robot, at)


@inlined
def assign(sched: LinkedSchedule, transfer: int, carrier: int, at: int) -> None:
    """Insert a transfer into the route of a carrier, behind node `at`."""
    log_node(sched, transfer)
    sched.nodes[transfer, col.CARRIER] = carrier
    if not sched.nodes[transfer, col.COUNTED]:
        sched.nodes[transfer, col.END] = max(sched.nodes[transfer, col.END], sched.nodes[at, col.END])
    _put_behind(sched, transfer, carrier, at)
    check_load(sched, carrier)


@inlined
def _put_behind(sched: LinkedSchedule, node: int, robot: int, at: int) -> None:
    following = after(sched, at, robot)
    link(sched, node, following, robot)
    link(sched, at, node, robot)


@inlined
def append(sched: LinkedSchedule, at: int, head: int, robot: int, tail: tuple[int, int], empty: bool) -> None:
    """Replace what is behind node `at` in the chain that begins with `head` by a tail (first, last), if not empty."""
    if empty:
        link(sched, at, head, robot)
    else:
        link(sched, at, tail[0], robot)
        link(sched, tail[1], head, robot)


@inlined
def begin_sortie(sched: LinkedSchedule, undock: int, rover: int) -> None:
    """Begin an empty sortie with an undock."""
    log_node(sched, undock)
    sched.nodes[undock, col.ROBOT] = rover
    sched.nodes[undock, col.BEFORE] = sched.nodes[undock, col.AFTER] = undock
    enqueue(sched, undock)


@inlined
def unassign(sched: LinkedSchedule, transfer: int) -> None:
    """Remove a transfer from the route of its carrier."""
    carrier = sched.nodes[transfer, col.CARRIER]
    link(sched, sched.nodes[transfer, col.CARRIER_BEFORE], sched.nodes[transfer, col.CARRIER_AFTER], carrier)
    check_load(sched, carrier)


@inlined
def end_of(sched: LinkedSchedule, node: int) -> int:
    """Return when a node ends; for a start, when the robot is home."""
    return sched.nodes[node, col.CARRIER_BEFORE if sched.nodes[node, col.KIND] == col.START else col.END]


@inlined
def lateness(sched: LinkedSchedule, end: int) -> int:
    """Return by how much an end is after the due date."""
    return max(0, end - sched.work[0, col.DUE])


@inlined
def set_times(sched: LinkedSchedule, node: int, end: int, drive: int) -> None:
    """Set the end and the driving of a node and update the sums."""
    log_node(sched, node)
    _add_to_sums(sched, node, end, drive)
    sched.nodes[node, col.CARRIER_BEFORE if sched.nodes[node, col.KIND] == col.START else col.END] = end
    sched.nodes[node, col.DRIVE], sched.nodes[node, col.COUNTED] = drive, 1


@inlined
def _add_to_sums(sched: LinkedSchedule, node: int, end: int, drive: int) -> None:
    """Replace what the sums contain of a node, if anything, by an end and driving."""
    counted = sched.nodes[node, col.COUNTED]
    former = counted * end_of(sched, node)
    sched.work[0, col.DRIVING] += drive - counted * sched.nodes[node, col.DRIVE]
    sched.work[0, col.LATE] += lateness(sched, end) - lateness(sched, former)
    if sched.nodes[node, col.KIND] == col.EXPLORE:
        sched.work[0, col.REACHING] += sched.hints[sched.nodes[node, col.PLACE], col.WORTH] * (end - former)


@inlined
def remove(sched: LinkedSchedule, node: int) -> None:
    """Remove a node from all chains. The caller has to insert a target again; a transfer becomes free."""
    log_node(sched, node)
    _add_to_sums(sched, node, 0, 0)
    sched.nodes[node, col.COUNTED] = 0
    link(sched, sched.nodes[node, col.BEFORE], sched.nodes[node, col.AFTER], sched.nodes[node, col.ROBOT])
    sched.nodes[node, col.BEFORE] = -1
    if sched.nodes[node, col.KIND] != col.EXPLORE:
        unassign(sched, node)
        sched.nodes[node, col.KIND] = col.FREE
        # Not reused before the change is accepted: undoing has to find the row as it is.
        sched.work[col.DROP, sched.work[0, col.DROPPED]] = node
        sched.work[0, col.DROPPED] += 1


@inlined
def new_transfer(sched: LinkedSchedule, kind: int, place: int) -> int:
    """Return a new transfer in no chain, or -1 if no row is free."""
    if not sched.work[0, col.UNUSED]:
        return -1
    sched.work[0, col.UNUSED] -= 1
    node = sched.work[col.SPARE, sched.work[0, col.UNUSED]]
    log_node(sched, node)
    sched.nodes[node, col.KIND], sched.nodes[node, col.PLACE] = kind, place
    sched.nodes[node, col.COUNTED] = sched.nodes[node, col.DRIVE] = sched.nodes[node, col.END] = 0
    return node


@inlined
def begin(sched: LinkedSchedule) -> None:
    # A new number makes all stamps and queue marks of earlier changes void at once.
    sched.work[0, col.EPOCH] += 1
    for k in range(col.UNDONE):
        sched.work[0, col.FORMER_SUMS + k] = sched.work[0, col.REACHING + k]
    sched.work[0, col.LOGGED] = sched.work[0, col.CHECKS] = sched.work[0, col.DROPPED] = 0
    sched.work[0, col.QUEUED] = sched.work[0, col.SOONER] = 0


@inlined
def undo(sched: LinkedSchedule) -> None:
    """Undo everything since `begin`."""
    for i in range(sched.work[0, col.LOGGED]):
        node = sched.log[i, col.WIDTH]
        for k in range(col.WIDTH):
            sched.nodes[node, k] = sched.log[i, k]
    for k in range(col.UNDONE):
        sched.work[0, col.REACHING + k] = sched.work[0, col.FORMER_SUMS + k]


@inlined
def accept(sched: LinkedSchedule) -> None:
    """Keep everything since `begin`."""
    for i in range(sched.work[0, col.DROPPED]):
        sched.work[col.SPARE, sched.work[0, col.UNUSED]] = sched.work[col.DROP, i]
        sched.work[0, col.UNUSED] += 1


@inlined
def head_of(sched: LinkedSchedule, node: int) -> int:
    """Return the undock or start that begins the sortie of a node."""
    # A sortie is a ring: behind its last node comes its head again.
    while sched.nodes[node, col.KIND] != col.START and sched.nodes[node, col.KIND] != col.UNDOCK:
        node = sched.nodes[node, col.AFTER]
    return node


@inlined
def ends_aboard(sched: LinkedSchedule, node: int, robot: int) -> bool:
    """Return whether a node ends a robot's sortie by docking it."""
    return sched.nodes[node, col.KIND] == col.DOCK and sched.nodes[node, col.ROBOT] == robot
