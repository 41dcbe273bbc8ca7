"""Random changes of rides, compiled. Each says whether it made one; most of them can't be carried out."""

from __future__ import annotations

from typing import Any

from marsupial.planning.local_search.choices import (
    TRIES,
    between,
    critical_node,
    near_carrier,
    some_node,
    some_ride,
    turn,
)
from marsupial.planning.local_search.encoding import (
    CAPACITY,
    CARRIERS,
    DOCK,
    ENTRIES,
    EXITS,
    EXPLORE,
    MEETINGS,
    NEIGHBOURS,
    START,
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
    Net,
    after,
    ask,
    compiled,
    door,
    draw,
    head_of,
    host,
    insert,
    link,
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
        place = door(net, EXITS, rover, net.nodes[net.nodes[ride, BEFORE], PLACE])
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
            return _host_again(net, node, net.nodes[node, CARRIER])
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
def _host_again(net: Net, ride: int, carrier: int) -> bool:
    """Have a carrier give a ride at some other turn."""
    was = net.nodes[ride, CARRIER_BEFORE]
    unhost(net, ride)
    at = turn(net, ride, carrier, carrier)
    if at < 0 or at == was:
        return False
    host(net, ride, carrier, at)
    return True


@compiled
def rehost(net: Net) -> bool:
    """Have another carrier give a ride, and mostly one of the other kind with it, so that as many are aboard after."""
    ride = some_ride(net, START)
    if ride < 0:
        return False
    target = net.nodes[ride, BEFORE if net.nodes[ride, KIND] == DOCK else AFTER]
    carrier = near_carrier(net, target) if net.nodes[target, KIND] == EXPLORE else pick(net, CARRIERS)
    if carrier == net.nodes[ride, CARRIER]:
        return False
    partner = _partner(net, ride)
    if partner < 0:
        return _host_again(net, ride, carrier)
    down, up = (partner, ride) if net.nodes[ride, KIND] == DOCK else (ride, partner)
    unhost(net, down)
    unhost(net, up)
    at = turn(net, down, carrier, carrier)
    if at < 0:
        return False
    host(net, down, carrier, at)
    at = turn(net, up, carrier, down if head_of(net, up) == down else carrier)
    if at < 0:
        return False
    host(net, up, carrier, at)
    return True


@compiled
def _partner(net: Net, ride: int) -> Any:
    """Return a ride of the other kind by the same carrier: of the same outing, or the next, or, now and then, -1."""
    kind, carrier, choice = net.nodes[ride, KIND], net.nodes[ride, CARRIER], draw(net, 8)
    if choice == 0 or (choice < 4 and not net.recover):
        return -1
    if choice < 6:
        other = net.nodes[ride, BEFORE] if kind == UNDOCK else head_of(net, ride)
        if net.nodes[other, KIND] == UNDOCK + DOCK - kind and net.nodes[other, CARRIER] == carrier:
            return other
    node = after(net, ride, carrier)
    while node != carrier and net.nodes[node, KIND] != UNDOCK + DOCK - kind:
        node = after(net, node, carrier)
    return node if node != carrier else -1


@compiled
def swap_tails(net: Net, at_one: int, at_other: int) -> bool:
    """Let two outings change what is behind a node of each; False if there is no use in that or it can't be."""
    rover, head_one, head_other = net.nodes[at_one, ROBOT], head_of(net, at_one), head_of(net, at_other)
    if rover != net.nodes[at_other, ROBOT] or head_one == head_other:
        return False
    first_one, first_other = net.nodes[at_one, AFTER], net.nodes[at_other, AFTER]
    last_one, last_other = net.nodes[head_one, BEFORE], net.nodes[head_other, BEFORE]
    if first_one == head_one and first_other == head_other:
        return False
    if first_other == head_other:
        link(net, at_one, head_one, rover)
    else:
        link(net, at_one, first_other, rover)
        link(net, last_other, head_one, rover)
    if first_one == head_one:
        link(net, at_other, head_other, rover)
    else:
        link(net, at_other, first_one, rover)
        link(net, last_one, head_other, rover)
    return True


@compiled
def exchange(net: Net) -> bool:
    """Let two outings change what comes after some moment."""
    at_one, other = some_node(net), some_node(net)
    if net.robots[net.nodes[at_one, ROBOT], CAPACITY] >= 0 or net.robots[net.nodes[other, ROBOT], CAPACITY] >= 0:
        return False
    if net.nodes[at_one, KIND] == DOCK:
        return False
    at_other = head_of(net, other)
    node, head = net.nodes[at_other, AFTER], at_other
    while node != head and net.nodes[node, KIND] == EXPLORE and net.nodes[node, END] <= net.nodes[at_one, END]:
        at_other = node
        node = net.nodes[node, AFTER]
    if not swap_tails(net, at_one, at_other):
        return False
    tidy(net, at_one)
    tidy(net, at_other)
    return True


@compiled
def _near_ride(net: Net, ride: int) -> Any:
    """Return another ride of the same kind, mostly that of a target near, or -1."""
    kind = net.nodes[ride, KIND]
    target = net.nodes[ride, BEFORE if kind == DOCK else AFTER]
    node = net.hints[net.nodes[target, PLACE], NEAR + draw(net, NEIGHBOURS)]
    if draw(net, 4) and node >= 0 and net.robots[net.nodes[node, ROBOT], CAPACITY] < 0:
        node = head_of(net, node)
        if kind == DOCK:
            node = net.nodes[node, BEFORE]
        if net.nodes[node, KIND] == kind:
            return node
    return some_ride(net, kind)


@compiled
def trade(net: Net) -> bool:
    """Let two rides change turns."""
    one = some_ride(net, START)
    if one < 0:
        return False
    other = _near_ride(net, one)
    if other < 0 or one == other:
        return False
    if net.nodes[one, CARRIER_BEFORE] == other:
        one, other = other, one
    carrier, carrier_other = net.nodes[one, CARRIER], net.nodes[other, CARRIER]
    at, at_other = net.nodes[one, CARRIER_BEFORE], net.nodes[other, CARRIER_BEFORE]
    unhost(net, one)
    unhost(net, other)
    host(net, other, carrier, at)
    host(net, one, carrier_other, other if at_other == one else at_other)
    return True


@compiled
def tidy(net: Net, head: int) -> bool:
    """Take out the rides of an outing on which nothing is explored, if they are of no use; say whether they were."""
    last = net.nodes[head, AFTER]
    if net.nodes[head, KIND] != UNDOCK or net.nodes[head, BEFORE] != last or (net.recover and last == head):
        return False
    if last != head:
        if net.nodes[last, KIND] != DOCK or (net.nodes[last, CARRIER] != net.nodes[head, CARRIER] and draw(net, 2)):
            return False
        take_out(net, last)
    take_out(net, head)
    return True


@compiled
def rideless(net: Net) -> bool:
    """Leave a rover where it was picked up, or let it drive on to an outing that another would begin.

    Or leave out an outing on which nothing is explored.
    """
    up = some_ride(net, START)
    if up < 0:
        return False
    if net.nodes[up, KIND] == UNDOCK:
        return tidy(net, up)
    rover, last = net.nodes[up, ROBOT], net.nodes[up, BEFORE]
    take_out(net, up)
    if not net.recover and draw(net, 2):
        return True
    down = some_ride(net, UNDOCK)
    if down < 0 or net.nodes[down, ROBOT] != rover or head_of(net, last) == down or net.nodes[down, AFTER] == down:
        return False
    head, first, end = head_of(net, last), net.nodes[down, AFTER], net.nodes[down, BEFORE]
    link(net, last, first, rover)
    link(net, end, head, rover)
    link(net, down, down, rover)
    take_out(net, down)
    return True
