"""Random choices among the nodes of a net, compiled."""

from __future__ import annotations

from typing import Any

import numpy as np

from marsupial.planning.local_search.encoding import (
    CAPACITY,
    CARRIERS,
    DOCK,
    EXPLORE,
    NEIGHBOURS,
    START,
    TARGETS,
    TYPE,
    UNDOCK,
)
from marsupial.planning.local_search.net import (
    AFTER,
    BEFORE,
    CARRIER,
    CARRIER_BEFORE,
    COUNTED,
    END,
    FREE,
    KIND,
    NEAR,
    PLACE,
    ROBOT,
    UNUSED,
    Net,
    after,
    compiled,
    draw,
    first_load,
    head_of,
    pick,
)

TRIES = 8
"""How often something is drawn that may turn out to be of no use."""

LONG = 1 << 60

FOCUS = 4
"""Of up to how many targets the latest is chosen."""


WATCHED = 8
"""Of up to how many robots that with the latest end is chosen."""


@compiled
def critical_node(net: Net) -> Any:
    """Return a random node of those that something late waited for, -1 if nothing is done."""
    node = _some_end(net)
    for _ in range(draw(net, WATCHED)):
        other = _some_end(net)
        if net.nodes[other, KIND] != START and net.nodes[other, END] > net.nodes[node, END]:
            node = other
    chosen, seen = -1, 0
    while net.nodes[node, KIND] != START:
        seen += 1
        if draw(net, seen) == 0:
            chosen = node
        node = waited_for(net, node)
    return chosen


@compiled
def _some_end(net: Net) -> Any:
    """Return what a random carrier does last, or the last of a random outing."""
    node = draw(net, len(net.robots))
    if net.nodes[node, BEFORE] < 0:
        if not net.groups[TARGETS, 0]:
            return net.nodes[pick(net, CARRIERS), BEFORE]
        node = some_target(net)
        if net.robots[net.nodes[node, ROBOT], CAPACITY] >= 0:
            return node
        node = head_of(net, node)
    return net.nodes[node, BEFORE]


@compiled
def waited_for(net: Net, node: int) -> Any:
    """Return which of the nodes before one it could not begin earlier for."""
    kind, previous = net.nodes[node, KIND], net.nodes[node, BEFORE]
    if kind == EXPLORE:
        return previous
    other = net.nodes[node, CARRIER_BEFORE]
    if kind == UNDOCK:
        return other
    place = net.nodes[node, PLACE]
    ready = net.nodes[previous, END]
    ready += net.leg[net.robots[net.nodes[node, ROBOT], TYPE], net.nodes[previous, PLACE], place]
    there = net.nodes[other, END] + net.leg[net.robots[net.nodes[node, CARRIER], TYPE], net.nodes[other, PLACE], place]
    return other if there >= ready else previous


@compiled
def some_target(net: Net) -> Any:
    """Return a random target's node."""
    return len(net.robots) + draw(net, net.groups[TARGETS, 0])


@compiled
def late_target(net: Net) -> Any:
    """Return a random target's node, those reached late more often, or those that somebody late waited for."""
    if draw(net, 2):
        node = critical_node(net)
        if node >= 0 and net.nodes[node, KIND] == UNDOCK:
            node = net.nodes[node, AFTER]
        elif node >= 0 and net.nodes[node, KIND] == DOCK:
            node = net.nodes[node, BEFORE]
        if node >= 0 and net.nodes[node, KIND] == EXPLORE:
            return node
    one = some_target(net)
    for _ in range(draw(net, FOCUS)):
        other = some_target(net)
        if net.nodes[other, END] > net.nodes[one, END]:
            one = other
    return one


@compiled
def some_node(net: Net) -> Any:
    """Return a random node that is in use."""
    top = len(net.robots) + net.groups[TARGETS, 0]
    rides = len(net.nodes) - top - net.work[0, UNUSED]
    while True:
        node = draw(net, top + 2 * rides)
        if node < len(net.nodes) and net.nodes[node, KIND] != FREE and net.nodes[node, BEFORE] >= 0:
            return node


@compiled
def some_ride(net: Net, kind: int) -> Any:
    """Return a random dock or undock (or any for `START`), -1 if none is found."""
    if draw(net, 2):
        node = critical_node(net)
        if node >= 0 and net.nodes[node, KIND] != EXPLORE:
            if kind in (START, net.nodes[node, KIND]):
                return node
            node = net.nodes[node, CARRIER_BEFORE]
            if kind == net.nodes[node, KIND]:
                return node
    top = len(net.robots) + net.groups[TARGETS, 0]
    rides = len(net.nodes) - top - net.work[0, UNUSED]
    if not rides:
        return -1
    for _ in range(2 * TRIES):
        node = top + draw(net, 2 * rides)
        if (
            node < len(net.nodes)
            and net.nodes[node, KIND] != FREE
            and net.nodes[node, BEFORE] >= 0
            and kind in (START, net.nodes[node, KIND])
        ):
            return node
    return -1


@compiled
def detour(net: Net, carrier: int, node: int, place: int) -> Any:
    """Return how much longer a carrier drives if it goes to a place behind a node."""
    kind, here = net.robots[carrier, TYPE], net.nodes[node, PLACE]
    longer = np.int64(net.leg[kind, here, place])
    following = after(net, node, carrier)
    if following != carrier:
        there = net.nodes[following, PLACE]
        longer += np.int64(net.leg[kind, place, there]) - np.int64(net.leg[kind, here, there])
    return longer


@compiled
def turn(net: Net, ride: int, carrier: int, first: int) -> Any:
    """Return a node of a carrier's chain, from `first` on, behind which a ride fits that is in no route, or -1.

    That is judged by who is aboard there and by the times before the change: a rover is not set down after its outing
    was to end, nor picked up before it could be there. It is a random one or that of the least detour.
    """
    last, place, docks = net.nodes[ride, BEFORE], net.nodes[ride, PLACE], net.nodes[ride, KIND] == DOCK
    earliest, latest = np.int64(0), np.int64(LONG)
    if docks:
        earliest = net.nodes[last, END]
        if first != carrier:
            earliest += net.nodes[net.nodes[first, CARRIER_BEFORE], END] - net.nodes[first, END]
    elif net.nodes[ride, COUNTED]:
        latest = net.nodes[last, END]
    chosen, seen, node, reached = -1, 0, carrier, False
    load, places = first_load(net, carrier), net.robots[carrier, CAPACITY]
    guided, least = draw(net, 2) == 0, np.int64(LONG)
    while True:
        if net.nodes[node, KIND] == DOCK or net.nodes[node, KIND] == UNDOCK:
            load += 1 if net.nodes[node, KIND] == DOCK else -1
        reached = reached or node == first
        behind = after(net, node, carrier)
        if reached and (load < places if docks else load > 0):
            if net.nodes[node, END] > latest:
                return chosen
            if behind == carrier or net.nodes[behind, END] >= earliest:
                if guided:
                    longer = detour(net, carrier, node, place)
                    if longer < least:
                        least, chosen = longer, node
                else:
                    seen += 1
                    if draw(net, seen) == 0:
                        chosen = node
        if behind == carrier:
            return chosen
        node = behind


@compiled
def near_carrier(net: Net, target: int) -> Any:
    """Return a random carrier, more often one that is busy near a target's node, and that is done early."""
    one, other = _near_carrier(net, target), _near_carrier(net, target)
    if draw(net, 4) and net.nodes[net.nodes[other, BEFORE], END] < net.nodes[net.nodes[one, BEFORE], END]:
        return other
    return one


@compiled
def _near_carrier(net: Net, target: int) -> Any:
    if draw(net, 8):
        node = net.hints[net.nodes[target, PLACE], NEAR + draw(net, NEIGHBOURS)]
        if node >= 0 and net.nodes[node, BEFORE] >= 0:
            if net.robots[net.nodes[node, ROBOT], CAPACITY] >= 0:
                return net.nodes[node, ROBOT]
            ride = head_of(net, node)
            if draw(net, 2):
                ride = net.nodes[ride, BEFORE]
            if net.nodes[ride, KIND] == UNDOCK or net.nodes[ride, KIND] == DOCK:
                return net.nodes[ride, CARRIER]
    return pick(net, CARRIERS)


@compiled
def between(net: Net, carrier: int, first: int, last: int, place: int) -> Any:
    """Return a node of a carrier's chain from `first` on, before `last`: a random one or that of the least detour."""
    chosen, seen, node = first, 0, first
    guided, least = draw(net, 2) == 0, np.int64(LONG)
    while True:
        if guided:
            longer = detour(net, carrier, node, place)
            if longer < least:
                least, chosen = longer, node
        else:
            seen += 1
            if draw(net, seen) == 0:
                chosen = node
        node = after(net, node, carrier)
        if node in (last, carrier):
            return chosen
