"""Random choices among the nodes of a net, compiled."""

from __future__ import annotations

from marsupial.native import inlined
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
    boarding,
    carries,
    draw,
    first_load,
    head_of,
    is_transfer,
    leg_ms,
    pick,
)

TRIES = 8
"""How often something is drawn that may turn out to be of no use."""

LONG = 1 << 60

FOCUS = 4
"""Of up to how many targets the latest is chosen."""

WATCHED = 8
"""Of up to how many robots that with the latest end is chosen."""


@inlined
def critical_node(net: Net) -> int:
    """Return a random node on the critical path to something late, -1 if nothing is done."""
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


@inlined
def _some_end(net: Net) -> int:
    """Return what a random carrier does last, or the last of a random sortie."""
    node = draw(net, len(net.robots))
    if net.nodes[node, BEFORE] < 0:
        if not net.groups[TARGETS, 0]:
            return net.nodes[pick(net, CARRIERS), BEFORE]
        node = some_target(net)
        if carries(net, net.nodes[node, ROBOT]):
            return node
        node = head_of(net, node)
    return net.nodes[node, BEFORE]


@inlined
def waited_for(net: Net, node: int) -> int:
    """Return which of the nodes before one it could not begin earlier for."""
    kind, previous = net.nodes[node, KIND], net.nodes[node, BEFORE]
    if kind == EXPLORE:
        return previous
    other = net.nodes[node, CARRIER_BEFORE]
    if kind == UNDOCK:
        return other
    place = net.nodes[node, PLACE]
    ready = net.nodes[previous, END] + leg_ms(net, net.nodes[node, ROBOT], net.nodes[previous, PLACE], place)
    there = net.nodes[other, END] + leg_ms(net, net.nodes[node, CARRIER], net.nodes[other, PLACE], place)
    return other if there >= ready else previous


@inlined
def some_target(net: Net) -> int:
    """Return a random target's node."""
    return len(net.robots) + draw(net, net.groups[TARGETS, 0])


@inlined
def late_target(net: Net) -> int:
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


@inlined
def near_target(net: Net, target: int) -> int:
    """Return the node of a target near that of another, mostly, or of any."""
    other = net.hints[net.nodes[target, PLACE], NEAR + draw(net, NEIGHBOURS)]
    if other < 0 or draw(net, 4) == 0:
        other = some_target(net)
    return other


@inlined
def _first_transfer(net: Net) -> int:
    """Return the number of the first node for transfers."""
    return len(net.robots) + net.groups[TARGETS, 0]


@inlined
def _in_use(net: Net, node: int) -> bool:
    """Say whether there is a node of that number that is in a chain."""
    return node < len(net.nodes) and net.nodes[node, KIND] != FREE and net.nodes[node, BEFORE] >= 0


@inlined
def some_node(net: Net) -> int:
    """Return a random node that is in use."""
    top = _first_transfer(net)
    transfers = len(net.nodes) - top - net.work[0, UNUSED]
    while True:
        node = draw(net, top + 2 * transfers)
        if _in_use(net, node):
            return node


@inlined
def some_transfer(net: Net, kind: int) -> int:
    """Return a random dock or undock (or any for `START`), -1 if none is found."""
    if draw(net, 2):
        node = critical_node(net)
        if node >= 0 and net.nodes[node, KIND] != EXPLORE:
            if kind in (START, net.nodes[node, KIND]):
                return node
            node = net.nodes[node, CARRIER_BEFORE]
            if kind == net.nodes[node, KIND]:
                return node
    top = _first_transfer(net)
    transfers = len(net.nodes) - top - net.work[0, UNUSED]
    if not transfers:
        return -1
    for _ in range(2 * TRIES):
        node = top + draw(net, 2 * transfers)
        if _in_use(net, node) and kind in (START, net.nodes[node, KIND]):
            return node
    return -1


@inlined
def offer(net: Net, carrier: int, node: int, place: int, guided: bool, rank: int) -> tuple[bool, int]:
    """Offer a node for a carrier to go to a place behind it; return whether it is chosen for now, and the new rank.

    Guided, the node of the least detour is chosen: the rank is that detour, `LONG` at first. Otherwise one at random:
    the rank is how many were offered.
    """
    if not guided:
        return draw(net, rank + 1) == 0, rank + 1
    longer = detour(net, carrier, node, place)
    return longer < rank, min(longer, rank)


@inlined
def detour(net: Net, carrier: int, node: int, place: int) -> int:
    """Return how much longer a carrier drives if it goes to a place behind a node."""
    here, following = net.nodes[node, PLACE], after(net, node, carrier)
    longer = leg_ms(net, carrier, here, place)
    if following != carrier:
        there = net.nodes[following, PLACE]
        longer += leg_ms(net, carrier, place, there) - leg_ms(net, carrier, here, there)
    return longer


@inlined
def turn(net: Net, transfer: int, carrier: int, first: int) -> int:
    """Return a node of a carrier's route, from `first` on, behind which a transfer fits that is in no route, or -1.

    That is judged by who is aboard there and by the times before the change: a rover is not set down after its sortie
    was to end, nor picked up before it could be there. It is a random one or that of the least detour.
    """
    last, docks = net.nodes[transfer, BEFORE], net.nodes[transfer, KIND] == DOCK
    earliest, latest = 0, LONG
    if docks:
        earliest = net.nodes[last, END]
        if first != carrier:
            earliest += net.nodes[net.nodes[first, CARRIER_BEFORE], END] - net.nodes[first, END]
    elif net.nodes[transfer, COUNTED]:
        latest = net.nodes[last, END]
    chosen, node, reached = -1, carrier, False
    load, places = first_load(net, carrier), net.robots[carrier, CAPACITY]
    guided = draw(net, 2) == 0
    rank = LONG if guided else 0
    while True:
        load += boarding(net, node)
        reached = reached or node == first
        behind = after(net, node, carrier)
        if reached and (load < places if docks else load > 0):
            if net.nodes[node, END] > latest:
                return chosen
            if behind == carrier or net.nodes[behind, END] >= earliest:
                better, rank = offer(net, carrier, node, net.nodes[transfer, PLACE], guided, rank)
                if better:
                    chosen = node
        if behind == carrier:
            return chosen
        node = behind


@inlined
def turn_except(net: Net, carrier: int, but: int, place: int) -> int:
    """Return a node of a carrier's route but one: a random one or that of the least detour."""
    chosen, node = carrier, carrier
    guided = draw(net, 2) == 0
    rank = LONG if guided else 0
    while True:
        if node != but:
            better, rank = offer(net, carrier, node, place, guided, rank)
            if better:
                chosen = node
        node = after(net, node, carrier)
        if node == carrier:
            return chosen


@inlined
def near_carrier(net: Net, target: int) -> int:
    """Return a random carrier, more often one that is busy near a target's node, and that is done early."""
    one, other = _near_carrier(net, target), _near_carrier(net, target)
    if draw(net, 4) and net.nodes[net.nodes[other, BEFORE], END] < net.nodes[net.nodes[one, BEFORE], END]:
        return other
    return one


@inlined
def other_carrier(net: Net, node: int) -> int:
    """Return a random carrier for what another one does, more often one that is busy near the target beside it."""
    target = net.nodes[node, BEFORE if net.nodes[node, KIND] == DOCK else AFTER]
    return near_carrier(net, target) if net.nodes[target, KIND] == EXPLORE else pick(net, CARRIERS)


@inlined
def _near_carrier(net: Net, target: int) -> int:
    if draw(net, 8):
        node = net.hints[net.nodes[target, PLACE], NEAR + draw(net, NEIGHBOURS)]
        if node >= 0 and net.nodes[node, BEFORE] >= 0:
            if carries(net, net.nodes[node, ROBOT]):
                return net.nodes[node, ROBOT]
            transfer = head_of(net, node)
            if draw(net, 2):
                transfer = net.nodes[transfer, BEFORE]
            if is_transfer(net, transfer):
                return net.nodes[transfer, CARRIER]
    return pick(net, CARRIERS)
