"""Random changes of who explores what, compiled. Each says whether it made one; most of them can't be carried out.

A change of rides and the targets they serve has to be one move, or no path leads from plan to plan: so targets are
taken out together with the rides that were there for them alone, and put back with whatever rides they need.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from marsupial.planning.local_search.choices import TRIES, late_target, near_carrier, some_node, some_target, turn
from marsupial.planning.local_search.encoding import (
    CAPACITY,
    CARRIERS,
    DOCK,
    ENTRIES,
    EXITS,
    EXPLORE,
    NEIGHBOURS,
    ROVERS,
    TYPE,
    UNDOCK,
)
from marsupial.planning.local_search.net import (
    AFTER,
    BEFORE,
    CARRIER,
    FAR,
    HELD,
    KIND,
    LONGEST_SEGMENT,
    NEAR,
    PLACE,
    ROBOT,
    TAKEN,
    Net,
    begin_outing,
    compiled,
    door,
    draw,
    head_of,
    host,
    insert,
    is_aboard,
    link,
    new_ride,
    pick,
    take_out,
)
from marsupial.planning.local_search.transport_moves import meet_at, tidy


@compiled
def _explores(net: Net, node: int, robot: int) -> bool:
    return net.nodes[node, KIND] == EXPLORE and net.nodes[node, ROBOT] == robot


@compiled
def _take(net: Net) -> None:
    """Take a target, or a few that follow each other, out of the net."""
    first = late_target(net)
    robot, choice = net.nodes[first, ROBOT], draw(net, 4)
    if choice == 0:  # the whole outing
        while (
            net.nodes[net.nodes[first, BEFORE], KIND] == EXPLORE and net.nodes[net.nodes[first, BEFORE], ROBOT] == robot
        ):
            first = net.nodes[first, BEFORE]
    previous, count, node = net.nodes[first, BEFORE], 0, first
    while count < LONGEST_SEGMENT:
        following = net.nodes[node, AFTER]
        take_out(net, node)
        net.work[TAKEN, count] = node
        count += 1
        node = following
        if choice == 1 or choice == 2 or not _explores(net, node, robot):
            break
    net.work[0, HELD] = count
    if net.robots[robot, CAPACITY] < 0:
        tidy(net, previous)


@compiled
def _put(net: Net, robot: int, at: int) -> Any:
    """Insert the targets held behind a node, in their order or the other way round; return the last."""
    count = net.work[0, HELD]
    forward = count < 2 or draw(net, 2) == 0
    for i in range(count):
        node = net.work[TAKEN, i if forward else count - 1 - i]
        insert(net, node, robot, at)
        at = node
    return at


@compiled
def relocate(net: Net) -> bool:
    """Give targets to a robot that is about anyway."""
    _take(net)
    target = net.nodes[net.work[TAKEN, 0], PLACE]
    for attempt in range(TRIES):
        at = -1
        if attempt < 2:
            at = net.hints[target, NEAR + draw(net, NEIGHBOURS)]
            if at >= 0 and net.nodes[at, BEFORE] < 0:
                at = -1
        if at < 0:
            at = some_node(net)
        robot, kind = net.nodes[at, ROBOT], net.nodes[at, KIND]
        if kind == DOCK or (kind == UNDOCK and draw(net, 3) == 0):
            robot = net.nodes[at, CARRIER]
        if is_aboard(net, at, robot) or net.leg[net.robots[robot, TYPE], net.nodes[at, PLACE], target] >= FAR:
            continue
        if kind == EXPLORE and draw(net, 2) == 0:
            at = net.nodes[at, BEFORE]
        _put(net, robot, at)
        return True
    return False


@compiled
def deploy(net: Net) -> bool:
    """Give targets an outing of their own; now and then the carrier picks up a rover elsewhere for that."""
    if not net.groups[ROVERS, 0] or not net.groups[CARRIERS, 0]:
        return False
    _take(net)
    target = net.work[TAKEN, 0]
    rover = net.nodes[pick(net, ROVERS), ROBOT]
    entry = door(net, ENTRIES, rover, net.nodes[target, PLACE])
    down = new_ride(net, UNDOCK, entry)
    if entry < 0 or down < 0:
        return False
    begin_outing(net, down, rover)
    carrier, final = near_carrier(net, target), np.int64(-1)
    at = turn(net, down, carrier, carrier) if draw(net, 3) else -1
    if at < 0:
        first, final = _fetch(net, carrier, target)
        if first < 0 or (final >= 0 and net.nodes[final, ROBOT] != rover):
            return False
        at = turn(net, down, carrier, first)
        if at < 0:
            return False
    host(net, down, carrier, at)
    last = _put(net, rover, down)
    if final >= 0:
        link(net, last, final, rover)
        link(net, final, down, rover)
        leave = door(net, EXITS, rover, net.nodes[last, PLACE])
        meet_at(net, final, leave)
        return leave >= 0
    if net.recover or draw(net, 3) == 0:
        if draw(net, 2) == 0:
            carrier = near_carrier(net, target)
        return _pick_up(net, last, carrier, down if carrier == net.nodes[down, CARRIER] else carrier) >= 0
    return True


@compiled
def _fetch(net: Net, carrier: int, target: int) -> Any:
    """Have a carrier pick up some rover on the ground, more often near a target; return the ride, or -1.

    And the dock that its outing ended with so far, which is now in no outing, or -1.
    """
    node = net.hints[net.nodes[target, PLACE], NEAR + draw(net, NEIGHBOURS)]
    if node < 0 or net.nodes[node, BEFORE] < 0 or draw(net, 2):
        node = some_node(net)
    rover = net.nodes[node, ROBOT]
    for _ in range(TRIES):
        if net.robots[rover, CAPACITY] < 0:
            break
        node = some_node(net)
        rover = net.nodes[node, ROBOT]
    if net.robots[rover, CAPACITY] >= 0:
        return np.int64(-1), np.int64(-1)
    head = head_of(net, node)
    last, final = net.nodes[head, BEFORE], np.int64(-1)
    if net.nodes[last, KIND] == DOCK:
        last, final = net.nodes[last, BEFORE], last
        link(net, last, head, rover)
    return np.int64(_pick_up(net, last, carrier, carrier)), final


@compiled
def _pick_up(net: Net, last: int, carrier: int, first: int) -> Any:
    """Have a rover picked up where its outing ends, by a carrier behind node `first`; return the ride, or -1."""
    rover = net.nodes[last, ROBOT]
    leave = door(net, EXITS, rover, net.nodes[last, PLACE])
    up = new_ride(net, DOCK, leave)
    if leave < 0 or up < 0:
        return -1
    insert(net, up, rover, last)
    at = turn(net, up, carrier, first)
    if at < 0:
        return -1
    host(net, up, carrier, at)
    return up


@compiled
def swap(net: Net) -> bool:
    """Let two targets change places."""
    one = late_target(net)
    other = net.hints[net.nodes[one, PLACE], NEAR + draw(net, NEIGHBOURS)]
    if other < 0 or draw(net, 4) == 0:
        other = some_target(net)
    if other == one:
        return False
    if net.nodes[other, BEFORE] == one and net.nodes[one, AFTER] == other:
        one, other = other, one
    robot_one, robot_other = net.nodes[one, ROBOT], net.nodes[other, ROBOT]
    if net.nodes[one, BEFORE] == other:
        at = net.nodes[other, BEFORE]
        take_out(net, one)
        insert(net, one, robot_one, at)
        return True
    at_one, at_other = net.nodes[one, BEFORE], net.nodes[other, BEFORE]
    take_out(net, one)
    take_out(net, other)
    insert(net, one, robot_other, at_other)
    insert(net, other, robot_one, at_one)
    return True


@compiled
def reverse(net: Net) -> bool:
    """Turn round a part of a robot's outing."""
    first = some_target(net)
    robot, count, node = net.nodes[first, ROBOT], 0, first
    at = net.nodes[first, BEFORE]
    while count < LONGEST_SEGMENT and _explores(net, node, robot):
        net.work[TAKEN, count] = node
        count += 1
        node = net.nodes[node, AFTER]
    if count < 2:
        return False
    count -= draw(net, count - 1)
    for i in range(count):
        take_out(net, net.work[TAKEN, i])
    for i in range(count):
        insert(net, net.work[TAKEN, i], robot, at)
    return True
