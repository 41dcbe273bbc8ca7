"""Changes of who explores what: targets are taken out and put in elsewhere. Compiled.

Each says whether it made a change; most changes can't be carried out. A change of transfers and the targets they serve
has to be one move, or no path leads from plan to plan: so targets are taken out together with the transfers that were
there for them alone, and put back with whatever transfers they need.
"""

from __future__ import annotations

from marsupial.native import inlined
from marsupial.planning.local_search.choices import (
    TRIES,
    late_target,
    near_carrier,
    near_target,
    some_node,
    some_target,
    turn,
)
from marsupial.planning.local_search.encoding import (
    CARRIERS,
    DOCK,
    ENTRIES,
    EXITS,
    EXPLORE,
    NEIGHBOURS,
    ROVERS,
    UNDOCK,
)
from marsupial.planning.local_search.net import (
    AFTER,
    BEFORE,
    CARRIER,
    FAR,
    KIND,
    NEAR,
    PLACE,
    ROBOT,
    TAKEN,
    Net,
    assign,
    begin_sortie,
    carries,
    door,
    draw,
    head_of,
    insert,
    is_aboard,
    leg_ms,
    link,
    new_transfer,
    pick,
    take_out,
)
from marsupial.planning.local_search.transfer_moves import drop_if_empty, move_to

LONGEST_SEGMENT = 8
"""How many targets are moved at once at most."""


@inlined
def first_target(net: Net, target: int) -> int:
    """Return the first of the targets that are explored in a row up to one."""
    while net.nodes[net.nodes[target, BEFORE], KIND] == EXPLORE:
        target = net.nodes[target, BEFORE]
    return target


@inlined
def take_targets(net: Net, first: int, most: int, top: int) -> int:
    """Take a target, and up to so many in a row, out of the net into `TAKEN` from `top` on; return how many."""
    node, count = first, 0
    while count < most and net.nodes[node, KIND] == EXPLORE:
        following = net.nodes[node, AFTER]
        take_out(net, node)
        net.work[TAKEN, top + count] = node
        count += 1
        node = following
    return count


@inlined
def put_targets(net: Net, robot: int, at: int, count: int, top: int, forward: bool) -> int:
    """Insert what was taken behind a node, in its order or the other way round; return the last."""
    for i in range(count):
        node = net.work[TAKEN, top + (i if forward else count - 1 - i)]
        insert(net, node, robot, at)
        at = node
    return at


@inlined
def _remove(net: Net) -> int:
    """Take a target, or a few in a row, out of the net; return how many."""
    first = late_target(net)
    robot, choice = net.nodes[first, ROBOT], draw(net, 4)
    if choice == 0:
        first = first_target(net, first)
    previous = net.nodes[first, BEFORE]
    count = take_targets(net, first, 1 if choice == 1 or choice == 2 else LONGEST_SEGMENT, 0)
    if not carries(net, robot):
        drop_if_empty(net, previous)
    return count


@inlined
def _reinsert(net: Net, robot: int, at: int, count: int) -> int:
    """Insert the targets removed behind a node, in their order or the other way round; return the last."""
    return put_targets(net, robot, at, count, 0, count < 2 or draw(net, 2) == 0)


@inlined
def relocate(net: Net) -> bool:
    """Give targets to a robot that is about anyway."""
    count = _remove(net)
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
        if is_aboard(net, at, robot) or leg_ms(net, robot, net.nodes[at, PLACE], target) >= FAR:
            continue
        if kind == EXPLORE and draw(net, 2) == 0:
            at = net.nodes[at, BEFORE]
        _reinsert(net, robot, at, count)
        return True
    return False


@inlined
def deploy(net: Net) -> bool:
    """Give targets a sortie of their own; now and then the carrier picks up a rover elsewhere for that."""
    if not net.groups[ROVERS, 0] or not net.groups[CARRIERS, 0]:
        return False
    count = _remove(net)
    target = net.work[TAKEN, 0]
    rover = net.nodes[pick(net, ROVERS), ROBOT]
    entry = door(net, ENTRIES, rover, net.nodes[target, PLACE])
    down = new_transfer(net, UNDOCK, entry)
    if entry < 0 or down < 0:
        return False
    begin_sortie(net, down, rover)
    carrier, final = near_carrier(net, target), -1
    at = turn(net, down, carrier, carrier) if draw(net, 3) else -1
    if at < 0:
        first, final = _pick_up_elsewhere(net, carrier, target)
        if first < 0 or (final >= 0 and net.nodes[final, ROBOT] != rover):
            return False
        at = turn(net, down, carrier, first)
        if at < 0:
            return False
    assign(net, down, carrier, at)
    last = _reinsert(net, rover, down, count)
    if final >= 0:
        link(net, last, final, rover)
        link(net, final, down, rover)
        leave = door(net, EXITS, rover, net.nodes[last, PLACE])
        move_to(net, final, leave)
        return leave >= 0
    if net.recover or draw(net, 3) == 0:
        if draw(net, 2) == 0:
            carrier = near_carrier(net, target)
        return _pick_up(net, last, carrier, down if carrier == net.nodes[down, CARRIER] else carrier) >= 0
    return True


@inlined
def _pick_up_elsewhere(net: Net, carrier: int, target: int) -> tuple[int, int]:
    """Have a carrier pick up some rover on the ground, more often near a target; return the dock, or -1.

    And the dock that its sortie ended with so far, which is now in no sortie, or -1.
    """
    node = net.hints[net.nodes[target, PLACE], NEAR + draw(net, NEIGHBOURS)]
    if node < 0 or net.nodes[node, BEFORE] < 0 or draw(net, 2):
        node = some_node(net)
    for _ in range(TRIES):
        if not carries(net, net.nodes[node, ROBOT]):
            break
        node = some_node(net)
    up, final = -1, -1
    rover = net.nodes[node, ROBOT]
    if not carries(net, rover):
        head = head_of(net, node)
        last = net.nodes[head, BEFORE]
        if net.nodes[last, KIND] == DOCK:
            last, final = net.nodes[last, BEFORE], last
            link(net, last, head, rover)
        up = _pick_up(net, last, carrier, carrier)
    return up, final


@inlined
def _pick_up(net: Net, last: int, carrier: int, first: int) -> int:
    """Have a rover picked up where its sortie ends, by a carrier behind node `first`; return the dock, or -1."""
    rover = net.nodes[last, ROBOT]
    leave = door(net, EXITS, rover, net.nodes[last, PLACE])
    up = new_transfer(net, DOCK, leave)
    if leave < 0 or up < 0:
        return -1
    insert(net, up, rover, last)
    at = turn(net, up, carrier, first)
    if at < 0:
        return -1
    assign(net, up, carrier, at)
    return up


@inlined
def swap(net: Net) -> bool:
    """Let two targets change places."""
    one = late_target(net)
    other = near_target(net, one)
    if other == one:
        return False
    if net.nodes[other, BEFORE] == one and net.nodes[one, AFTER] == other:
        one, other = other, one
    robot_one, robot_other = net.nodes[one, ROBOT], net.nodes[other, ROBOT]
    at_one, at_other = net.nodes[one, BEFORE], net.nodes[other, BEFORE]
    take_out(net, one)
    if at_one == other:
        insert(net, one, robot_one, at_other)
        return True
    take_out(net, other)
    insert(net, one, robot_other, at_other)
    insert(net, other, robot_one, at_one)
    return True


@inlined
def reverse(net: Net) -> bool:
    """Turn round a part of a robot's sortie."""
    first = some_target(net)
    count, node = 0, first
    while count < LONGEST_SEGMENT and net.nodes[node, KIND] == EXPLORE:
        count += 1
        node = net.nodes[node, AFTER]
    if count < 2:
        return False
    robot, at = net.nodes[first, ROBOT], net.nodes[first, BEFORE]
    count = take_targets(net, first, count - draw(net, count - 1), 0)
    for i in range(count):
        insert(net, net.work[TAKEN, i], robot, at)
    return True
