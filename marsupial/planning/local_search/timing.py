"""The compiled core: exact times of a net, repaired where something has changed.

What is to be timed waits in a queue, the node with the earliest former end first; what follows a node whose end
has changed is timed after it. Nothing else is looked at. A change that can't be carried out is seen when a node is
timed, or when a carrier's load is counted; chains that wait for each other in a circle grow later until they are too
late.

Most changes are not worth what they cost, and that is seen before everything is timed. A node in the queue may end
sooner than before if the change was made there, or if what it waits for ends sooner. Once there is no such node left,
ends can only grow, and so can the cost: a net that costs too much already is given up.
"""

from __future__ import annotations

import numpy as np

from marsupial.arrays import Floats
from marsupial.native import inlined
from marsupial.planning.local_search import columns as col
from marsupial.planning.local_search import net as nets
from marsupial.planning.local_search.net import Net

LATEST = 1 << 60


@inlined
def propagate(net: Net, limit: float, blend: Floats) -> float:
    """Time what has been asked for and return the cost; inf where that can't be carried out or is too late.

    `limit` is a cost; a net that would cost more may be given up. `blend` is (3,): what a ms late, a ms of
    reaching and a ms of driving cost.
    """
    for i in range(net.work[0, col.CHECKS]):
        if _overloaded(net, net.work[col.CHECK, i]):
            return np.inf
    latest = LATEST if limit >= LATEST else net.work[0, col.DUE] + np.int64(limit / blend[0])
    for i in range(net.work[0, col.QUEUED]):
        net.work[col.FORMER, i] = _former_end(net, net.work[col.QUEUE, i])
    patience = 4 * len(net.nodes)
    while net.work[0, col.QUEUED]:
        patience -= 1
        if patience < 0 or not _time(net, _earliest(net), latest):
            return np.inf
        if not net.work[0, col.SOONER] and cost_of(net, blend) > limit:
            return np.inf
    return cost_of(net, blend)


@inlined
def cost_of(net: Net, blend: Floats) -> float:
    """Return the cost of a net all of which is timed."""
    return blend[0] * net.work[0, col.LATE] + blend[1] * net.work[0, col.REACHING] + blend[2] * net.work[0, col.DRIVING]


@inlined
def _earliest(net: Net) -> int:
    """Take the node with the earliest former end out of the queue; ends of chains come last."""
    n, best, best_end = net.work[0, col.QUEUED] - 1, 0, LATEST
    for i in range(n + 1):
        if net.work[col.FORMER, i] < best_end:
            best, best_end = i, net.work[col.FORMER, i]
    node = net.work[col.QUEUE, best]
    net.work[col.QUEUE, best], net.work[col.FORMER, best] = net.work[col.QUEUE, n], net.work[col.FORMER, n]
    net.work[0, col.QUEUED] = n
    net.work[0, col.SOONER] -= net.work[col.ASKED, node] & 1
    net.work[col.ASKED, node] = 0
    return node


@inlined
def _former_end(net: Net, node: int) -> int:
    return LATEST if node < len(net.robots) else net.nodes[node, col.END]


@inlined
def _overloaded(net: Net, carrier: int) -> bool:
    """Say whether a carrier has more rovers aboard than there is room for, or sets down one of a type it has not."""
    total = nets.first_load(net, carrier)
    for i in range(net.groups[col.ROVERS, 0]):
        rover = net.groups[col.ROVERS, 1 + i]
        if net.nodes[rover, col.ROBOT] != rover:
            continue
        load, all_load = net.robots[carrier, col.LOAD + net.robots[rover, col.TYPE]], total
        node = net.nodes[carrier, col.AFTER]
        while node != carrier:
            change = nets.boarding(net, node)
            all_load += change
            if net.nodes[node, col.ROBOT] == rover:
                load += change
            if change and (load < 0 or all_load > net.robots[carrier, col.CAPACITY]):
                return True
            node = nets.after(net, node, carrier)
    return False


@inlined
def _time(net: Net, node: int, latest: int) -> bool:
    """Time one node; False if it can't be carried out or is too late."""
    if net.nodes[node, col.KIND] == col.START:
        return _close(net, node, latest)
    if net.nodes[node, col.BEFORE] < 0:
        return True
    possible, end, drive = _work_out(net, node)
    if not possible or end > latest:
        return False
    if net.nodes[node, col.COUNTED] and net.nodes[node, col.END] == end:
        if net.nodes[node, col.DRIVE] != drive:
            nets.touch(net, node)
            net.work[0, col.DRIVING] += drive - net.nodes[node, col.DRIVE]
            net.nodes[node, col.DRIVE] = drive
        return True
    sooner = end < net.nodes[node, col.END]
    nets.set_times(net, node, end, drive)
    following = net.nodes[node, col.AFTER]
    if net.nodes[following, col.KIND] != col.UNDOCK or net.nodes[following, col.ROBOT] != net.nodes[node, col.ROBOT]:
        _ask_next(net, following, sooner)
    if net.nodes[node, col.KIND] != col.EXPLORE:
        _ask_next(net, net.nodes[node, col.CARRIER_AFTER], sooner)
    return True


@inlined
def _work_out(net: Net, node: int) -> tuple[bool, int, int]:
    """Return whether what a node does can be done after what is before it, when it ends and the driving it takes."""
    kind, robot, place = net.nodes[node, col.KIND], net.nodes[node, col.ROBOT], net.nodes[node, col.PLACE]
    previous = net.nodes[node, col.BEFORE]
    possible, end, drive = True, 0, 0
    if kind == col.UNDOCK:
        possible = not net.recover or net.nodes[previous, col.KIND] == col.DOCK
        drive = net.work[0, col.TOLL]
    else:
        drive = nets.leg_ms(net, robot, net.nodes[previous, col.PLACE], place)
        possible = drive < col.FAR and not nets.is_aboard(net, previous, robot)
        end = net.nodes[previous, col.END] + drive
    if kind != col.EXPLORE:
        carrier, previous = net.nodes[node, col.CARRIER], net.nodes[node, col.CARRIER_BEFORE]
        leg = nets.leg_ms(net, carrier, net.nodes[previous, col.PLACE], place)
        possible = possible and leg < col.FAR
        drive += leg
        end = max(end, net.nodes[previous, col.END] + leg)
        end += net.robots[robot, col.DOCKING if kind == col.DOCK else col.UNDOCKING]
    return possible, end, drive


@inlined
def _ask_next(net: Net, node: int, sooner: bool) -> None:
    if net.nodes[node, col.KIND] != col.START or net.robots[node, col.HOME] >= 0:
        net.work[col.FORMER, net.work[0, col.QUEUED]] = _former_end(net, node)  # not read if it is asked for already
        nets.ask(net, node, sooner)


@inlined
def _close(net: Net, robot: int, latest: int) -> bool:
    """Time the way home of a carrier, and see that a rover is aboard in the end if it has to be."""
    last = net.nodes[robot, col.BEFORE]
    if net.robots[robot, col.HOME] < 0:
        return not net.recover or net.robots[robot, col.CAPACITY] >= 0 or net.nodes[last, col.KIND] == col.DOCK
    leg = nets.leg_ms(net, robot, net.nodes[last, col.PLACE], net.robots[robot, col.HOME])
    if leg >= col.FAR:
        return False
    end = 0 if net.nodes[last, col.PLACE] == net.robots[robot, col.HOME] else net.nodes[last, col.END] + leg
    nets.set_times(net, robot, end, leg)
    return end <= latest


@inlined
def makespan_of(net: Net) -> int:
    """Return when the last robot is ready, all nodes being timed."""
    makespan = 0
    for node in range(len(net.nodes)):
        if net.nodes[node, col.COUNTED]:
            makespan = max(makespan, nets.end_of(net, node))
    return makespan


@inlined
def set_due(net: Net, due: int) -> None:
    """Change the time from which on things are late."""
    net.work[0, col.DUE] = due
    late = 0
    for node in range(len(net.nodes)):
        if net.nodes[node, col.COUNTED]:
            late += nets.lateness(net, nets.end_of(net, node))
    net.work[0, col.LATE] = late
