"""Random changes of several rides of carriers at once, and of all that robots do from some moment on, compiled.

Each says whether it made one; most of them can't be carried out.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from marsupial.planning.local_search.choices import LONG, critical_node, detour, late_target, near_carrier, some_node
from marsupial.planning.local_search.encoding import (
    CAPACITY,
    CARRIERS,
    DOCK,
    EXPLORE,
    NEIGHBOURS,
    START,
    TARGETS,
    UNDOCK,
)
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
    TAKEN,
    Net,
    after,
    ask,
    before,
    check_load,
    compiled,
    draw,
    first_load,
    head_of,
    host,
    insert,
    pick,
    take_out,
    touch,
    unhost,
)
from marsupial.planning.local_search.transport_moves import swap_tails, tidy

LONGEST_STRING = 4
"""How many rides of a carrier are moved at once at most."""

LONGEST_TURN = 12
"""How much of a carrier's route is turned round at most."""


@compiled
def _busy(net: Net) -> Any:
    """Return a random node that is in use, half of the time one that somebody late waited for."""
    node = critical_node(net) if draw(net, 2) else -1
    return node if node >= 0 else some_node(net)


@compiled
def shift(net: Net) -> bool:
    """Have a carrier give a few rides that follow each other at another turn, or another carrier."""
    first = _busy(net)
    if net.nodes[first, KIND] != DOCK and net.nodes[first, KIND] != UNDOCK:
        return False
    carrier, wanted = net.nodes[first, CARRIER], 2 + draw(net, LONGEST_STRING - 1)
    back, node, count = net.nodes[first, CARRIER_BEFORE], first, 0
    while count < wanted and (net.nodes[node, KIND] == DOCK or net.nodes[node, KIND] == UNDOCK):
        following = net.nodes[node, CARRIER_AFTER]
        unhost(net, node)
        net.work[TAKEN, count] = node
        count += 1
        node = following
    if count < 2:
        return False
    turned = draw(net, 3) == 0
    at = back
    if draw(net, 2):
        carrier = pick(net, CARRIERS)
        at = _other_turn(net, carrier, back, net.nodes[first, PLACE])
    elif not turned or draw(net, 2):
        at = _other_turn(net, carrier, back, net.nodes[first, PLACE])
    for i in range(count):
        node = net.work[TAKEN, count - 1 - i if turned else i]
        host(net, node, carrier, at)
        at = node
    return True


@compiled
def turn_round(net: Net) -> bool:
    """Turn round a part of a carrier's route; who is set down and picked up in it still is in that order."""
    first = _busy(net)
    if net.nodes[first, KIND] == EXPLORE and net.robots[net.nodes[first, ROBOT], CAPACITY] < 0:
        first = head_of(net, first)
    if net.nodes[first, KIND] == START:
        return False
    carrier = net.nodes[first, ROBOT] if net.nodes[first, KIND] == EXPLORE else net.nodes[first, CARRIER]
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
            host(net, node, carrier, at)
        at = node
    return count > 1


@compiled
def _lift(net: Net, node: int) -> None:
    """Take a target of its own or a ride out of a carrier's route."""
    if net.nodes[node, KIND] == EXPLORE:
        take_out(net, node)
    else:
        unhost(net, node)


@compiled
def _pair(net: Net, count: int) -> None:
    """Let the undock and the dock of each outing change places in what was lifted, where both were."""
    for i in range(count):
        node = net.work[TAKEN, i]
        if net.nodes[node, KIND] == UNDOCK:
            for k in range(i + 1, count):
                if net.work[TAKEN, k] == net.nodes[node, BEFORE]:
                    net.work[TAKEN, i], net.work[TAKEN, k] = net.work[TAKEN, k], node
                    break


@compiled
def _other_turn(net: Net, carrier: int, back: int, place: int) -> Any:
    """Return a node of a carrier's chain other than `back`: a random one or that of the least detour."""
    at, seen, node = carrier, 0, carrier
    guided, least = draw(net, 2) == 0, np.int64(LONG)
    while True:
        if node != back and guided:
            longer = detour(net, carrier, node, place)
            if longer < least:
                at, least = node, longer
        elif node != back:
            seen += 1
            if draw(net, seen) == 0:
                at = node
        node = after(net, node, carrier)
        if node == carrier:
            return at


@compiled
def cross(net: Net) -> bool:
    """Let two carriers change what they do from some moment on."""
    if net.groups[CARRIERS, 0] < 2:
        return False
    at_one = _busy(net)
    if net.nodes[at_one, KIND] == START:
        return False
    one = net.nodes[at_one, ROBOT] if net.nodes[at_one, KIND] == EXPLORE else net.nodes[at_one, CARRIER]
    target = net.nodes[at_one, BEFORE if net.nodes[at_one, KIND] == DOCK else AFTER]
    other = near_carrier(net, target) if net.nodes[target, KIND] == EXPLORE else pick(net, CARRIERS)
    if one == other or net.robots[one, CAPACITY] < 0:
        return False
    if draw(net, 2):
        at_one = before(net, at_one, one)
    at_other = _at_the_time(net, other, net.nodes[at_one, END], _load_at(net, one, at_one))
    if at_other < 0:
        return False
    return cross_at(net, one, at_one, other, at_other)


@compiled
def _load_at(net: Net, carrier: int, at: int) -> Any:
    """Return how many rovers are aboard a carrier after a node."""
    load, node = first_load(net, carrier), carrier
    while node != at:
        node = after(net, node, carrier)
        if net.nodes[node, KIND] != EXPLORE:
            load += 1 if net.nodes[node, KIND] == DOCK else -1
    return load


@compiled
def _at_the_time(net: Net, carrier: int, end: int, wanted: int) -> Any:
    """Return the last node of a carrier that ends by a time, or the first after it, with so many aboard then, or -1."""
    load, at, node, later = first_load(net, carrier), -1, carrier, draw(net, 2)
    while True:
        if net.nodes[node, KIND] == DOCK or net.nodes[node, KIND] == UNDOCK:
            load += 1 if net.nodes[node, KIND] == DOCK else -1
        if load == wanted or draw(net, 8) == 0:
            if net.nodes[node, END] <= end:
                at = node
            else:
                return node if later or at < 0 else at
        node = after(net, node, carrier)
        if node == carrier:
            return at


@compiled
def splice(net: Net) -> bool:
    """Let two robots change what they do from some moment on so that one reaches two targets that are near in turn."""
    if not net.groups[TARGETS, 0]:
        return False
    at_one = late_target(net)
    target = net.hints[net.nodes[at_one, PLACE], NEAR + draw(net, NEIGHBOURS)]
    if target < 0:
        return False
    one, other, at_other = net.nodes[at_one, ROBOT], net.nodes[target, ROBOT], net.nodes[target, BEFORE]
    carries = net.robots[one, CAPACITY] >= 0
    if carries != (net.robots[other, CAPACITY] >= 0) or (carries and one == other):
        return False
    if carries:
        return cross_at(net, one, at_one, other, at_other)
    if not swap_tails(net, at_one, at_other):
        return False
    tidy(net, at_other)
    return True


@compiled
def cross_at(net: Net, one: int, at_one: int, other: int, at_other: int) -> bool:
    """Let two carriers change what is behind a node of each."""
    first_one, first_other = after(net, at_one, one), after(net, at_other, other)
    last_one, last_other = net.nodes[one, BEFORE], net.nodes[other, BEFORE]
    _give_route(net, first_one, one, other)
    _give_route(net, first_other, other, one)
    if first_other != other:
        _join(net, at_one, first_other, one)
        _join(net, last_other, one, one)
    else:
        _join(net, at_one, one, one)
    if first_one != one:
        _join(net, at_other, first_one, other)
        _join(net, last_one, other, other)
    else:
        _join(net, at_other, other, other)
    check_load(net, one)
    check_load(net, other)
    return True


@compiled
def _give_route(net: Net, first: int, old: int, new: int) -> None:
    node = first
    while node != old:
        following = after(net, node, old)
        touch(net, node)
        net.nodes[node, ROBOT if net.nodes[node, KIND] == EXPLORE else CARRIER] = new
        ask(net, node)
        node = following


@compiled
def _join(net: Net, node: int, following: int, carrier: int) -> None:
    touch(net, node)
    touch(net, following)
    net.nodes[node, AFTER if net.nodes[node, ROBOT] == carrier else CARRIER_AFTER] = following
    net.nodes[following, BEFORE if net.nodes[following, ROBOT] == carrier else CARRIER_BEFORE] = node
    ask(net, following)
