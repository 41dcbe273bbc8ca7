"""The compiled core: exact times of a net, mended where something has changed.

What is to be timed waits in a queue, the node with the earliest former end first; whoever follows a node whose end
has changed is timed after it. Nothing else is looked at. A change that can't be carried out is seen when a node is
timed, or when a carrier's load is counted; chains that wait for each other in a circle grow later until they are too
late.
"""

from __future__ import annotations

import numpy as np

from marsupial.arrays import Floats
from marsupial.native import inlined
from marsupial.planning.local_search.encoding import (
    CAPACITY,
    DOCK,
    DOCKING,
    EXPLORE,
    HOME,
    START,
    TYPE,
    UNDOCK,
    UNDOCKING,
)
from marsupial.planning.local_search.net import (
    AFTER,
    BEFORE,
    CARRIER,
    CARRIER_AFTER,
    CARRIER_BEFORE,
    CHECK,
    CHECKS,
    COUNTED,
    DRIVE,
    DRIVING,
    DUE,
    END,
    FAR,
    KIND,
    LATE,
    LOAD,
    PLACE,
    QUEUE,
    QUEUED,
    REACHING,
    ROBOT,
    TOLL,
    Net,
    after,
    ask,
    boarding,
    count,
    discount,
    end_of,
    first_load,
    is_aboard,
    lateness,
    leg_ms,
    touch,
)

LATEST = 1 << 60


@inlined
def propagate(net: Net, limit: float, blend: Floats) -> float:
    """Time what has been asked for and return the cost; inf where that can't be carried out or is too late.

    `limit` is a cost; a net that would cost more may be given up. `blend` is (3,): what a ms late, a ms of
    reaching and a ms of driving cost.
    """
    for i in range(net.work[0, CHECKS]):
        if _overloaded(net, net.work[CHECK, i]):
            return np.inf
    latest = LATEST if limit >= LATEST else net.work[0, DUE] + np.int64(limit / blend[0])
    patience = 4 * len(net.nodes)
    while net.work[0, QUEUED]:
        patience -= 1
        if patience < 0 or not _time(net, _earliest(net), latest):
            return np.inf
    return cost_of(net, blend)


@inlined
def cost_of(net: Net, blend: Floats) -> float:
    """Return the cost of a net all of which is timed."""
    return blend[0] * net.work[0, LATE] + blend[1] * net.work[0, REACHING] + blend[2] * net.work[0, DRIVING]


@inlined
def _earliest(net: Net) -> int:
    """Take the node with the earliest former end out of the queue; ends of chains come last."""
    n, best, best_end = net.work[0, QUEUED] - 1, 0, LATEST
    robots = len(net.robots)
    for i in range(n + 1):
        node = net.work[QUEUE, i]
        if node >= robots and net.nodes[node, END] < best_end:
            best, best_end = i, net.nodes[node, END]
    node = net.work[QUEUE, best]
    net.work[QUEUE, best] = net.work[QUEUE, n]
    net.work[0, QUEUED] = n
    return node


@inlined
def _overloaded(net: Net, carrier: int) -> bool:
    """Say whether a carrier has more rovers aboard than there is room for, or sets down one of a type it has not."""
    total = first_load(net, carrier)
    for kind in range(len(net.leg)):
        load, all_load = net.robots[carrier, LOAD + kind], total
        node = net.nodes[carrier, AFTER]
        while node != carrier:
            change = boarding(net, node)
            all_load += change
            if net.robots[net.nodes[node, ROBOT], TYPE] == kind:
                load += change
            if change and (load < 0 or all_load > net.robots[carrier, CAPACITY]):
                return True
            node = after(net, node, carrier)
    return False


@inlined
def _time(net: Net, node: int, latest: int) -> bool:
    """Time one node; False if it can't be carried out or is too late."""
    if net.nodes[node, KIND] == START:
        return _close(net, node, latest)
    if net.nodes[node, BEFORE] < 0:
        return True
    possible, end, drive = _work_out(net, node)
    if not possible or end > latest:
        return False
    if net.nodes[node, COUNTED] and net.nodes[node, END] == end:
        if net.nodes[node, DRIVE] != drive:
            touch(net, node)
            net.work[0, DRIVING] += drive - net.nodes[node, DRIVE]
            net.nodes[node, DRIVE] = drive
        return True
    touch(net, node)
    discount(net, node)
    net.nodes[node, END], net.nodes[node, DRIVE] = end, drive
    count(net, node)
    following = net.nodes[node, AFTER]
    if net.nodes[following, KIND] != UNDOCK or net.nodes[following, ROBOT] != net.nodes[node, ROBOT]:
        _ask_next(net, following)
    if net.nodes[node, KIND] != EXPLORE:
        _ask_next(net, net.nodes[node, CARRIER_AFTER])
    return True


@inlined
def _work_out(net: Net, node: int) -> tuple[bool, int, int]:
    """Return whether what a node does can be done after what is before it, when it ends and the driving it takes."""
    kind, robot, place = net.nodes[node, KIND], net.nodes[node, ROBOT], net.nodes[node, PLACE]
    previous = net.nodes[node, BEFORE]
    possible, end, drive = True, 0, 0
    if kind == UNDOCK:
        possible = not net.recover or net.nodes[previous, KIND] == DOCK
        drive = net.work[0, TOLL]
    else:
        drive = leg_ms(net, robot, net.nodes[previous, PLACE], place)
        possible = drive < FAR and not is_aboard(net, previous, robot)
        end = net.nodes[previous, END] + drive
    if kind != EXPLORE:
        carrier, previous = net.nodes[node, CARRIER], net.nodes[node, CARRIER_BEFORE]
        leg = leg_ms(net, carrier, net.nodes[previous, PLACE], place)
        possible = possible and leg < FAR
        drive += leg
        end = max(end, net.nodes[previous, END] + leg)
        end += net.robots[robot, DOCKING if kind == DOCK else UNDOCKING]
    return possible, end, drive


@inlined
def _ask_next(net: Net, node: int) -> None:
    if net.nodes[node, KIND] != START or net.robots[node, HOME] >= 0:
        ask(net, node)


@inlined
def _close(net: Net, robot: int, latest: int) -> bool:
    """Time the way home of a carrier, and see that a rover is aboard in the end if it has to be."""
    last = net.nodes[robot, BEFORE]
    if net.robots[robot, HOME] < 0:
        return not net.recover or net.robots[robot, CAPACITY] >= 0 or net.nodes[last, KIND] == DOCK
    touch(net, robot)
    discount(net, robot)
    leg = leg_ms(net, robot, net.nodes[last, PLACE], net.robots[robot, HOME])
    if leg >= FAR:
        return False
    net.nodes[robot, DRIVE] = leg
    net.nodes[robot, CARRIER_BEFORE] = 0
    if net.nodes[last, PLACE] != net.robots[robot, HOME]:
        net.nodes[robot, CARRIER_BEFORE] = net.nodes[last, END] + leg
    count(net, robot)
    return net.nodes[robot, CARRIER_BEFORE] <= latest


@inlined
def makespan_of(net: Net) -> int:
    """Return when the last robot is ready, all nodes being timed."""
    makespan = 0
    for node in range(len(net.nodes)):
        if net.nodes[node, COUNTED]:
            makespan = max(makespan, end_of(net, node))
    return makespan


@inlined
def set_due(net: Net, due: int) -> None:
    """Change the time from which on things are late."""
    net.work[0, DUE] = due
    late = 0
    for node in range(len(net.nodes)):
        if net.nodes[node, COUNTED]:
            late += lateness(net, end_of(net, node))
    net.work[0, LATE] = late
