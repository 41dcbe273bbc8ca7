"""Random changes of who explores what, compiled. Each says whether it made one; most of them can't be carried out.

A change of rides and the targets they serve has to be one move, or no path leads from plan to plan: so targets are
taken out together with the rides that were there for them alone, and put back with whatever rides they need.
"""

from __future__ import annotations

from typing import Any

from marsupial.planning.anytime.choices import TRIES, between, late_target, slot, some_node, some_target
from marsupial.planning.anytime.encoding import (
    CAPACITY,
    CARRIERS,
    DOCK,
    ENTRIES,
    EXITS,
    EXPLORE,
    NEIGHBOURS,
    ROVERS,
    START,
    TYPE,
    UNDOCK,
)
from marsupial.planning.anytime.kernel import (
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
    aboard,
    after,
    compiled,
    door,
    draw,
    host,
    insert,
    new_ride,
    pick,
    take_out,
    unhost,
)
from marsupial.planning.anytime.ride_moves import meet_at


@compiled
def _reunite(net: Net, node: int, rover: int) -> bool:
    """Let the undock behind a node, after which a rover is aboard, be from the carrier it is aboard."""
    following = after(net, node, rover)
    carrier = aboard(net, node, rover)
    if net.nodes[following, KIND] != UNDOCK or net.nodes[following, CARRIER] == carrier:
        return True
    unhost(net, following)
    at = slot(net, carrier, node, net.nodes[following, AFTER], net.nodes[following, PLACE])
    if at < 0:
        return False
    host(net, following, carrier, at)
    return True


@compiled
def _tidy(net: Net, previous: int, robot: int) -> bool:
    """Take out the rides of a rover around node `previous` that have become useless."""
    while True:
        kind, following = net.nodes[previous, KIND], net.nodes[previous, AFTER]
        if kind == UNDOCK and net.nodes[following, KIND] == DOCK:
            if net.nodes[following, CARRIER] != net.nodes[previous, CARRIER] and draw(net, 2):
                return True
            back = net.nodes[previous, BEFORE]
            take_out(net, following)
            take_out(net, previous)
            if not _reunite(net, back, robot):
                return False
            previous = back
        elif kind in (UNDOCK, DOCK) and net.nodes[following, KIND] == START and not net.recover:
            back = net.nodes[previous, BEFORE]
            take_out(net, previous)
            previous = back
        else:
            return True


@compiled
def _explores(net: Net, node: int, robot: int) -> bool:
    return net.nodes[node, KIND] == EXPLORE and net.nodes[node, ROBOT] == robot


@compiled
def _take(net: Net) -> Any:
    """Take a target, or a few that follow each other, out of the net; return how many, 0 if that fails."""
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
    if previous != robot and net.nodes[previous, ROBOT] == robot and not _tidy(net, previous, robot):
        return 0
    return count


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
    if not _take(net):
        return False
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
        if aboard(net, at, robot) >= 0 or net.leg[net.robots[robot, TYPE], net.nodes[at, PLACE], target] >= FAR:
            continue
        if kind == EXPLORE and draw(net, 2) == 0:
            at = net.nodes[at, BEFORE]
        _put(net, robot, at)
        return True
    return False


@compiled
def _rover_for(net: Net, place: int) -> Any:
    """Return a random rover, more often one that explores a target near a place."""
    node = net.hints[place, NEAR + draw(net, NEIGHBOURS)]
    if draw(net, 2) and node >= 0 and net.nodes[node, BEFORE] >= 0:
        robot = net.nodes[node, ROBOT]
        if net.robots[robot, CAPACITY] < 0:
            return robot
    return pick(net, ROVERS)


@compiled
def deploy(net: Net) -> bool:
    """Take a rover to targets: set it down on the way, or pick it up elsewhere first."""
    if not net.groups[ROVERS, 0] or not net.groups[CARRIERS, 0]:
        return False
    if not _take(net):
        return False
    first = net.nodes[net.work[TAKEN, 0], PLACE]
    rover = _rover_for(net, first)
    entry = door(net, ENTRIES, rover, first)
    if entry < 0:
        return False
    at, seen, node = -1, 0, rover
    while True:  # any event of the rover that no target follows
        following = net.nodes[node, AFTER]
        if aboard(net, node, rover) >= 0 or net.nodes[following, KIND] != EXPLORE:
            seen += 1
            if draw(net, seen) == 0:
                at = node
        node = following
        if node == rover:
            break
    carrier = aboard(net, at, rover)
    if carrier >= 0:
        return _set_down(net, rover, carrier, at, entry)
    return _fetch(net, rover, at, entry)


@compiled
def _set_down(net: Net, rover: int, carrier: int, at: int, entry: int) -> bool:
    """Set down a rover that is aboard after event `at` for the targets held; it is picked up for what follows."""
    following = net.nodes[at, AFTER]
    first = at if net.nodes[at, KIND] == DOCK else carrier
    down = new_ride(net, UNDOCK, entry)
    if down < 0:
        return False
    insert(net, down, rover, at)
    host(net, down, carrier, between(net, carrier, first, following, entry))
    last = _put(net, rover, down)
    if following == rover and not net.recover:
        return True
    leave = entry if draw(net, 2) else door(net, EXITS, rover, net.nodes[last, PLACE])
    if leave < 0:
        return False
    up = new_ride(net, DOCK, leave)
    if up < 0:
        return False
    insert(net, up, rover, last)
    if following == rover and draw(net, 3) == 0:
        carrier = pick(net, CARRIERS)
        where = slot(net, carrier, down, following, leave)
        if where < 0:
            return False
        host(net, up, carrier, where)
    else:
        host(net, up, carrier, between(net, carrier, down, following, leave))
    return True


@compiled
def _fetch(net: Net, rover: int, at: int, entry: int) -> bool:
    """Have a carrier bring a rover that is on the ground after event `at` to the targets held."""
    carrier = pick(net, CARRIERS)
    following = net.nodes[at, AFTER]
    leave = door(net, EXITS, rover, net.nodes[at, PLACE])
    if leave < 0:
        return False
    where = slot(net, carrier, at, following, leave)
    if where < 0:
        return False
    up, down = new_ride(net, DOCK, leave), new_ride(net, UNDOCK, entry)
    if up < 0 or down < 0:
        return False
    insert(net, up, rover, at)
    host(net, up, carrier, where)
    insert(net, down, rover, up)
    where = up
    if draw(net, 2):
        where = between(net, carrier, up, following, entry)
    host(net, down, carrier, where)
    last = _put(net, rover, down)
    if net.nodes[following, KIND] == DOCK and net.nodes[following, ROBOT] == rover:
        leave = door(net, EXITS, rover, net.nodes[last, PLACE])
        if leave < 0:
            return False
        meet_at(net, following, leave)
    return True


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
