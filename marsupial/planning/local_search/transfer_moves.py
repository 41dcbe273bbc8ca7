"""Changes of transfers: who docks and undocks on which carrier, where, and in which order. Compiled.

Each says whether it made a change; most changes can't be carried out.
"""

from __future__ import annotations

from marsupial.native import inlined
from marsupial.planning.local_search import choices
from marsupial.planning.local_search import columns as col
from marsupial.planning.local_search import net as nets
from marsupial.planning.local_search.net import Net


@inlined
def move_to(net: Net, transfer: int, place: int) -> None:
    """Let a transfer begin or end elsewhere."""
    nets.touch(net, transfer)
    net.nodes[transfer, col.PLACE] = place
    nets.ask(net, transfer)
    nets.ask(net, net.nodes[transfer, col.AFTER])
    nets.ask(net, net.nodes[transfer, col.CARRIER_AFTER])


@inlined
def move_meeting(net: Net) -> bool:
    """Set down or pick up a rover at another meeting."""
    transfer = choices.some_transfer(net, col.START)
    if transfer < 0:
        return False
    rover, place = net.nodes[transfer, col.ROBOT], net.nodes[transfer, col.PLACE]
    following = net.nodes[transfer, col.AFTER]
    if net.nodes[transfer, col.KIND] == col.UNDOCK and net.nodes[following, col.KIND] == col.EXPLORE:
        place = nets.door(net, col.ENTRIES, rover, net.nodes[following, col.PLACE])
    elif nets.draw(net, 4):
        place = nets.door(net, col.EXITS, rover, net.nodes[net.nodes[transfer, col.BEFORE], col.PLACE])
    else:
        place = nets.pick(net, col.MEETINGS)
    if place < 0 or place == net.nodes[transfer, col.PLACE]:
        return False
    move_to(net, transfer, place)
    return True


@inlined
def reorder(net: Net) -> bool:
    """Do something a carrier has to do at another turn: a transfer, or a target of its own."""
    for attempt in range(2 * choices.TRIES):
        node = choices.critical_node(net) if attempt < choices.TRIES and nets.draw(net, 2) else -1
        if node < 0:
            node = choices.some_node(net)
        if nets.is_transfer(net, node):
            return _assign_again(net, node, net.nodes[node, col.CARRIER])
        robot = net.nodes[node, col.ROBOT]
        if net.nodes[node, col.KIND] == col.EXPLORE and nets.carries(net, robot):
            was = net.nodes[node, col.BEFORE]
            nets.take_out(net, node)
            at = choices.turn_except(net, robot, -1, net.nodes[node, col.PLACE])
            if at == was:
                return False
            nets.insert(net, node, robot, at)
            return True
    return False


@inlined
def _assign_again(net: Net, transfer: int, carrier: int) -> bool:
    """Give a transfer that is in a route to a carrier, at some other turn."""
    was = net.nodes[transfer, col.CARRIER_BEFORE]
    nets.unassign(net, transfer)
    at = choices.turn(net, transfer, carrier, carrier)
    if at < 0 or at == was:
        return False
    nets.assign(net, transfer, carrier, at)
    return True


@inlined
def reassign(net: Net) -> bool:
    """Give a transfer to another carrier, mostly with one of the other kind, so that as many are aboard after."""
    transfer = choices.some_transfer(net, col.START)
    if transfer < 0:
        return False
    carrier = choices.other_carrier(net, transfer)
    if carrier == net.nodes[transfer, col.CARRIER]:
        return False
    partner = _partner(net, transfer)
    if partner < 0:
        return _assign_again(net, transfer, carrier)
    down, up = (partner, transfer) if net.nodes[transfer, col.KIND] == col.DOCK else (transfer, partner)
    nets.unassign(net, down)
    nets.unassign(net, up)
    at = choices.turn(net, down, carrier, carrier)
    if at < 0:
        return False
    nets.assign(net, down, carrier, at)
    at = choices.turn(net, up, carrier, down if nets.head_of(net, up) == down else carrier)
    if at < 0:
        return False
    nets.assign(net, up, carrier, at)
    return True


@inlined
def _partner(net: Net, transfer: int) -> int:
    """Return a transfer of the other kind by the same carrier: of the same sortie, or the next, or sometimes -1."""
    kind, carrier, choice = net.nodes[transfer, col.KIND], net.nodes[transfer, col.CARRIER], nets.draw(net, 8)
    if choice == 0 or (choice < 4 and not net.recover):
        return -1
    if choice < 6:
        other = net.nodes[transfer, col.BEFORE] if kind == col.UNDOCK else nets.head_of(net, transfer)
        if net.nodes[other, col.KIND] == col.UNDOCK + col.DOCK - kind and net.nodes[other, col.CARRIER] == carrier:
            return other
    node = nets.after(net, transfer, carrier)
    while node != carrier and net.nodes[node, col.KIND] != col.UNDOCK + col.DOCK - kind:
        node = nets.after(net, node, carrier)
    return node if node != carrier else -1


@inlined
def swap_tails_at(net: Net, at_one: int, at_other: int) -> bool:
    """Let two sorties change what is behind a node of each; False if there is no use in that or it can't be."""
    rover, head_one, head_other = net.nodes[at_one, col.ROBOT], nets.head_of(net, at_one), nets.head_of(net, at_other)
    if rover != net.nodes[at_other, col.ROBOT] or head_one == head_other:
        return False
    first_one, first_other = net.nodes[at_one, col.AFTER], net.nodes[at_other, col.AFTER]
    last_one, last_other = net.nodes[head_one, col.BEFORE], net.nodes[head_other, col.BEFORE]
    if first_one == head_one and first_other == head_other:
        return False
    nets.append(net, at_one, head_one, rover, (first_other, last_other), first_other == head_other)
    nets.append(net, at_other, head_other, rover, (first_one, last_one), first_one == head_one)
    return True


@inlined
def swap_tails(net: Net) -> bool:
    """Let two sorties change what comes after some moment."""
    at_one, other = choices.some_node(net), choices.some_node(net)
    if nets.carries(net, net.nodes[at_one, col.ROBOT]) or nets.carries(net, net.nodes[other, col.ROBOT]):
        return False
    if net.nodes[at_one, col.KIND] == col.DOCK:
        return False
    at_other = nets.head_of(net, other)
    node, head = net.nodes[at_other, col.AFTER], at_other
    while (
        node != head
        and net.nodes[node, col.KIND] == col.EXPLORE
        and net.nodes[node, col.END] <= net.nodes[at_one, col.END]
    ):
        at_other = node
        node = net.nodes[node, col.AFTER]
    if not swap_tails_at(net, at_one, at_other):
        return False
    drop_if_empty(net, at_one)
    drop_if_empty(net, at_other)
    return True


@inlined
def _near_transfer(net: Net, transfer: int) -> int:
    """Return another transfer of the same kind, mostly that of a target near, or -1."""
    kind = net.nodes[transfer, col.KIND]
    target = net.nodes[transfer, col.BEFORE if kind == col.DOCK else col.AFTER]
    node = net.hints[net.nodes[target, col.PLACE], col.NEAR + nets.draw(net, col.NEIGHBOURS)]
    if nets.draw(net, 4) and node >= 0 and not nets.carries(net, net.nodes[node, col.ROBOT]):
        node = nets.head_of(net, node)
        if kind == col.DOCK:
            node = net.nodes[node, col.BEFORE]
        if net.nodes[node, col.KIND] == kind:
            return node
    return choices.some_transfer(net, kind)


@inlined
def swap_transfers(net: Net) -> bool:
    """Let two transfers change turns."""
    one = choices.some_transfer(net, col.START)
    if one < 0:
        return False
    other = _near_transfer(net, one)
    if other < 0 or one == other:
        return False
    if net.nodes[one, col.CARRIER_BEFORE] == other:
        one, other = other, one
    carrier, carrier_other = net.nodes[one, col.CARRIER], net.nodes[other, col.CARRIER]
    at, at_other = net.nodes[one, col.CARRIER_BEFORE], net.nodes[other, col.CARRIER_BEFORE]
    nets.unassign(net, one)
    nets.unassign(net, other)
    nets.assign(net, other, carrier, at)
    nets.assign(net, one, carrier_other, other if at_other == one else at_other)
    return True


@inlined
def drop_if_empty(net: Net, head: int) -> bool:
    """Take out the transfers of a sortie on which nothing is explored, if they are of no use; say whether they were."""
    last = net.nodes[head, col.AFTER]
    if net.nodes[head, col.KIND] != col.UNDOCK or net.nodes[head, col.BEFORE] != last or (net.recover and last == head):
        return False
    if last != head:
        if net.nodes[last, col.KIND] != col.DOCK or (
            net.nodes[last, col.CARRIER] != net.nodes[head, col.CARRIER] and nets.draw(net, 2)
        ):
            return False
        nets.take_out(net, last)
    nets.take_out(net, head)
    return True


@inlined
def merge(net: Net) -> bool:
    """Leave a rover where it was picked up, or let it drive on to a sortie that another would begin.

    Or leave out a sortie on which nothing is explored.
    """
    up = choices.some_transfer(net, col.START)
    if up < 0:
        return False
    if net.nodes[up, col.KIND] == col.UNDOCK:
        return drop_if_empty(net, up)
    rover, last = net.nodes[up, col.ROBOT], net.nodes[up, col.BEFORE]
    nets.take_out(net, up)
    if not net.recover and nets.draw(net, 2):
        return True
    down = choices.some_transfer(net, col.UNDOCK)
    if (
        down < 0
        or net.nodes[down, col.ROBOT] != rover
        or nets.head_of(net, last) == down
        or net.nodes[down, col.AFTER] == down
    ):
        return False
    head, first, end = nets.head_of(net, last), net.nodes[down, col.AFTER], net.nodes[down, col.BEFORE]
    nets.link(net, last, first, rover)
    nets.link(net, end, head, rover)
    nets.link(net, down, down, rover)
    nets.take_out(net, down)
    return True
