"""Changes of several transfers of carriers at once, and of all that robots do from some moment on. Compiled.

Each says whether it made a change; most changes can't be carried out.
"""

from __future__ import annotations

from marsupial.native import inlined
from marsupial.planning.local_search.choices import critical_node, late_target, other_carrier, some_node, turn_except
from marsupial.planning.local_search.encoding import CARRIERS, EXPLORE, NEIGHBOURS, START, UNDOCK
from marsupial.planning.local_search.net import (
    BEFORE,
    CARRIER,
    CARRIER_AFTER,
    CARRIER_BEFORE,
    END,
    KIND,
    NEAR,
    PLACE,
    ROBOT,
    TAKEN,
    Net,
    after,
    append,
    ask,
    assign,
    before,
    boarding,
    carries,
    check_load,
    draw,
    driver,
    first_load,
    head_of,
    insert,
    is_transfer,
    pick,
    take_out,
    touch,
    unassign,
)
from marsupial.planning.local_search.transfer_moves import drop_if_empty, swap_tails_at

LONGEST_STRING = 4
"""How many transfers of a carrier are moved at once at most."""

LONGEST_TURN = 12
"""How much of a carrier's route is turned round at most."""


@inlined
def _busy(net: Net) -> int:
    """Return a random node that is in use, half of the time one that somebody late waited for."""
    node = critical_node(net) if draw(net, 2) else -1
    return node if node >= 0 else some_node(net)


@inlined
def move_string(net: Net) -> bool:
    """Move a few transfers that follow each other to another turn, or to another carrier."""
    first = _busy(net)
    if not is_transfer(net, first):
        return False
    carrier, wanted = net.nodes[first, CARRIER], 2 + draw(net, LONGEST_STRING - 1)
    back, node, count = net.nodes[first, CARRIER_BEFORE], first, 0
    while count < wanted and is_transfer(net, node):
        following = net.nodes[node, CARRIER_AFTER]
        unassign(net, node)
        net.work[TAKEN, count] = node
        count += 1
        node = following
    if count < 2:
        return False
    turned = draw(net, 3) == 0
    at = back
    if draw(net, 2):
        carrier = pick(net, CARRIERS)
        at = turn_except(net, carrier, back, net.nodes[first, PLACE])
    elif not turned or draw(net, 2):
        at = turn_except(net, carrier, back, net.nodes[first, PLACE])
    for i in range(count):
        node = net.work[TAKEN, count - 1 - i if turned else i]
        assign(net, node, carrier, at)
        at = node
    return True


@inlined
def invert(net: Net) -> bool:
    """Turn round a part of a carrier's route; who is set down and picked up in it still is in that order."""
    first = _busy(net)
    if net.nodes[first, KIND] == EXPLORE and not carries(net, net.nodes[first, ROBOT]):
        first = head_of(net, first)
    if net.nodes[first, KIND] == START:
        return False
    carrier = driver(net, first)
    at, node, count, wanted = before(net, first, carrier), first, 0, 2 + draw(net, LONGEST_TURN - 1)
    while count < wanted and node != carrier:
        following = after(net, node, carrier)
        _lift(net, node)
        net.work[TAKEN, count] = node
        count += 1
        node = following
    _pair(net, count)
    for i in range(count):
        node = net.work[TAKEN, count - 1 - i]
        if net.nodes[node, KIND] == EXPLORE:
            insert(net, node, carrier, at)
        else:
            assign(net, node, carrier, at)
        at = node
    return count > 1


@inlined
def _lift(net: Net, node: int) -> None:
    """Take a target of its own or a transfer out of a carrier's route."""
    if net.nodes[node, KIND] == EXPLORE:
        take_out(net, node)
    else:
        unassign(net, node)


@inlined
def _pair(net: Net, count: int) -> None:
    """Let the undock and the dock of each sortie change places in what was lifted, where both were."""
    for i in range(count):
        node = net.work[TAKEN, i]
        if net.nodes[node, KIND] == UNDOCK:
            for k in range(i + 1, count):
                if net.work[TAKEN, k] == net.nodes[node, BEFORE]:
                    net.work[TAKEN, i], net.work[TAKEN, k] = net.work[TAKEN, k], node
                    break


@inlined
def cross_exchange(net: Net) -> bool:
    """Let two carriers change what they do from some moment on."""
    if net.groups[CARRIERS, 0] < 2:
        return False
    at_one = _busy(net)
    if net.nodes[at_one, KIND] == START:
        return False
    one = driver(net, at_one)
    other = other_carrier(net, at_one)
    if one == other or not carries(net, one):
        return False
    if draw(net, 2):
        at_one = before(net, at_one, one)
    at_other = _at_the_time(net, other, net.nodes[at_one, END], _load_at(net, one, at_one))
    if at_other < 0:
        return False
    return cross_exchange_at(net, one, at_one, other, at_other)


@inlined
def _load_at(net: Net, carrier: int, at: int) -> int:
    """Return how many rovers are aboard a carrier after a node."""
    load, node = first_load(net, carrier), carrier
    while node != at:
        node = after(net, node, carrier)
        load += boarding(net, node)
    return load


@inlined
def _at_the_time(net: Net, carrier: int, end: int, wanted: int) -> int:
    """Return the last node of a carrier that ends by a time, or the first after it, with so many aboard then, or -1."""
    load, at, node, later = first_load(net, carrier), -1, carrier, draw(net, 2)
    while True:
        load += boarding(net, node)
        if load == wanted or draw(net, 8) == 0:
            if net.nodes[node, END] <= end:
                at = node
            else:
                return node if later or at < 0 else at
        node = after(net, node, carrier)
        if node == carrier:
            return at


@inlined
def splice(net: Net) -> bool:
    """Let two robots change what they do from some moment on so that one reaches two targets that are near in turn."""
    at_one = late_target(net)
    target = net.hints[net.nodes[at_one, PLACE], NEAR + draw(net, NEIGHBOURS)]
    if target < 0:
        return False
    one, other, at_other = net.nodes[at_one, ROBOT], net.nodes[target, ROBOT], net.nodes[target, BEFORE]
    by_carrier = carries(net, one)
    if by_carrier != carries(net, other) or (by_carrier and one == other):
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
    first_one, first_other = after(net, at_one, one), after(net, at_other, other)
    last_one, last_other = net.nodes[one, BEFORE], net.nodes[other, BEFORE]
    _give_route(net, first_one, one, other)
    _give_route(net, first_other, other, one)
    append(net, at_one, one, one, (first_other, last_other), first_other == other)
    append(net, at_other, other, other, (first_one, last_one), first_one == one)
    check_load(net, one)
    check_load(net, other)
    return True


@inlined
def _give_route(net: Net, first: int, old: int, new: int) -> None:
    node = first
    while node != old:
        following = after(net, node, old)
        touch(net, node)
        net.nodes[node, ROBOT if net.nodes[node, KIND] == EXPLORE else CARRIER] = new
        ask(net, node)
        node = following
