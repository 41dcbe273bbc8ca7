"""Changes of who explores what: targets are taken out and put in elsewhere. Compiled.

Each says whether it made a change; most changes can't be carried out. A change of transfers and the targets they serve
has to be one move, or no path leads from plan to plan: so targets are taken out together with the transfers that were
there for them alone, and put back with whatever transfers they need.
"""

from __future__ import annotations

from marsupial.native import inlined
from marsupial.planning.local_search import choices
from marsupial.planning.local_search import columns as col
from marsupial.planning.local_search import net as nets
from marsupial.planning.local_search.net import Net
from marsupial.planning.local_search.transfer_moves import drop_if_empty, move_to

LONGEST_SEGMENT = 8
"""How many targets are moved at once at most."""


@inlined
def first_target(net: Net, target: int) -> int:
    """Return the first of the targets that are explored in a row up to one."""
    while net.nodes[net.nodes[target, col.BEFORE], col.KIND] == col.EXPLORE:
        target = net.nodes[target, col.BEFORE]
    return target


@inlined
def take_targets(net: Net, first: int, most: int, top: int) -> int:
    """Take a target, and up to so many in a row, out of the net into `TAKEN` from `top` on; return how many."""
    node, count = first, 0
    while count < most and net.nodes[node, col.KIND] == col.EXPLORE:
        following = net.nodes[node, col.AFTER]
        nets.take_out(net, node)
        net.work[col.TAKEN, top + count] = node
        count += 1
        node = following
    return count


@inlined
def put_targets(net: Net, robot: int, at: int, count: int, top: int, forward: bool) -> int:
    """Insert what was taken behind a node, in its order or the other way round; return the last."""
    for i in range(count):
        node = net.work[col.TAKEN, top + (i if forward else count - 1 - i)]
        nets.insert(net, node, robot, at)
        at = node
    return at


@inlined
def _remove(net: Net) -> int:
    """Take a target, or a few in a row, out of the net; return how many."""
    first = choices.late_target(net)
    robot, choice = net.nodes[first, col.ROBOT], nets.draw(net, 4)
    if choice == 0:
        first = first_target(net, first)
    previous = net.nodes[first, col.BEFORE]
    count = take_targets(net, first, 1 if choice == 1 or choice == 2 else LONGEST_SEGMENT, 0)
    if not nets.carries(net, robot):
        drop_if_empty(net, previous)
    return count


@inlined
def _reinsert(net: Net, robot: int, at: int, count: int) -> int:
    """Insert the targets removed behind a node, in their order or the other way round; return the last."""
    return put_targets(net, robot, at, count, 0, count < 2 or nets.draw(net, 2) == 0)


@inlined
def relocate(net: Net) -> bool:
    """Give targets to a robot that is about anyway."""
    count = _remove(net)
    target = net.nodes[net.work[col.TAKEN, 0], col.PLACE]
    for attempt in range(choices.TRIES):
        at = -1
        if attempt < 2:
            at = net.hints[target, col.NEAR + nets.draw(net, col.NEIGHBOURS)]
            if at >= 0 and net.nodes[at, col.BEFORE] < 0:
                at = -1
        if at < 0:
            at = choices.some_node(net)
        robot, kind = net.nodes[at, col.ROBOT], net.nodes[at, col.KIND]
        if kind == col.DOCK or (kind == col.UNDOCK and nets.draw(net, 3) == 0):
            robot = net.nodes[at, col.CARRIER]
        if nets.is_aboard(net, at, robot) or nets.leg_ms(net, robot, net.nodes[at, col.PLACE], target) >= col.FAR:
            continue
        if kind == col.EXPLORE and nets.draw(net, 2) == 0:
            at = net.nodes[at, col.BEFORE]
        _reinsert(net, robot, at, count)
        return True
    return False


@inlined
def deploy(net: Net) -> bool:
    """Give targets a sortie of their own; now and then the carrier picks up a rover elsewhere for that."""
    if not net.groups[col.ROVERS, 0] or not net.groups[col.CARRIERS, 0]:
        return False
    count = _remove(net)
    target = net.work[col.TAKEN, 0]
    rover = net.nodes[nets.pick(net, col.ROVERS), col.ROBOT]
    entry = nets.door(net, col.ENTRIES, rover, net.nodes[target, col.PLACE])
    down = nets.new_transfer(net, col.UNDOCK, entry)
    if entry < 0 or down < 0:
        return False
    nets.begin_sortie(net, down, rover)
    carrier, final = choices.near_carrier(net, target), -1
    at = choices.turn(net, down, carrier, carrier) if nets.draw(net, 3) else -1
    if at < 0:
        first, final = _pick_up_elsewhere(net, carrier, target)
        if first < 0 or (final >= 0 and net.nodes[final, col.ROBOT] != rover):
            return False
        at = choices.turn(net, down, carrier, first)
        if at < 0:
            return False
    nets.assign(net, down, carrier, at)
    last = _reinsert(net, rover, down, count)
    if final >= 0:
        nets.link(net, last, final, rover)
        nets.link(net, final, down, rover)
        leave = nets.door(net, col.EXITS, rover, net.nodes[last, col.PLACE])
        move_to(net, final, leave)
        return leave >= 0
    if net.recover or nets.draw(net, 3) == 0:
        if nets.draw(net, 2) == 0:
            carrier = choices.near_carrier(net, target)
        return _pick_up(net, last, carrier, down if carrier == net.nodes[down, col.CARRIER] else carrier) >= 0
    return True


@inlined
def _pick_up_elsewhere(net: Net, carrier: int, target: int) -> tuple[int, int]:
    """Have a carrier pick up some rover on the ground, more often near a target; return the dock, or -1.

    And the dock that its sortie ended with so far, which is now in no sortie, or -1.
    """
    node = net.hints[net.nodes[target, col.PLACE], col.NEAR + nets.draw(net, col.NEIGHBOURS)]
    if node < 0 or net.nodes[node, col.BEFORE] < 0 or nets.draw(net, 2):
        node = choices.some_node(net)
    for _ in range(choices.TRIES):
        if not nets.carries(net, net.nodes[node, col.ROBOT]):
            break
        node = choices.some_node(net)
    up, final = -1, -1
    rover = net.nodes[node, col.ROBOT]
    if not nets.carries(net, rover):
        head = nets.head_of(net, node)
        last = net.nodes[head, col.BEFORE]
        if net.nodes[last, col.KIND] == col.DOCK:
            last, final = net.nodes[last, col.BEFORE], last
            nets.link(net, last, head, rover)
        up = _pick_up(net, last, carrier, carrier)
    return up, final


@inlined
def _pick_up(net: Net, last: int, carrier: int, first: int) -> int:
    """Have a rover picked up where its sortie ends, by a carrier behind node `first`; return the dock, or -1."""
    rover = net.nodes[last, col.ROBOT]
    leave = nets.door(net, col.EXITS, rover, net.nodes[last, col.PLACE])
    up = nets.new_transfer(net, col.DOCK, leave)
    if leave < 0 or up < 0:
        return -1
    nets.insert(net, up, rover, last)
    at = choices.turn(net, up, carrier, first)
    if at < 0:
        return -1
    nets.assign(net, up, carrier, at)
    return up


@inlined
def swap(net: Net) -> bool:
    """Let two targets change places."""
    one = choices.late_target(net)
    other = choices.near_target(net, one)
    if other == one:
        return False
    if net.nodes[other, col.BEFORE] == one and net.nodes[one, col.AFTER] == other:
        one, other = other, one
    robot_one, robot_other = net.nodes[one, col.ROBOT], net.nodes[other, col.ROBOT]
    at_one, at_other = net.nodes[one, col.BEFORE], net.nodes[other, col.BEFORE]
    nets.take_out(net, one)
    if at_one == other:
        nets.insert(net, one, robot_one, at_other)
        return True
    nets.take_out(net, other)
    nets.insert(net, one, robot_other, at_other)
    nets.insert(net, other, robot_one, at_one)
    return True


@inlined
def reverse(net: Net) -> bool:
    """Turn round a part of a robot's sortie."""
    first = choices.some_target(net)
    count, node = 0, first
    while count < LONGEST_SEGMENT and net.nodes[node, col.KIND] == col.EXPLORE:
        count += 1
        node = net.nodes[node, col.AFTER]
    if count < 2:
        return False
    robot, at = net.nodes[first, col.ROBOT], net.nodes[first, col.BEFORE]
    count = take_targets(net, first, count - nets.draw(net, count - 1), 0)
    for i in range(count):
        nets.insert(net, net.work[col.TAKEN, i], robot, at)
    return True
