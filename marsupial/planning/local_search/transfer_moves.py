"""Moves of transfers: on which carrier, where, and in which order rovers dock and undock. Compiled.

Each returns whether it made a change; most changes are infeasible.
"""

from marsupial.native import inlined
from marsupial.planning.local_search import choices
from marsupial.planning.local_search import columns as col
from marsupial.planning.local_search import linked_schedule as ops
from marsupial.planning.local_search.linked_schedule import LinkedSchedule


@inlined
def move_to(sched: LinkedSchedule, transfer: int, place: int) -> None:
    """Move a transfer to another place, at the same position in both its chains."""
    ops.log_node(sched, transfer)
    sched.nodes[transfer, col.PLACE] = place
    ops.enqueue(sched, transfer)
    ops.enqueue(sched, sched.nodes[transfer, col.AFTER])
    ops.enqueue(sched, sched.nodes[transfer, col.CARRIER_AFTER])


@inlined
def move_meeting(sched: LinkedSchedule) -> bool:
    """Move a transfer to another meeting."""
    transfer = choices.random_transfer(sched, col.START)
    if transfer < 0:
        return False
    rover, place = sched.nodes[transfer, col.ROBOT], sched.nodes[transfer, col.PLACE]
    following = sched.nodes[transfer, col.AFTER]
    if sched.nodes[transfer, col.KIND] == col.UNDOCK and sched.nodes[following, col.KIND] == col.EXPLORE:
        place = ops.near_meeting(sched, col.ENTRIES, rover, sched.nodes[following, col.PLACE])
    elif ops.draw(sched, 4):
        place = ops.near_meeting(sched, col.EXITS, rover, sched.nodes[sched.nodes[transfer, col.BEFORE], col.PLACE])
    else:
        place = ops.pick(sched, col.MEETINGS)
    if place < 0 or place == sched.nodes[transfer, col.PLACE]:
        return False
    move_to(sched, transfer, place)
    return True


@inlined
def reorder(sched: LinkedSchedule) -> bool:
    """Move a transfer, or a carrier's own target, to another position of the same route."""
    for attempt in range(2 * choices.TRIES):
        node = choices.critical_node(sched) if attempt < choices.TRIES and ops.draw(sched, 2) else -1
        if node < 0:
            node = choices.random_node(sched)
        if ops.is_transfer(sched, node):
            return _reposition(sched, node, sched.nodes[node, col.CARRIER])
        robot = sched.nodes[node, col.ROBOT]
        if sched.nodes[node, col.KIND] == col.EXPLORE and ops.is_carrier(sched, robot):
            was = sched.nodes[node, col.BEFORE]
            ops.remove(sched, node)
            at = choices.other_position(sched, robot, -1, sched.nodes[node, col.PLACE])
            if at == was:
                return False
            ops.insert(sched, node, robot, at)
            return True
    return False


@inlined
def _reposition(sched: LinkedSchedule, transfer: int, carrier: int) -> bool:
    """Move a transfer that is in a route to another position, in the route of `carrier`."""
    was = sched.nodes[transfer, col.CARRIER_BEFORE]
    ops.unassign(sched, transfer)
    at = choices.transfer_position(sched, transfer, carrier, carrier)
    if at < 0 or at == was:
        return False
    ops.assign(sched, transfer, carrier, at)
    return True


@inlined
def reassign(sched: LinkedSchedule) -> bool:
    """Move a transfer to another carrier, mostly with one of the other kind so that later loads stay the same."""
    transfer = choices.random_transfer(sched, col.START)
    if transfer < 0:
        return False
    carrier = choices.other_carrier(sched, transfer)
    if carrier == sched.nodes[transfer, col.CARRIER]:
        return False
    partner = _partner(sched, transfer)
    if partner < 0:
        return _reposition(sched, transfer, carrier)
    down, up = (partner, transfer) if sched.nodes[transfer, col.KIND] == col.DOCK else (transfer, partner)
    ops.unassign(sched, down)
    ops.unassign(sched, up)
    at = choices.transfer_position(sched, down, carrier, carrier)
    if at < 0:
        return False
    ops.assign(sched, down, carrier, at)
    at = choices.transfer_position(sched, up, carrier, down if ops.head_of(sched, up) == down else carrier)
    if at < 0:
        return False
    ops.assign(sched, up, carrier, at)
    return True


@inlined
def _partner(sched: LinkedSchedule, transfer: int) -> int:
    """Return a transfer of the other kind by the same carrier: of the same sortie, or the next, or sometimes -1."""
    kind, carrier, choice = sched.nodes[transfer, col.KIND], sched.nodes[transfer, col.CARRIER], ops.draw(sched, 8)
    if choice == 0 or (choice < 4 and not sched.recover):
        return -1
    if choice < 6:
        other = sched.nodes[transfer, col.BEFORE] if kind == col.UNDOCK else ops.head_of(sched, transfer)
        if sched.nodes[other, col.KIND] == col.UNDOCK + col.DOCK - kind and sched.nodes[other, col.CARRIER] == carrier:
            return other
    node = ops.after(sched, transfer, carrier)
    while node != carrier and sched.nodes[node, col.KIND] != col.UNDOCK + col.DOCK - kind:
        node = ops.after(sched, node, carrier)
    return node if node != carrier else -1


@inlined
def swap_tails_at(sched: LinkedSchedule, at_one: int, at_other: int) -> bool:
    """Exchange what is behind a node each in two sorties; return whether that is possible and changes anything."""
    nodes = sched.nodes
    rover, head_one, head_other = nodes[at_one, col.ROBOT], ops.head_of(sched, at_one), ops.head_of(sched, at_other)
    if rover != nodes[at_other, col.ROBOT] or head_one == head_other:
        return False
    first_one, first_other = nodes[at_one, col.AFTER], nodes[at_other, col.AFTER]
    last_one, last_other = nodes[head_one, col.BEFORE], nodes[head_other, col.BEFORE]
    if first_one == head_one and first_other == head_other:
        return False
    ops.append(sched, at_one, head_one, rover, (first_other, last_other), first_other == head_other)
    ops.append(sched, at_other, head_other, rover, (first_one, last_one), first_one == head_one)
    return True


@inlined
def swap_tails(sched: LinkedSchedule) -> bool:
    """Exchange the tails of two sorties (2-opt*), cut at about the same time."""
    nodes = sched.nodes
    at_one, other = choices.random_node(sched), choices.random_node(sched)
    if ops.is_carrier(sched, nodes[at_one, col.ROBOT]) or ops.is_carrier(sched, nodes[other, col.ROBOT]):
        return False
    if nodes[at_one, col.KIND] == col.DOCK:
        return False
    at_other = ops.head_of(sched, other)
    node, head = nodes[at_other, col.AFTER], at_other
    while node != head and nodes[node, col.KIND] == col.EXPLORE and nodes[node, col.END] <= nodes[at_one, col.END]:
        at_other = node
        node = nodes[node, col.AFTER]
    if not swap_tails_at(sched, at_one, at_other):
        return False
    drop_if_empty(sched, at_one)
    drop_if_empty(sched, at_other)
    return True


@inlined
def _near_transfer(sched: LinkedSchedule, transfer: int) -> int:
    """Return another transfer of the same kind, mostly one that serves a target near, or -1."""
    kind = sched.nodes[transfer, col.KIND]
    target = sched.nodes[transfer, col.BEFORE if kind == col.DOCK else col.AFTER]
    node = sched.hints[sched.nodes[target, col.PLACE], col.NEAR + ops.draw(sched, col.NEIGHBOURS)]
    if ops.draw(sched, 4) and node >= 0 and not ops.is_carrier(sched, sched.nodes[node, col.ROBOT]):
        node = ops.head_of(sched, node)
        if kind == col.DOCK:
            node = sched.nodes[node, col.BEFORE]
        if sched.nodes[node, col.KIND] == kind:
            return node
    return choices.random_transfer(sched, kind)


@inlined
def swap_transfers(sched: LinkedSchedule) -> bool:
    """Exchange the positions of two transfers."""
    one = choices.random_transfer(sched, col.START)
    if one < 0:
        return False
    other = _near_transfer(sched, one)
    if other < 0 or one == other:
        return False
    # Of two neighbours, `one` has to be the first: the other's position is then known to be behind it.
    if sched.nodes[one, col.CARRIER_BEFORE] == other:
        one, other = other, one
    carrier, carrier_other = sched.nodes[one, col.CARRIER], sched.nodes[other, col.CARRIER]
    at, at_other = sched.nodes[one, col.CARRIER_BEFORE], sched.nodes[other, col.CARRIER_BEFORE]
    ops.unassign(sched, one)
    ops.unassign(sched, other)
    ops.assign(sched, other, carrier, at)
    ops.assign(sched, one, carrier_other, other if at_other == one else at_other)
    return True


@inlined
def drop_if_empty(sched: LinkedSchedule, head: int) -> bool:
    """Remove the transfers of a sortie without targets, if they are of no use; return whether they were."""
    nodes = sched.nodes
    last = nodes[head, col.AFTER]
    if nodes[head, col.KIND] != col.UNDOCK or nodes[head, col.BEFORE] != last or (sched.recover and last == head):
        return False
    if last != head:
        if nodes[last, col.KIND] != col.DOCK:
            return False
        if nodes[last, col.CARRIER] != nodes[head, col.CARRIER] and ops.draw(sched, 2):
            return False
        ops.remove(sched, last)
    ops.remove(sched, head)
    return True


@inlined
def merge(sched: LinkedSchedule) -> bool:
    """Remove a dock, or append the sortie of another undock in its place; or remove a sortie without targets."""
    up = choices.random_transfer(sched, col.START)
    if up < 0:
        return False
    if sched.nodes[up, col.KIND] == col.UNDOCK:
        return drop_if_empty(sched, up)
    rover, last = sched.nodes[up, col.ROBOT], sched.nodes[up, col.BEFORE]
    ops.remove(sched, up)
    if not sched.recover and ops.draw(sched, 2):
        return True
    down = choices.random_transfer(sched, col.UNDOCK)
    if down < 0 or sched.nodes[down, col.ROBOT] != rover:
        return False
    if ops.head_of(sched, last) == down or sched.nodes[down, col.AFTER] == down:
        return False
    head, first, end = ops.head_of(sched, last), sched.nodes[down, col.AFTER], sched.nodes[down, col.BEFORE]
    ops.link(sched, last, first, rover)
    ops.link(sched, end, head, rover)
    ops.link(sched, down, down, rover)
    ops.remove(sched, down)
    return True
