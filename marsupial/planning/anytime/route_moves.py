"""Random changes of several rides of carriers at once, and of all that robots do from some moment on, compiled.

Each says whether it made one; most of them can't be carried out.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from marsupial.planning.anytime.choices import LONG, critical_node, detour, late_target, some_node
from marsupial.planning.anytime.encoding import (
    CAPACITY,
    CARRIERS,
    DOCK,
    EXPLORE,
    NEIGHBOURS,
    ROVERS,
    START,
    TARGETS,
    UNDOCK,
)
from marsupial.planning.anytime.kernel import (
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
    aboard,
    after,
    ask,
    before,
    check_load,
    compiled,
    draw,
    host,
    pick,
    touch,
    unhost,
)
from marsupial.planning.anytime.ride_moves import swap_tails

LONGEST_STRING = 4
"""How many rides of a carrier are moved at once at most."""


@compiled
def _busy(net: Net) -> Any:
    """Return a random node that is in use, half of the time one that somebody late waited for."""
    node = critical_node(net) if draw(net, 2) else -1
    return node if node >= 0 else some_node(net)


@compiled
def shift(net: Net) -> bool:
    """Have a carrier give a few rides that follow each other at another turn."""
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
    at = back if turned and draw(net, 2) else _other_turn(net, carrier, back, net.nodes[first, PLACE])
    for i in range(count):
        node = net.work[TAKEN, count - 1 - i if turned else i]
        host(net, node, carrier, at)
        at = node
    return True


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
    """Let two carriers change what they do from some moment on, and the rovers aboard what they do then."""
    if net.groups[CARRIERS, 0] < 2:
        return False
    at_one = _busy(net)
    if net.nodes[at_one, KIND] == START:
        return False
    one = net.nodes[at_one, ROBOT] if net.nodes[at_one, KIND] == EXPLORE else net.nodes[at_one, CARRIER]
    other = pick(net, CARRIERS)
    if one == other or net.robots[one, CAPACITY] < 0:
        return False
    if draw(net, 2):
        at_one = before(net, at_one, one)
    at_other, node = other, after(net, other, other)
    while node != other and net.nodes[node, END] <= net.nodes[at_one, END]:
        at_other = node
        node = after(net, node, other)
    if draw(net, 2) and at_other != other:
        at_other = before(net, at_other, other)
    return _cross_at(net, one, at_one, other, at_other)


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
    if one == other or carries != (net.robots[other, CAPACITY] >= 0):
        return False
    if carries:
        return _cross_at(net, one, at_one, other, at_other)
    if aboard(net, at_other, other) >= 0:
        return False
    swap_tails(net, one, at_one, other, at_other)
    return True


@compiled
def _cross_at(net: Net, one: int, at_one: int, other: int, at_other: int) -> bool:
    """Let two carriers change what is behind a node of each, and the rovers aboard there what they do then."""
    half = net.work.shape[1] // 2
    count_one = _leaving(net, one, at_one, 0)
    count_other = _leaving(net, other, at_other, half)
    for i in range(max(count_one, count_other)):
        from_one = net.nodes[net.work[TAKEN, i], BEFORE] if i < count_one else _idle(net, one, at_one)
        from_other = net.nodes[net.work[TAKEN, half + i], BEFORE] if i < count_other else _idle(net, other, at_other)
        if from_one < 0 or from_other < 0:
            return False
        rover_one, rover_other = net.nodes[from_one, ROBOT], net.nodes[from_other, ROBOT]
        if rover_one == rover_other:
            return False
        swap_tails(net, rover_one, from_one, rover_other, from_other)
    _swap_routes(net, one, at_one, other, at_other)
    return True


@compiled
def _leaving(net: Net, carrier: int, at: int, top: int) -> Any:
    """Note where the rovers aboard a carrier after a node are set down next; return how many are."""
    count, node, end = 0, after(net, at, carrier), net.nodes[at, END]
    while node != carrier:
        if net.nodes[node, KIND] == UNDOCK:
            previous = net.nodes[node, BEFORE]
            if net.nodes[previous, KIND] != DOCK or net.nodes[previous, END] <= end:
                net.work[TAKEN, top + count] = node
                count += 1
        node = after(net, node, carrier)
    return count


@compiled
def _idle(net: Net, carrier: int, at: int) -> Any:
    """Return the last node of a rover that stays aboard a carrier from a node on, -1 if there is none."""
    for i in range(net.groups[ROVERS, 0]):
        rover = net.groups[ROVERS, 1 + i]
        last = net.nodes[rover, BEFORE]
        if aboard(net, last, rover) == carrier and (last == rover or net.nodes[last, END] <= net.nodes[at, END]):
            return last
    return -1


@compiled
def _swap_routes(net: Net, one: int, at_one: int, other: int, at_other: int) -> None:
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
