"""Exact times of a linked schedule, repaired where something has changed.

Theory of operation
-------------------
A change queues the nodes whose links it changed. `propagate` takes nodes from the queue one by one, computes when each
ends from the one or two nodes before it, and queues the nodes behind it if its end differs:

    c1   START --- undock --- dock* --- ...      * its end differs, so both nodes behind it are queued:
                     |          |                  the next in the carrier's route, and the next in the
    sortie         undock ... dock*                sortie of the rover (none: a dock ends it)

Nodes before the change, or behind a node whose end stays the same, are never visited. The queue is ordered by former
ends: that is nearly the new order, so most nodes are timed once. The order only costs time: a node timed too early is
queued again when one before it changes.

**Infeasible changes** need no tests of their own. A leg without a path, a rover that is to drive while it is aboard and
a missing way home show when the node is timed; an overloaded carrier, when its load is counted. Chains that wait for
each other in a circle grow later with each round until they are too late, or until too many nodes have been timed.

**Early rejection.** The limit on the cost is known beforehand (`search`). A queued node may end sooner than before only
if the change was made there (`link` queues it so), or if a node before it ends sooner. `SOONER` counts such nodes in
the queue. Once there are none, ends no longer decrease. Lateness and arrivals grow with the ends, and driving changes
only where links did, so the cost of what is timed so far is a lower bound on the final one. Above the limit, timing
abandons the schedule; complete timing would have rejected it as well.

A second test is quicker and nearly exact: an end that is above the limit by its lateness alone (`latest`) gives the
schedule up at once. It may reject a good change if the node was timed before one that it waits for; the order of the
queue makes that rare. It never lets a schedule with wrong times through.
"""

import numpy as np

from marsupial.arrays import Floats
from marsupial.native import inlined, outlined
from marsupial.planning.local_search import columns as col
from marsupial.planning.local_search import linked_schedule as ops
from marsupial.planning.local_search.linked_schedule import LinkedSchedule

LATEST = 1 << 60


@inlined
def propagate(sched: LinkedSchedule, limit: float, weights: Floats) -> float:
    """Retime what is queued and return the cost; inf if the schedule is infeasible or too late.

    A schedule that would cost more than `limit` may be given up. `weights` are per ms of lateness, arrivals and
    driving.
    """
    for i in range(sched.work[0, col.CHECKS]):
        if _overloaded(sched, sched.work[col.CHECK, i]):
            return np.inf
        if ops.seats_matter(sched) and _seats_exceeded(sched, sched.work[col.CHECK, i]):
            return np.inf
    # After this, the lateness of a single node costs more than the limit.
    latest = LATEST
    if limit < LATEST * weights[0]:  # never where lateness has no price
        latest = sched.work[0, col.DUE] + np.int64(limit / weights[0])
    for i in range(sched.work[0, col.QUEUED]):
        sched.work[col.FORMER, i] = _former_end(sched, sched.work[col.QUEUE, i])
    # Chains that wait for each other would be retimed for ever.
    retimings_left = 4 * len(sched.nodes)
    while sched.work[0, col.QUEUED]:
        retimings_left -= 1
        if retimings_left < 0 or not _retime(sched, _earliest(sched), latest):
            return np.inf
        # From here on ends, and so the cost, can only grow: a cost above the limit stays above it.
        if not sched.work[0, col.SOONER] and cost_of(sched, weights) > limit:
            return np.inf
    return cost_of(sched, weights)


@inlined
def cost_of(sched: LinkedSchedule, weights: Floats) -> float:
    """Return the cost of a schedule; exact if all nodes are timed."""
    work = sched.work
    return weights[0] * work[0, col.LATE] + weights[1] * work[0, col.REACHING] + weights[2] * work[0, col.DRIVING]


@inlined
def _earliest(sched: LinkedSchedule) -> int:
    """Remove the node with the earliest former end from the queue and return it; starts come last."""
    n, best, best_end = sched.work[0, col.QUEUED] - 1, 0, LATEST
    for i in range(n + 1):
        if sched.work[col.FORMER, i] < best_end:
            best, best_end = i, sched.work[col.FORMER, i]
    node = sched.work[col.QUEUE, best]
    sched.work[col.QUEUE, best], sched.work[col.FORMER, best] = sched.work[col.QUEUE, n], sched.work[col.FORMER, n]
    sched.work[0, col.QUEUED] = n
    # Odd: queued as one that may end sooner.
    sched.work[0, col.SOONER] -= sched.work[col.QUEUED_IN, node] & 1
    sched.work[col.QUEUED_IN, node] = 0
    return node


@inlined
def _former_end(sched: LinkedSchedule, node: int) -> int:
    return LATEST if node < len(sched.robots) else sched.nodes[node, col.END]


@inlined
def _overloaded(sched: LinkedSchedule, carrier: int) -> bool:
    """Return whether a carrier exceeds its capacity, or sets down a rover of a type that it has not aboard."""
    total = ops.initial_load(sched, carrier)
    for i in range(sched.groups[col.ROVERS, 0]):
        rover = sched.groups[col.ROVERS, 1 + i]
        if sched.nodes[rover, col.ROBOT] != rover:
            continue
        load, all_load = sched.robots[carrier, col.LOAD + sched.robots[rover, col.TYPE]], total
        node = sched.nodes[carrier, col.AFTER]
        while node != carrier:
            change = ops.load_change(sched, node)
            all_load += change
            if sched.nodes[node, col.ROBOT] == rover:
                load += change
            if change and (load < 0 or all_load > sched.robots[carrier, col.CAPACITY]):
                return True
            node = ops.after(sched, node, carrier)
    return False


@outlined
def _seats_exceeded(sched: LinkedSchedule, carrier: int) -> bool:
    """Return whether a carrier takes more rovers of some type aboard than it has seats for."""
    for i in range(sched.groups[col.ROVERS, 0]):
        rover = sched.groups[col.ROVERS, 1 + i]
        if sched.nodes[rover, col.ROBOT] != rover:
            continue
        load, most = 0, ops.seats(sched, carrier, rover)
        for kind in range(len(sched.leg)):
            load += sched.robots[rover, col.LOAD + len(sched.leg) + kind] * sched.robots[carrier, col.LOAD + kind]
        node = sched.nodes[carrier, col.AFTER]
        while node != carrier:
            change = ops.load_change(sched, node)
            if change and ops.seats(sched, rover, sched.nodes[node, col.ROBOT]):
                load += change
                if load > most:
                    return True
            node = ops.after(sched, node, carrier)
    return False


@inlined
def _retime(sched: LinkedSchedule, node: int, latest: int) -> bool:
    """Retime one node; return whether it is feasible and not too late."""
    nodes = sched.nodes
    if nodes[node, col.KIND] == col.START:
        return _retime_end(sched, node, latest)
    if nodes[node, col.BEFORE] < 0:
        return True
    possible, end, drive = _compute_times(sched, node)
    if not possible or end > latest:
        return False
    if nodes[node, col.COUNTED] and nodes[node, col.END] == end:
        # Nothing behind it moves, so only its own driving has to be corrected.
        if nodes[node, col.DRIVE] != drive:
            ops.log_node(sched, node)
            sched.work[0, col.DRIVING] += drive - nodes[node, col.DRIVE]
            nodes[node, col.DRIVE] = drive
        return True
    sooner = end < nodes[node, col.END]
    ops.set_times(sched, node, end, drive)
    following = nodes[node, col.AFTER]
    # Behind the last node of a sortie comes its own undock, which does not wait for it.
    if nodes[following, col.KIND] != col.UNDOCK or nodes[following, col.ROBOT] != nodes[node, col.ROBOT]:
        _enqueue_next(sched, following, sooner)
    if nodes[node, col.KIND] != col.EXPLORE:
        _enqueue_next(sched, nodes[node, col.CARRIER_AFTER], sooner)
    return True


@inlined
def _compute_times(sched: LinkedSchedule, node: int) -> tuple[bool, int, int]:
    """Return whether a node can follow those before it, when it ends, and the driving it takes."""
    kind, robot, place = sched.nodes[node, col.KIND], sched.nodes[node, col.ROBOT], sched.nodes[node, col.PLACE]
    previous = sched.nodes[node, col.BEFORE]
    possible, end, drive = True, 0, 0
    if kind == col.UNDOCK:
        possible = not sched.recover or sched.nodes[previous, col.KIND] == col.DOCK
        # The rover may be too wide for where its carrier takes it.
        possible = possible and ops.leg_ms(sched, robot, place, place) < col.FAR
    else:
        drive = ops.leg_ms(sched, robot, sched.nodes[previous, col.PLACE], place)
        possible = drive < col.FAR and not ops.ends_aboard(sched, previous, robot)
        end = sched.nodes[previous, col.END] + drive
    if kind != col.EXPLORE:
        carrier, previous = sched.nodes[node, col.CARRIER], sched.nodes[node, col.CARRIER_BEFORE]
        leg = ops.leg_ms(sched, carrier, sched.nodes[previous, col.PLACE], place)
        possible = possible and leg < col.FAR
        drive += leg
        end = max(end, sched.nodes[previous, col.END] + leg)
        end += sched.robots[robot, col.DOCKING if kind == col.DOCK else col.UNDOCKING]
    return possible, end, drive


@inlined
def _enqueue_next(sched: LinkedSchedule, node: int, sooner: bool) -> None:
    if sched.nodes[node, col.KIND] != col.START or sched.robots[node, col.HOME] >= 0:
        # Written beyond the end of the queue, and not read, if the node is queued already.
        sched.work[col.FORMER, sched.work[0, col.QUEUED]] = _former_end(sched, node)
        ops.enqueue(sched, node, sooner)


@inlined
def _retime_end(sched: LinkedSchedule, robot: int, latest: int) -> bool:
    """Time a carrier's way home, or check that a sortie ends aboard where it has to; return whether it is feasible."""
    last = sched.nodes[robot, col.BEFORE]
    if sched.robots[robot, col.HOME] < 0:
        return not sched.recover or sched.robots[robot, col.CAPACITY] >= 0 or sched.nodes[last, col.KIND] == col.DOCK
    leg = ops.leg_ms(sched, robot, sched.nodes[last, col.PLACE], sched.robots[robot, col.HOME])
    if leg >= col.FAR:
        return False
    end = 0 if sched.nodes[last, col.PLACE] == sched.robots[robot, col.HOME] else sched.nodes[last, col.END] + leg
    ops.set_times(sched, robot, end, leg)
    return end <= latest


@inlined
def makespan_of(sched: LinkedSchedule) -> int:
    """Return when the last robot is ready; all nodes have to be timed."""
    makespan = 0
    for node in range(len(sched.nodes)):
        if sched.nodes[node, col.COUNTED]:
            makespan = max(makespan, ops.end_of(sched, node))
    return makespan


@inlined
def set_due(sched: LinkedSchedule, due: int) -> None:
    sched.work[0, col.DUE] = due
    late = 0
    for node in range(len(sched.nodes)):
        if sched.nodes[node, col.COUNTED]:
            late += ops.lateness(sched, ops.end_of(sched, node))
    sched.work[0, col.LATE] = late
