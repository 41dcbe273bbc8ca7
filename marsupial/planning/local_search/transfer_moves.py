"""Changes of transfers: who docks and undocks on which carrier, where, and in which order. Compiled.

Each says whether it made a change; most changes can't be carried out.
"""

from __future__ import annotations

from marsupial.native import inlined
from marsupial.planning.local_search.choices import (
    TRIES,
    critical_node,
    other_carrier,
    some_node,
    some_transfer,
    turn,
    turn_except,
)
from marsupial.planning.local_search.encoding import DOCK, ENTRIES, EXITS, EXPLORE, MEETINGS, NEIGHBOURS, START, UNDOCK
from marsupial.planning.local_search.net import (
    AFTER,
    BEFORE,
    CARRIER,
    CARRIER_AFTER,
    CARRIER_BEFORE,
    END,
    KIND,
    NEAR,
    PLACE,
    ROBOT,
    Net,
    after,
    append,
    ask,
    assign,
    carries,
    door,
    draw,
    head_of,
    insert,
    is_transfer,
    link,
    pick,
    take_out,
    touch,
    unassign,
)


@inlined
def move_to(net: Net, transfer: int, place: int) -> None:
    """Let a transfer begin or end elsewhere."""
    touch(net, transfer)
    net.nodes[transfer, PLACE] = place
    ask(net, transfer)
    ask(net, net.nodes[transfer, AFTER])
    ask(net, net.nodes[transfer, CARRIER_AFTER])


@inlined
def move_meeting(net: Net) -> bool:
    """Set down or pick up a rover at another meeting."""
    transfer = some_transfer(net, START)
    if transfer < 0:
        return False
    rover, place = net.nodes[transfer, ROBOT], net.nodes[transfer, PLACE]
    following = net.nodes[transfer, AFTER]
    if net.nodes[transfer, KIND] == UNDOCK and net.nodes[following, KIND] == EXPLORE:
        place = door(net, ENTRIES, rover, net.nodes[following, PLACE])
    elif draw(net, 4):
        place = door(net, EXITS, rover, net.nodes[net.nodes[transfer, BEFORE], PLACE])
    else:
        place = pick(net, MEETINGS)
    if place < 0 or place == net.nodes[transfer, PLACE]:
        return False
    move_to(net, transfer, place)
    return True


@inlined
def reorder(net: Net) -> bool:
    """Do something a carrier has to do at another turn: a transfer, or a target of its own."""
    for attempt in range(2 * TRIES):
        node = critical_node(net) if attempt < TRIES and draw(net, 2) else -1
        if node < 0:
            node = some_node(net)
        if is_transfer(net, node):
            return _assign_again(net, node, net.nodes[node, CARRIER])
        robot = net.nodes[node, ROBOT]
        if net.nodes[node, KIND] == EXPLORE and carries(net, robot):
            was = net.nodes[node, BEFORE]
            take_out(net, node)
            at = turn_except(net, robot, -1, net.nodes[node, PLACE])
            if at == was:
                return False
            insert(net, node, robot, at)
            return True
    return False


@inlined
def _assign_again(net: Net, transfer: int, carrier: int) -> bool:
    """Give a transfer that is in a route to a carrier, at some other turn."""
    was = net.nodes[transfer, CARRIER_BEFORE]
    unassign(net, transfer)
    at = turn(net, transfer, carrier, carrier)
    if at < 0 or at == was:
        return False
    assign(net, transfer, carrier, at)
    return True


@inlined
def reassign(net: Net) -> bool:
    """Give a transfer to another carrier, mostly with one of the other kind, so that as many are aboard after."""
    transfer = some_transfer(net, START)
    if transfer < 0:
        return False
    carrier = other_carrier(net, transfer)
    if carrier == net.nodes[transfer, CARRIER]:
        return False
    partner = _partner(net, transfer)
    if partner < 0:
        return _assign_again(net, transfer, carrier)
    down, up = (partner, transfer) if net.nodes[transfer, KIND] == DOCK else (transfer, partner)
    unassign(net, down)
    unassign(net, up)
    at = turn(net, down, carrier, carrier)
    if at < 0:
        return False
    assign(net, down, carrier, at)
    at = turn(net, up, carrier, down if head_of(net, up) == down else carrier)
    if at < 0:
        return False
    assign(net, up, carrier, at)
    return True


@inlined
def _partner(net: Net, transfer: int) -> int:
    """Return a transfer of the other kind by the same carrier: of the same sortie, or the next, or sometimes -1."""
    kind, carrier, choice = net.nodes[transfer, KIND], net.nodes[transfer, CARRIER], draw(net, 8)
    if choice == 0 or (choice < 4 and not net.recover):
        return -1
    if choice < 6:
        other = net.nodes[transfer, BEFORE] if kind == UNDOCK else head_of(net, transfer)
        if net.nodes[other, KIND] == UNDOCK + DOCK - kind and net.nodes[other, CARRIER] == carrier:
            return other
    node = after(net, transfer, carrier)
    while node != carrier and net.nodes[node, KIND] != UNDOCK + DOCK - kind:
        node = after(net, node, carrier)
    return node if node != carrier else -1


@inlined
def swap_tails_at(net: Net, at_one: int, at_other: int) -> bool:
    """Let two sorties change what is behind a node of each; False if there is no use in that or it can't be."""
    rover, head_one, head_other = net.nodes[at_one, ROBOT], head_of(net, at_one), head_of(net, at_other)
    if rover != net.nodes[at_other, ROBOT] or head_one == head_other:
        return False
    first_one, first_other = net.nodes[at_one, AFTER], net.nodes[at_other, AFTER]
    last_one, last_other = net.nodes[head_one, BEFORE], net.nodes[head_other, BEFORE]
    if first_one == head_one and first_other == head_other:
        return False
    append(net, at_one, head_one, rover, (first_other, last_other), first_other == head_other)
    append(net, at_other, head_other, rover, (first_one, last_one), first_one == head_one)
    return True


@inlined
def swap_tails(net: Net) -> bool:
    """Let two sorties change what comes after some moment."""
    at_one, other = some_node(net), some_node(net)
    if carries(net, net.nodes[at_one, ROBOT]) or carries(net, net.nodes[other, ROBOT]):
        return False
    if net.nodes[at_one, KIND] == DOCK:
        return False
    at_other = head_of(net, other)
    node, head = net.nodes[at_other, AFTER], at_other
    while node != head and net.nodes[node, KIND] == EXPLORE and net.nodes[node, END] <= net.nodes[at_one, END]:
        at_other = node
        node = net.nodes[node, AFTER]
    if not swap_tails_at(net, at_one, at_other):
        return False
    drop_if_empty(net, at_one)
    drop_if_empty(net, at_other)
    return True


@inlined
def _near_transfer(net: Net, transfer: int) -> int:
    """Return another transfer of the same kind, mostly that of a target near, or -1."""
    kind = net.nodes[transfer, KIND]
    target = net.nodes[transfer, BEFORE if kind == DOCK else AFTER]
    node = net.hints[net.nodes[target, PLACE], NEAR + draw(net, NEIGHBOURS)]
    if draw(net, 4) and node >= 0 and not carries(net, net.nodes[node, ROBOT]):
        node = head_of(net, node)
        if kind == DOCK:
            node = net.nodes[node, BEFORE]
        if net.nodes[node, KIND] == kind:
            return node
    return some_transfer(net, kind)


@inlined
def swap_transfers(net: Net) -> bool:
    """Let two transfers change turns."""
    one = some_transfer(net, START)
    if one < 0:
        return False
    other = _near_transfer(net, one)
    if other < 0 or one == other:
        return False
    if net.nodes[one, CARRIER_BEFORE] == other:
        one, other = other, one
    carrier, carrier_other = net.nodes[one, CARRIER], net.nodes[other, CARRIER]
    at, at_other = net.nodes[one, CARRIER_BEFORE], net.nodes[other, CARRIER_BEFORE]
    unassign(net, one)
    unassign(net, other)
    assign(net, other, carrier, at)
    assign(net, one, carrier_other, other if at_other == one else at_other)
    return True


@inlined
def drop_if_empty(net: Net, head: int) -> bool:
    """Take out the transfers of a sortie on which nothing is explored, if they are of no use; say whether they were."""
    last = net.nodes[head, AFTER]
    if net.nodes[head, KIND] != UNDOCK or net.nodes[head, BEFORE] != last or (net.recover and last == head):
        return False
    if last != head:
        if net.nodes[last, KIND] != DOCK or (net.nodes[last, CARRIER] != net.nodes[head, CARRIER] and draw(net, 2)):
            return False
        take_out(net, last)
    take_out(net, head)
    return True


@inlined
def merge(net: Net) -> bool:
    """Leave a rover where it was picked up, or let it drive on to a sortie that another would begin.

    Or leave out a sortie on which nothing is explored.
    """
    up = some_transfer(net, START)
    if up < 0:
        return False
    if net.nodes[up, KIND] == UNDOCK:
        return drop_if_empty(net, up)
    rover, last = net.nodes[up, ROBOT], net.nodes[up, BEFORE]
    take_out(net, up)
    if not net.recover and draw(net, 2):
        return True
    down = some_transfer(net, UNDOCK)
    if down < 0 or net.nodes[down, ROBOT] != rover or head_of(net, last) == down or net.nodes[down, AFTER] == down:
        return False
    head, first, end = head_of(net, last), net.nodes[down, AFTER], net.nodes[down, BEFORE]
    link(net, last, first, rover)
    link(net, end, head, rover)
    link(net, down, down, rover)
    take_out(net, down)
    return True
