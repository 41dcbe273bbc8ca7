"""Changes of several transfers of carriers at once, and of all that robots do from some moment on. Compiled.

Each says whether it made a change; most changes can't be carried out.
"""

from __future__ import annotations

from marsupial.native import inlined
from marsupial.planning.local_search import columns as col
from marsupial.planning.local_search import net as nets
from marsupial.planning.local_search.choices import critical_node, late_target, other_carrier, some_node, turn_except
from marsupial.planning.local_search.net import Net
from marsupial.planning.local_search.transfer_moves import drop_if_empty, swap_tails_at

LONGEST_STRING = 4
"""How many transfers of a carrier are moved at once at most."""

LONGEST_TURN = 12
"""How much of a carrier's route is turned round at most."""


@inlined
def _busy(net: Net) -> int:
    """Return a random node that is in use, half of the time one on a critical path."""
    node = critical_node(net) if nets.draw(net, 2) else -1
    return node if node >= 0 else some_node(net)


@inlined
def move_string(net: Net) -> bool:
    """Move a few transfers that follow each other to another turn, or to another carrier."""
    first = _busy(net)
    if not nets.is_transfer(net, first):
        return False
    carrier, wanted = net.nodes[first, col.CARRIER], 2 + nets.draw(net, LONGEST_STRING - 1)
    back, node, count = net.nodes[first, col.CARRIER_BEFORE], first, 0
    while count < wanted and nets.is_transfer(net, node):
        following = net.nodes[node, col.CARRIER_AFTER]
        nets.unassign(net, node)
        net.work[col.TAKEN, count] = node
        count += 1
        node = following
    if count < 2:
        return False
    turned = nets.draw(net, 3) == 0
    at = back
    if nets.draw(net, 2):
        carrier = nets.pick(net, col.CARRIERS)
        at = turn_except(net, carrier, back, net.nodes[first, col.PLACE])
    elif not turned or nets.draw(net, 2):
        at = turn_except(net, carrier, back, net.nodes[first, col.PLACE])
    for i in range(count):
        node = net.work[col.TAKEN, count - 1 - i if turned else i]
        nets.assign(net, node, carrier, at)
        at = node
    return True


@inlined
def invert(net: Net) -> bool:
    """Turn round a part of a carrier's route; who is set down and picked up in it still is in that order."""
    first = _busy(net)
    if net.nodes[first, col.KIND] == col.EXPLORE and not nets.carries(net, net.nodes[first, col.ROBOT]):
        first = nets.head_of(net, first)
    if net.nodes[first, col.KIND] == col.START:
        return False
    carrier = nets.driver(net, first)
    at, node, count, wanted = nets.before(net, first, carrier), first, 0, 2 + nets.draw(net, LONGEST_TURN - 1)
    while count < wanted and node != carrier:
        following = nets.after(net, node, carrier)
        _lift(net, node)
        net.work[col.TAKEN, count] = node
        count += 1
        node = following
    _pair(net, count)
    for i in range(count):
        node = net.work[col.TAKEN, count - 1 - i]
        if net.nodes[node, col.KIND] == col.EXPLORE:
            nets.insert(net, node, carrier, at)
        else:
            nets.assign(net, node, carrier, at)
        at = node
    return count > 1


@inlined
def _lift(net: Net, node: int) -> None:
    if net.nodes[node, col.KIND] == col.EXPLORE:
        nets.take_out(net, node)
    else:
        nets.unassign(net, node)


@inlined
def _pair(net: Net, count: int) -> None:
    """Let the undock and the dock of each sortie change places in what was lifted, where both were."""
    for i in range(count):
        node = net.work[col.TAKEN, i]
        if net.nodes[node, col.KIND] == col.UNDOCK:
            for k in range(i + 1, count):
                if net.work[col.TAKEN, k] == net.nodes[node, col.BEFORE]:
                    net.work[col.TAKEN, i], net.work[col.TAKEN, k] = net.work[col.TAKEN, k], node
                    break


@inlined
def cross_exchange(net: Net) -> bool:
    """Let two carriers change what they do from some moment on."""
    if net.groups[col.CARRIERS, 0] < 2:
        return False
    at_one = _busy(net)
    if net.nodes[at_one, col.KIND] == col.START:
        return False
    one = nets.driver(net, at_one)
    other = other_carrier(net, at_one)
    if one == other or not nets.carries(net, one):
        return False
    if nets.draw(net, 2):
        at_one = nets.before(net, at_one, one)
    at_other = _at_the_time(net, other, net.nodes[at_one, col.END], _load_at(net, one, at_one))
    if at_other < 0:
        return False
    return cross_exchange_at(net, one, at_one, other, at_other)


@inlined
def _load_at(net: Net, carrier: int, at: int) -> int:
    load, node = nets.first_load(net, carrier), carrier
    while node != at:
        node = nets.after(net, node, carrier)
        load += nets.boarding(net, node)
    return load


@inlined
def _at_the_time(net: Net, carrier: int, end: int, wanted: int) -> int:
    """Return the last node of a carrier that ends by a time, or the first after it, with so many aboard then, or -1."""
    load, at, node, later = nets.first_load(net, carrier), -1, carrier, nets.draw(net, 2)
    while True:
        load += nets.boarding(net, node)
        if load == wanted or nets.draw(net, 8) == 0:
            if net.nodes[node, col.END] <= end:
                at = node
            else:
                return node if later or at < 0 else at
        node = nets.after(net, node, carrier)
        if node == carrier:
            return at


@inlined
def splice(net: Net) -> bool:
    """Let two robots change what they do from some moment on so that one reaches two targets that are near in turn."""
    at_one = late_target(net)
    target = net.hints[net.nodes[at_one, col.PLACE], col.NEAR + nets.draw(net, col.NEIGHBOURS)]
    if target < 0:
        return False
    one, other, at_other = net.nodes[at_one, col.ROBOT], net.nodes[target, col.ROBOT], net.nodes[target, col.BEFORE]
    by_carrier = nets.carries(net, one)
    if by_carrier != nets.carries(net, other) or (by_carrier and one == other):
        return False
    if by_carrier:
        return cross_exchange_at(net, one, at_one, other, at_other)
    if not swap_tails_at(net, at_one, at_other):
        return False
    drop_if_empty(net, at_other)
    return True


@inlined
def cross_exchange_at(net: Net, one: int, at_one: int, other: int, at_other: int) -> bool:
    """Let two carriers change what is behind a node of each."""
    first_one, first_other = nets.after(net, at_one, one), nets.after(net, at_other, other)
    last_one, last_other = net.nodes[one, col.BEFORE], net.nodes[other, col.BEFORE]
    _give_route(net, first_one, one, other)
    _give_route(net, first_other, other, one)
    nets.append(net, at_one, one, one, (first_other, last_other), first_other == other)
    nets.append(net, at_other, other, other, (first_one, last_one), first_one == one)
    nets.check_load(net, one)
    nets.check_load(net, other)
    return True


@inlined
def _give_route(net: Net, first: int, old: int, new: int) -> None:
    node = first
    while node != old:
        following = nets.after(net, node, old)
        nets.touch(net, node)
        net.nodes[node, col.ROBOT if net.nodes[node, col.KIND] == col.EXPLORE else col.CARRIER] = new
        nets.ask(net, node)
        node = following
