"""Moves of parts of carriers' routes, and exchanges of the tails of routes and sorties. Compiled.

Each returns whether it made a change; most changes are infeasible.
"""

from marsupial.native import inlined
from marsupial.planning.local_search import choices
from marsupial.planning.local_search import columns as col
from marsupial.planning.local_search import linked_schedule as ops
from marsupial.planning.local_search.linked_schedule import LinkedSchedule
from marsupial.planning.local_search.transfer_moves import drop_if_empty, swap_tails_at

LONGEST_STRING = 4  # most transfers of a carrier moved at once
LONGEST_TURN = 12  # most nodes of a route reversed at once


@inlined
def _focus_node(sched: LinkedSchedule) -> int:
    """Return a random node in use, half of the time one on a critical path."""
    node = choices.critical_node(sched) if ops.draw(sched, 2) else -1
    return node if node >= 0 else choices.random_node(sched)


@inlined
def move_string(sched: LinkedSchedule) -> bool:
    """Move a few consecutive transfers to another position or carrier (Or-opt)."""
    first = _focus_node(sched)
    if not ops.is_transfer(sched, first):
        return False
    carrier, wanted = sched.nodes[first, col.CARRIER], 2 + ops.draw(sched, LONGEST_STRING - 1)
    back, node, count = sched.nodes[first, col.CARRIER_BEFORE], first, 0
    while count < wanted and ops.is_transfer(sched, node):
        following = sched.nodes[node, col.CARRIER_AFTER]
        ops.unassign(sched, node)
        sched.work[col.TAKEN, count] = node
        count += 1
        node = following
    if count < 2:
        return False
    reversed_ = ops.draw(sched, 3) == 0
    at = back
    if ops.draw(sched, 2):
        carrier = ops.pick(sched, col.CARRIERS)
        at = choices.other_position(sched, carrier, back, sched.nodes[first, col.PLACE])
    elif not reversed_ or ops.draw(sched, 2):
        at = choices.other_position(sched, carrier, back, sched.nodes[first, col.PLACE])
    for i in range(count):
        node = sched.work[col.TAKEN, count - 1 - i if reversed_ else i]
        ops.assign(sched, node, carrier, at)
        at = node
    return True


@inlined
def invert(sched: LinkedSchedule) -> bool:
    """Reverse a part of a carrier's route (2-opt); rovers set down and picked up in it keep that order."""
    first = _focus_node(sched)
    if sched.nodes[first, col.KIND] == col.EXPLORE and not ops.is_carrier(sched, sched.nodes[first, col.ROBOT]):
        first = ops.head_of(sched, first)
    if sched.nodes[first, col.KIND] == col.START:
        return False
    carrier = ops.route_robot(sched, first)
    at, node, count, wanted = ops.before(sched, first, carrier), first, 0, 2 + ops.draw(sched, LONGEST_TURN - 1)
    while count < wanted and node != carrier:
        following = ops.after(sched, node, carrier)
        if sched.nodes[node, col.KIND] == col.EXPLORE:
            ops.remove(sched, node)
        else:
            ops.unassign(sched, node)
        sched.work[col.TAKEN, count] = node
        count += 1
        node = following
    # reversed, a route would pick a rover up before it sets it down; exchanged beforehand, the two are in order again
    _exchange_pairs(sched, count)
    for i in range(count):
        node = sched.work[col.TAKEN, count - 1 - i]
        if sched.nodes[node, col.KIND] == col.EXPLORE:
            ops.insert(sched, node, carrier, at)
        else:
            ops.assign(sched, node, carrier, at)
        at = node
    return count > 1


@inlined
def _exchange_pairs(sched: LinkedSchedule, count: int) -> None:
    """Exchange the undock and the dock of each sortie that has both among the nodes taken."""
    for i in range(count):
        node = sched.work[col.TAKEN, i]
        if sched.nodes[node, col.KIND] == col.UNDOCK:
            for k in range(i + 1, count):
                if sched.work[col.TAKEN, k] == sched.nodes[node, col.BEFORE]:
                    sched.work[col.TAKEN, i], sched.work[col.TAKEN, k] = sched.work[col.TAKEN, k], node
                    break


@inlined
def cross_exchange(sched: LinkedSchedule) -> bool:
    """Exchange the tails of two carriers' routes."""
    if sched.groups[col.CARRIERS, 0] < 2:
        return False
    at_one = _focus_node(sched)
    if sched.nodes[at_one, col.KIND] == col.START:
        return False
    one = ops.route_robot(sched, at_one)
    other = choices.other_carrier(sched, at_one)
    if one == other or not ops.is_carrier(sched, one):
        return False
    if ops.draw(sched, 2):
        at_one = ops.before(sched, at_one, one)
    at_other = _position_at(sched, other, sched.nodes[at_one, col.END], _load_at(sched, one, at_one))
    if at_other < 0:
        return False
    return cross_exchange_at(sched, one, at_one, other, at_other)


@inlined
def _load_at(sched: LinkedSchedule, carrier: int, at: int) -> int:
    load, node = ops.initial_load(sched, carrier), carrier
    while node != at:
        node = ops.after(sched, node, carrier)
        load += ops.load_change(sched, node)
    return load


@inlined
def _position_at(sched: LinkedSchedule, carrier: int, end: int, wanted: int) -> int:
    """Return the last node of a route that ends by `end` with `wanted` rovers aboard, or the first after it, or -1."""
    load, at, node, later = ops.initial_load(sched, carrier), -1, carrier, ops.draw(sched, 2)
    while True:
        load += ops.load_change(sched, node)
        # With equal loads both routes stay within capacity; now and then other loads are tried.
        if load == wanted or ops.draw(sched, 8) == 0:
            if sched.nodes[node, col.END] <= end:
                at = node
            else:
                return node if later or at < 0 else at
        node = ops.after(sched, node, carrier)
        if node == carrier:
            return at


@inlined
def splice(sched: LinkedSchedule) -> bool:
    """Exchange the tails of two robots so that one of them reaches two near targets in a row."""
    nodes = sched.nodes
    at_one = choices.late_target(sched)
    target = sched.hints[nodes[at_one, col.PLACE], col.NEAR + ops.draw(sched, col.NEIGHBOURS)]
    if target < 0:
        return False
    one, other, at_other = nodes[at_one, col.ROBOT], nodes[target, col.ROBOT], nodes[target, col.BEFORE]
    by_carrier = ops.is_carrier(sched, one)
    if by_carrier != ops.is_carrier(sched, other) or (by_carrier and one == other):
        return False
    if by_carrier:
        return cross_exchange_at(sched, one, at_one, other, at_other)
    if not swap_tails_at(sched, at_one, at_other):
        return False
    drop_if_empty(sched, at_other)
    return True


@inlined
def cross_exchange_at(sched: LinkedSchedule, one: int, at_one: int, other: int, at_other: int) -> bool:
    """Exchange what is behind a node each in two carriers' routes."""
    first_one, first_other = ops.after(sched, at_one, one), ops.after(sched, at_other, other)
    last_one, last_other = sched.nodes[one, col.BEFORE], sched.nodes[other, col.BEFORE]
    _change_carrier(sched, first_one, one, other)
    _change_carrier(sched, first_other, other, one)
    ops.append(sched, at_one, one, one, (first_other, last_other), first_other == other)
    ops.append(sched, at_other, other, other, (first_one, last_one), first_one == one)
    ops.check_load(sched, one)
    ops.check_load(sched, other)
    return True


@inlined
def _change_carrier(sched: LinkedSchedule, first: int, old: int, new: int) -> None:
    node = first
    while node != old:
        following = ops.after(sched, node, old)
        ops.log_node(sched, node)
        sched.nodes[node, col.ROBOT if sched.nodes[node, col.KIND] == col.EXPLORE else col.CARRIER] = new
        ops.enqueue(sched, node)
        node = following
