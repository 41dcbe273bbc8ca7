"""Moves of targets between robots and sorties. Compiled.

Each returns whether it made a change; most changes are infeasible. Targets and the transfers that serve them have to
move together: a sortie without targets, or targets without a sortie, would cost more or be infeasible in between, and
the search would hardly ever get past that. So targets are removed together with transfers that serve them alone, and
inserted with the transfers they need.
"""

from marsupial.native import inlined
from marsupial.planning.local_search import choices
from marsupial.planning.local_search import columns as col
from marsupial.planning.local_search import linked_schedule as ops
from marsupial.planning.local_search.linked_schedule import LinkedSchedule
from marsupial.planning.local_search.transfer_moves import drop_if_empty, move_to

LONGEST_SEGMENT = 8  # most targets moved at once


@inlined
def first_target(sched: LinkedSchedule, target: int) -> int:
    """Return the first target of the uninterrupted row of targets that one is in."""
    while sched.nodes[sched.nodes[target, col.BEFORE], col.KIND] == col.EXPLORE:
        target = sched.nodes[target, col.BEFORE]
    return target


@inlined
def take_targets(sched: LinkedSchedule, first: int, most: int, top: int) -> int:
    """Remove a target and those behind it, `most` in all, to `TAKEN` from `top` on; return their number."""
    node, count = first, 0
    while count < most and sched.nodes[node, col.KIND] == col.EXPLORE:
        following = sched.nodes[node, col.AFTER]
        ops.remove(sched, node)
        sched.work[col.TAKEN, top + count] = node
        count += 1
        node = following
    return count


@inlined
def put_targets(sched: LinkedSchedule, robot: int, at: int, count: int, top: int, forward: bool) -> int:
    """Insert the targets taken behind a node, in their order or reversed; return the last one."""
    for i in range(count):
        node = sched.work[col.TAKEN, top + (i if forward else count - 1 - i)]
        ops.insert(sched, node, robot, at)
        at = node
    return at


@inlined
def _remove(sched: LinkedSchedule) -> int:
    """Remove a target, or a few in a row; return their number."""
    first = choices.late_target(sched)
    robot, choice = sched.nodes[first, col.ROBOT], ops.draw(sched, 4)
    if choice == 0:
        first = first_target(sched, first)
    previous = sched.nodes[first, col.BEFORE]
    count = take_targets(sched, first, 1 if choice == 1 or choice == 2 else LONGEST_SEGMENT, 0)
    if not ops.is_carrier(sched, robot):
        drop_if_empty(sched, previous)
    return count


@inlined
def _reinsert(sched: LinkedSchedule, robot: int, at: int, count: int) -> int:
    """Insert the targets removed behind a node, in random direction; return the last one."""
    return put_targets(sched, robot, at, count, 0, count < 2 or ops.draw(sched, 2) == 0)


@inlined
def relocate(sched: LinkedSchedule) -> bool:
    """Move targets behind a node of any robot that is on the ground there."""
    count = _remove(sched)
    target = sched.nodes[sched.work[col.TAKEN, 0], col.PLACE]
    for attempt in range(choices.TRIES):
        at = -1
        if attempt < 2:
            at = sched.hints[target, col.NEAR + ops.draw(sched, col.NEIGHBOURS)]
            if at >= 0 and sched.nodes[at, col.BEFORE] < 0:
                at = -1
        if at < 0:
            at = choices.random_node(sched)
        robot, kind = sched.nodes[at, col.ROBOT], sched.nodes[at, col.KIND]
        if kind == col.DOCK or (kind == col.UNDOCK and ops.draw(sched, 3) == 0):
            robot = sched.nodes[at, col.CARRIER]
        if ops.ends_aboard(sched, at, robot) or ops.leg_ms(sched, robot, sched.nodes[at, col.PLACE], target) >= col.FAR:
            continue
        if kind == col.EXPLORE and ops.draw(sched, 2) == 0:
            at = sched.nodes[at, col.BEFORE]
        _reinsert(sched, robot, at, count)
        return True
    return False


@inlined
def deploy(sched: LinkedSchedule) -> bool:
    """Move targets to a new sortie; now and then its carrier first picks up a rover elsewhere."""
    if not sched.groups[col.ROVERS, 0] or not sched.groups[col.CARRIERS, 0]:
        return False
    count = _remove(sched)
    target = sched.work[col.TAKEN, 0]
    rover = sched.nodes[ops.pick(sched, col.ROVERS), col.ROBOT]
    entry = ops.near_meeting(sched, col.ENTRIES, rover, sched.nodes[target, col.PLACE])
    down = ops.new_transfer(sched, col.UNDOCK, entry)
    if entry < 0 or down < 0:
        return False
    ops.begin_sortie(sched, down, rover)
    carrier, final = choices.near_carrier(sched, target), -1
    at = choices.transfer_position(sched, down, carrier, carrier) if ops.draw(sched, 3) else -1
    # Nobody to set down, or sometimes anyway: the rover comes from another sortie.
    if at < 0:
        first, final = _pick_up_elsewhere(sched, carrier, target)
        if first < 0 or (final >= 0 and sched.nodes[final, col.ROBOT] != rover):
            return False
        at = choices.transfer_position(sched, down, carrier, first)
        if at < 0:
            return False
    ops.assign(sched, down, carrier, at)
    last = _reinsert(sched, rover, down, count)
    # The dock left over from the other sortie ends this one.
    if final >= 0:
        ops.link(sched, last, final, rover)
        ops.link(sched, final, down, rover)
        leave = ops.near_meeting(sched, col.EXITS, rover, sched.nodes[last, col.PLACE])
        move_to(sched, final, leave)
        return leave >= 0
    if sched.recover or ops.draw(sched, 3) == 0:
        if ops.draw(sched, 2) == 0:
            carrier = choices.near_carrier(sched, target)
        return _pick_up(sched, last, carrier, down if carrier == sched.nodes[down, col.CARRIER] else carrier) >= 0
    return True


@inlined
def _pick_up_elsewhere(sched: LinkedSchedule, carrier: int, target: int) -> tuple[int, int]:
    """Dock a random rover, more often one near a target; return the dock and its former, removed one, or -1."""
    node = sched.hints[sched.nodes[target, col.PLACE], col.NEAR + ops.draw(sched, col.NEIGHBOURS)]
    if node < 0 or sched.nodes[node, col.BEFORE] < 0 or ops.draw(sched, 2):
        node = choices.random_node(sched)
    for _ in range(choices.TRIES):
        if not ops.is_carrier(sched, sched.nodes[node, col.ROBOT]):
            break
        node = choices.random_node(sched)
    up, final = -1, -1
    rover = sched.nodes[node, col.ROBOT]
    if not ops.is_carrier(sched, rover):
        head = ops.head_of(sched, node)
        last = sched.nodes[head, col.BEFORE]
        if sched.nodes[last, col.KIND] == col.DOCK:
            last, final = sched.nodes[last, col.BEFORE], last
            ops.link(sched, last, head, rover)
        up = _pick_up(sched, last, carrier, carrier)
    return up, final


@inlined
def _pick_up(sched: LinkedSchedule, last: int, carrier: int, first: int) -> int:
    """End a sortie with a dock on a carrier, somewhere from node `first` of its route on; return the dock, or -1."""
    rover = sched.nodes[last, col.ROBOT]
    leave = ops.near_meeting(sched, col.EXITS, rover, sched.nodes[last, col.PLACE])
    up = ops.new_transfer(sched, col.DOCK, leave)
    if leave < 0 or up < 0:
        return -1
    ops.insert(sched, up, rover, last)
    at = choices.transfer_position(sched, up, carrier, first)
    if at < 0:
        return -1
    ops.assign(sched, up, carrier, at)
    return up


@inlined
def swap(sched: LinkedSchedule) -> bool:
    """Exchange two targets."""
    one = choices.late_target(sched)
    other = choices.near_target(sched, one)
    if other == one:
        return False
    if sched.nodes[other, col.BEFORE] == one and sched.nodes[one, col.AFTER] == other:
        one, other = other, one
    robot_one, robot_other = sched.nodes[one, col.ROBOT], sched.nodes[other, col.ROBOT]
    at_one, at_other = sched.nodes[one, col.BEFORE], sched.nodes[other, col.BEFORE]
    ops.remove(sched, one)
    # Of two neighbours, it is enough to move the second before the first.
    if at_one == other:
        ops.insert(sched, one, robot_one, at_other)
        return True
    ops.remove(sched, other)
    ops.insert(sched, one, robot_other, at_other)
    ops.insert(sched, other, robot_one, at_one)
    return True


@inlined
def reverse(sched: LinkedSchedule) -> bool:
    first = choices.random_target(sched)
    count, node = 0, first
    while count < LONGEST_SEGMENT and sched.nodes[node, col.KIND] == col.EXPLORE:
        count += 1
        node = sched.nodes[node, col.AFTER]
    if count < 2:
        return False
    robot, at = sched.nodes[first, col.ROBOT], sched.nodes[first, col.BEFORE]
    count = take_targets(sched, first, count - ops.draw(sched, count - 1), 0)
    for i in range(count):
        ops.insert(sched, sched.work[col.TAKEN, i], robot, at)
    return True


@inlined
def swap_sorties(sched: LinkedSchedule) -> bool:
    """Exchange the targets of two sorties; their transfers keep their positions and move to meetings nearby."""
    one = choices.late_target(sched)
    other = first_target(sched, choices.near_target(sched, one))
    one = first_target(sched, one)
    if one == other:
        return False
    robot_one, robot_other = sched.nodes[one, col.ROBOT], sched.nodes[other, col.ROBOT]
    at_one, at_other = sched.nodes[one, col.BEFORE], sched.nodes[other, col.BEFORE]
    count_one = take_targets(sched, one, LONGEST_SEGMENT, 0)
    count_other = take_targets(sched, other, LONGEST_SEGMENT, LONGEST_SEGMENT)
    return _put_sortie(sched, robot_one, at_one, count_other, LONGEST_SEGMENT) and _put_sortie(
        sched, robot_other, at_other, count_one, 0
    )


@inlined
def _put_sortie(sched: LinkedSchedule, robot: int, at: int, count: int, top: int) -> bool:
    """Insert the targets taken behind a node and move the transfers around them; return whether there are meetings."""
    last = put_targets(sched, robot, at, count, top, True)
    if sched.nodes[at, col.KIND] == col.UNDOCK and sched.nodes[at, col.ROBOT] == robot:
        place = ops.near_meeting(sched, col.ENTRIES, robot, sched.nodes[sched.work[col.TAKEN, top], col.PLACE])
        if place < 0:
            return False
        move_to(sched, at, place)
    following = sched.nodes[last, col.AFTER]
    if sched.nodes[following, col.KIND] == col.DOCK and sched.nodes[following, col.ROBOT] == robot:
        place = ops.near_meeting(sched, col.EXITS, robot, sched.nodes[last, col.PLACE])
        if place < 0:
            return False
        move_to(sched, following, place)
    return True
