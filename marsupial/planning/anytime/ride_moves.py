"""Random changes of rides, compiled. Each says whether it made one; most of them can't be carried out."""

from __future__ import annotations

from marsupial.planning.anytime.choices import TRIES, between, critical_node, slot, some_node, some_ride
from marsupial.planning.anytime.encoding import (
    CAPACITY,
    CARRIERS,
    DOCK,
    ENTRIES,
    EXITS,
    EXPLORE,
    MEETINGS,
    ROVERS,
    START,
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
    PLACE,
    ROBOT,
    Net,
    aboard,
    ask,
    compiled,
    door,
    draw,
    host,
    insert,
    pick,
    take_out,
    touch,
    unhost,
)


@compiled
def meet_at(net: Net, ride: int, place: int) -> None:
    """Let a ride begin or end elsewhere."""
    touch(net, ride)
    net.nodes[ride, PLACE] = place
    ask(net, ride)
    ask(net, net.nodes[ride, AFTER])
    ask(net, net.nodes[ride, CARRIER_AFTER])


@compiled
def remeet(net: Net) -> bool:
    """Set down or pick up a rover at another meeting."""
    ride = some_ride(net, START)
    if ride < 0:
        return False
    rover, place = net.nodes[ride, ROBOT], net.nodes[ride, PLACE]
    following = net.nodes[ride, AFTER]
    if net.nodes[ride, KIND] == UNDOCK and net.nodes[following, KIND] == EXPLORE:
        place = door(net, ENTRIES, rover, net.nodes[following, PLACE])
    elif draw(net, 4):
        place = door(net, EXITS, rover, place)
    else:
        place = pick(net, MEETINGS)
    if place < 0 or place == net.nodes[ride, PLACE]:
        return False
    meet_at(net, ride, place)
    return True


@compiled
def reorder(net: Net) -> bool:
    """Do something a carrier has to do at another turn: a ride, or a target of its own."""
    for attempt in range(2 * TRIES):
        node = critical_node(net) if attempt < TRIES and draw(net, 2) else -1
        if node < 0:
            node = some_node(net)
        if net.nodes[node, KIND] == DOCK or net.nodes[node, KIND] == UNDOCK:
            carrier = net.nodes[node, CARRIER]
            was = net.nodes[node, CARRIER_BEFORE]
            unhost(net, node)
            at = slot(net, carrier, net.nodes[node, BEFORE], net.nodes[node, AFTER], net.nodes[node, PLACE])
            if at < 0 or at == was:
                return False
            host(net, node, carrier, at)
            return True
        robot = net.nodes[node, ROBOT]
        if net.nodes[node, KIND] == EXPLORE and net.robots[robot, CAPACITY] >= 0:
            was = net.nodes[node, BEFORE]
            take_out(net, node)
            at = between(net, robot, robot, robot, net.nodes[node, PLACE])
            if at == was:
                return False
            insert(net, node, robot, at)
            return True
    return False


@compiled
def rehost(net: Net) -> bool:
    """Have another carrier pick up a rover, and set it down again."""
    ride = some_ride(net, DOCK)
    if ride < 0:
        return False
    carrier = pick(net, CARRIERS)
    if carrier == net.nodes[ride, CARRIER]:
        return False
    unhost(net, ride)
    where = slot(net, carrier, net.nodes[ride, BEFORE], net.nodes[ride, AFTER], net.nodes[ride, PLACE])
    if where < 0:
        return False
    host(net, ride, carrier, where)
    following = net.nodes[ride, AFTER]
    if net.nodes[following, KIND] == UNDOCK:
        unhost(net, following)
        at = between(net, carrier, ride, net.nodes[following, AFTER], net.nodes[following, PLACE])
        host(net, following, carrier, at)
    return True


@compiled
def _give_tail(net: Net, first: int, old: int, new: int) -> None:
    """Make the events of a rover's chain from `first` on another rover's."""
    node = first
    while node != old:
        touch(net, node)
        net.nodes[node, ROBOT] = new
        ask(net, node)
        node = net.nodes[node, AFTER]


@compiled
def swap_tails(net: Net, one: int, at_one: int, other: int, at_other: int) -> None:
    """Let two rovers change what they do behind a node of each."""
    first_one, first_other = net.nodes[at_one, AFTER], net.nodes[at_other, AFTER]
    last_one, last_other = net.nodes[one, BEFORE], net.nodes[other, BEFORE]
    _give_tail(net, first_one, one, other)
    _give_tail(net, first_other, other, one)
    for node in (at_one, at_other, one, other, last_one, last_other):
        touch(net, node)
    net.nodes[at_one, AFTER] = first_other if first_other != other else one
    net.nodes[at_other, AFTER] = first_one if first_one != one else other
    net.nodes[net.nodes[at_one, AFTER], BEFORE] = at_one
    net.nodes[net.nodes[at_other, AFTER], BEFORE] = at_other
    if first_other != other:
        net.nodes[one, BEFORE] = last_other
        net.nodes[last_other, AFTER] = one
    if first_one != one:
        net.nodes[other, BEFORE] = last_one
        net.nodes[last_one, AFTER] = other
    ask(net, net.nodes[at_one, AFTER])
    ask(net, net.nodes[at_other, AFTER])
    ask(net, one)
    ask(net, other)


@compiled
def exchange(net: Net) -> bool:
    """Let two rovers change parts from some moment on at which both are on the ground, or aboard the same carrier."""
    if net.groups[ROVERS, 0] < 2:
        return False
    one = pick(net, ROVERS)
    other = pick(net, ROVERS)
    if one == other:
        return False
    seen, at_one, node = 0, -1, one
    while True:
        seen += 1
        if draw(net, seen) == 0:
            at_one = node
        node = net.nodes[node, AFTER]
        if node == one:
            break
    at_other, node = other, net.nodes[other, AFTER]
    while node != other and net.nodes[node, END] <= net.nodes[at_one, END]:
        at_other = node
        node = net.nodes[node, AFTER]
    if aboard(net, at_one, one) != aboard(net, at_other, other):
        return False
    if net.nodes[at_one, AFTER] == one and net.nodes[at_other, AFTER] == other:
        return False
    swap_tails(net, one, at_one, other, at_other)
    return True


@compiled
def trade(net: Net) -> bool:
    """Let two rovers change parts from where they are set down on, each by the carrier that it is aboard."""
    down_one = some_ride(net, UNDOCK)
    down_other = some_ride(net, UNDOCK)
    if down_one < 0 or down_other < 0:
        return False
    one, other = net.nodes[down_one, ROBOT], net.nodes[down_other, ROBOT]
    if one == other:
        return False
    place_one, place_other = net.nodes[down_one, PLACE], net.nodes[down_other, PLACE]
    swap_tails(net, one, down_one, other, down_other)
    meet_at(net, down_one, place_other)
    meet_at(net, down_other, place_one)
    return True


@compiled
def rideless(net: Net) -> bool:
    """Let a rover drive where it was carried."""
    ride = some_ride(net, DOCK)
    if ride < 0:
        return False
    following = net.nodes[ride, AFTER]
    if net.nodes[following, KIND] == UNDOCK:
        take_out(net, following)
    take_out(net, ride)
    return True
