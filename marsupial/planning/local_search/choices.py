"""Random choices among the nodes of a net, compiled."""

from __future__ import annotations

from marsupial.native import inlined
from marsupial.planning.local_search import columns as col
from marsupial.planning.local_search import net as nets
from marsupial.planning.local_search.net import Net

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
    for _ in range(nets.draw(net, WATCHED)):
        other = _some_end(net)
        if net.nodes[other, col.KIND] != col.START and net.nodes[other, col.END] > net.nodes[node, col.END]:
            node = other
    chosen, seen = -1, 0
    while net.nodes[node, col.KIND] != col.START:
        seen += 1
        if nets.draw(net, seen) == 0:
            chosen = node
        node = waited_for(net, node)
    return chosen


@inlined
def _some_end(net: Net) -> int:
    """Return what a random carrier does last, or the last of a random sortie."""
    node = nets.draw(net, len(net.robots))
    if net.nodes[node, col.BEFORE] < 0:
        if not net.groups[col.TARGETS, 0]:
            return net.nodes[nets.pick(net, col.CARRIERS), col.BEFORE]
        node = some_target(net)
        if nets.carries(net, net.nodes[node, col.ROBOT]):
            return node
        node = nets.head_of(net, node)
    return net.nodes[node, col.BEFORE]


@inlined
def waited_for(net: Net, node: int) -> int:
    """Return which of the nodes before one it could not begin earlier for."""
    kind, previous = net.nodes[node, col.KIND], net.nodes[node, col.BEFORE]
    if kind == col.EXPLORE:
        return previous
    other = net.nodes[node, col.CARRIER_BEFORE]
    if kind == col.UNDOCK:
        return other
    place = net.nodes[node, col.PLACE]
    ready = net.nodes[previous, col.END] + nets.leg_ms(
        net, net.nodes[node, col.ROBOT], net.nodes[previous, col.PLACE], place
    )
    there = net.nodes[other, col.END] + nets.leg_ms(
        net, net.nodes[node, col.CARRIER], net.nodes[other, col.PLACE], place
    )
    return other if there >= ready else previous


@inlined
def some_target(net: Net) -> int:
    """Return a random target's node."""
    return len(net.robots) + nets.draw(net, net.groups[col.TARGETS, 0])


@inlined
def late_target(net: Net) -> int:
    """Return a random target's node, those reached late more often, or those on a critical path."""
    if nets.draw(net, 2):
        node = critical_node(net)
        if node >= 0 and net.nodes[node, col.KIND] == col.UNDOCK:
            node = net.nodes[node, col.AFTER]
        elif node >= 0 and net.nodes[node, col.KIND] == col.DOCK:
            node = net.nodes[node, col.BEFORE]
        if node >= 0 and net.nodes[node, col.KIND] == col.EXPLORE:
            return node
    one = some_target(net)
    for _ in range(nets.draw(net, FOCUS)):
        other = some_target(net)
        if net.nodes[other, col.END] > net.nodes[one, col.END]:
            one = other
    return one


@inlined
def near_target(net: Net, target: int) -> int:
    """Return the node of a target near that of another, mostly, or of any."""
    other = net.hints[net.nodes[target, col.PLACE], col.NEAR + nets.draw(net, col.NEIGHBOURS)]
    if other < 0 or nets.draw(net, 4) == 0:
        other = some_target(net)
    return other


@inlined
def _first_transfer(net: Net) -> int:
    return len(net.robots) + net.groups[col.TARGETS, 0]


@inlined
def _in_use(net: Net, node: int) -> bool:
    return node < len(net.nodes) and net.nodes[node, col.KIND] != col.FREE and net.nodes[node, col.BEFORE] >= 0


@inlined
def some_node(net: Net) -> int:
    """Return a random node that is in use."""
    top = _first_transfer(net)
    transfers = len(net.nodes) - top - net.work[0, col.UNUSED]
    while True:
        node = nets.draw(net, top + 2 * transfers)
        if _in_use(net, node):
            return node


@inlined
def some_transfer(net: Net, kind: int) -> int:
    """Return a random dock or undock (or any for `START`), -1 if none is found."""
    if nets.draw(net, 2):
        node = critical_node(net)
        if node >= 0 and net.nodes[node, col.KIND] != col.EXPLORE:
            if kind in (col.START, net.nodes[node, col.KIND]):
                return node
            node = net.nodes[node, col.CARRIER_BEFORE]
            if kind == net.nodes[node, col.KIND]:
                return node
    top = _first_transfer(net)
    transfers = len(net.nodes) - top - net.work[0, col.UNUSED]
    if not transfers:
        return -1
    for _ in range(2 * TRIES):
        node = top + nets.draw(net, 2 * transfers)
        if _in_use(net, node) and kind in (col.START, net.nodes[node, col.KIND]):
            return node
    return -1


@inlined
def offer(net: Net, carrier: int, node: int, place: int, guided: bool, rank: int) -> tuple[bool, int]:
    """Offer a node for a carrier to go to a place behind it; return whether it is chosen for now, and the new rank.

    Guided, the node of the least detour is chosen: the rank is that detour, `LONG` at first. Otherwise one at random:
    the rank is how many were offered.
    """
    if not guided:
        return nets.draw(net, rank + 1) == 0, rank + 1
    longer = detour(net, carrier, node, place)
    return longer < rank, min(longer, rank)


@inlined
def detour(net: Net, carrier: int, node: int, place: int) -> int:
    """Return how much longer a carrier drives if it goes to a place behind a node."""
    here, following = net.nodes[node, col.PLACE], nets.after(net, node, carrier)
    longer = nets.leg_ms(net, carrier, here, place)
    if following != carrier:
        there = net.nodes[following, col.PLACE]
        longer += nets.leg_ms(net, carrier, place, there) - nets.leg_ms(net, carrier, here, there)
    return longer


@inlined
def turn(net: Net, transfer: int, carrier: int, first: int) -> int:
    """Return a node of a carrier's route, from `first` on, behind which a transfer fits that is in no route, or -1.

    That is judged by who is aboard there and by the times before the change: a rover is not set down after its sortie
    was to end, nor picked up before it could be there. It is a random one or that of the least detour.
    """
    last, docks = net.nodes[transfer, col.BEFORE], net.nodes[transfer, col.KIND] == col.DOCK
    earliest, latest = 0, LONG
    if docks:
        earliest = net.nodes[last, col.END]
        if first != carrier:
            earliest += net.nodes[net.nodes[first, col.CARRIER_BEFORE], col.END] - net.nodes[first, col.END]
    elif net.nodes[transfer, col.COUNTED]:
        latest = net.nodes[last, col.END]
    chosen, node, reached = -1, carrier, False
    load, places = nets.first_load(net, carrier), net.robots[carrier, col.CAPACITY]
    guided = nets.draw(net, 2) == 0
    rank = LONG if guided else 0
    while True:
        load += nets.boarding(net, node)
        reached = reached or node == first
        behind = nets.after(net, node, carrier)
        if reached and (load < places if docks else load > 0):
            if net.nodes[node, col.END] > latest:
                return chosen
            if behind == carrier or net.nodes[behind, col.END] >= earliest:
                better, rank = offer(net, carrier, node, net.nodes[transfer, col.PLACE], guided, rank)
                if better:
                    chosen = node
        if behind == carrier:
            return chosen
        node = behind


@inlined
def turn_except(net: Net, carrier: int, but: int, place: int) -> int:
    """Return a node of a carrier's route but one: a random one or that of the least detour."""
    chosen, node = carrier, carrier
    guided = nets.draw(net, 2) == 0
    rank = LONG if guided else 0
    while True:
        if node != but:
            better, rank = offer(net, carrier, node, place, guided, rank)
            if better:
                chosen = node
        node = nets.after(net, node, carrier)
        if node == carrier:
            return chosen


@inlined
def near_carrier(net: Net, target: int) -> int:
    """Return a random carrier, more often one that is busy near a target's node, and that is done early."""
    one, other = _near_carrier(net, target), _near_carrier(net, target)
    if (
        nets.draw(net, 4)
        and net.nodes[net.nodes[other, col.BEFORE], col.END] < net.nodes[net.nodes[one, col.BEFORE], col.END]
    ):
        return other
    return one


@inlined
def other_carrier(net: Net, node: int) -> int:
    """Return a random carrier for what another one does, more often one that is busy near the target beside it."""
    target = net.nodes[node, col.BEFORE if net.nodes[node, col.KIND] == col.DOCK else col.AFTER]
    return near_carrier(net, target) if net.nodes[target, col.KIND] == col.EXPLORE else nets.pick(net, col.CARRIERS)


@inlined
def _near_carrier(net: Net, target: int) -> int:
    if nets.draw(net, 8):
        node = net.hints[net.nodes[target, col.PLACE], col.NEAR + nets.draw(net, col.NEIGHBOURS)]
        if node >= 0 and net.nodes[node, col.BEFORE] >= 0:
            if nets.carries(net, net.nodes[node, col.ROBOT]):
                return net.nodes[node, col.ROBOT]
            transfer = nets.head_of(net, node)
            if nets.draw(net, 2):
                transfer = net.nodes[transfer, col.BEFORE]
            if nets.is_transfer(net, transfer):
                return net.nodes[transfer, col.CARRIER]
    return nets.pick(net, col.CARRIERS)
