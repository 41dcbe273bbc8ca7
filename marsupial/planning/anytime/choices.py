"""Random choices among the nodes of a net, compiled."""

from __future__ import annotations

from typing import Any

import numpy as np

from marsupial.planning.anytime.encoding import (
    DOCK,
    EXPLORE,
    START,
    TARGETS,
    TYPE,
    UNDOCK,
)
from marsupial.planning.anytime.kernel import (
    AFTER,
    BEFORE,
    CARRIER,
    CARRIER_BEFORE,
    END,
    FREE,
    KIND,
    PLACE,
    ROBOT,
    UNUSED,
    Net,
    after,
    compiled,
    draw,
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
    """Return a random node of those that one of the late robots waited for, -1 if it does nothing."""
    robots = len(net.robots)
    node = net.nodes[draw(net, robots), BEFORE]
    for _ in range(draw(net, WATCHED)):
        other = net.nodes[draw(net, robots), BEFORE]
        if other >= robots and (node < robots or net.nodes[other, END] > net.nodes[node, END]):
            node = other
    chosen, seen = -1, 0
    while net.nodes[node, KIND] != START:
        seen += 1
        if draw(net, seen) == 0:
            chosen = node
        node = waited_for(net, node)
    return chosen


@compiled
def waited_for(net: Net, node: int) -> Any:
    """Return which of the nodes before one it could not begin earlier for."""
    kind, previous = net.nodes[node, KIND], net.nodes[node, BEFORE]
    if kind == EXPLORE:
        return previous
    place = net.nodes[node, PLACE]
    ready = net.nodes[previous, END]
    if kind == DOCK:
        ready += net.leg[net.robots[net.nodes[node, ROBOT], TYPE], net.nodes[previous, PLACE], place]
    other = net.nodes[node, CARRIER_BEFORE]
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
def slot(net: Net, carrier: int, previous: int, following: int, place: int) -> Any:
    """Return a node of a carrier's chain behind which a ride at a place fits that its rover does between two nodes.

    That is judged by the times before the change; -1 if there is none. It is a random one or that of the least detour.
    """
    chosen, seen, node = -1, 0, carrier
    earliest = net.nodes[previous, END]
    ends = net.nodes[following, KIND] == START
    guided, least = draw(net, 2) == 0, np.int64(LONG)
    while True:
        if not ends and net.nodes[node, END] > net.nodes[following, END]:
            return chosen
        behind = after(net, node, carrier)
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
