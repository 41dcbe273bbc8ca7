"""Random changes of whole outings: what a robot explores between two rides, compiled."""

from __future__ import annotations

from typing import Any

from marsupial.planning.local_search.choices import late_target, some_target
from marsupial.planning.local_search.encoding import (
    DOCK,
    ENTRIES,
    EXITS,
    EXPLORE,
    NEIGHBOURS,
    TARGETS,
    UNDOCK,
)
from marsupial.planning.local_search.net import (
    AFTER,
    BEFORE,
    KIND,
    LONGEST_SEGMENT,
    NEAR,
    PLACE,
    ROBOT,
    TAKEN,
    Net,
    compiled,
    door,
    draw,
    insert,
    take_out,
)
from marsupial.planning.local_search.transport_moves import meet_at


@compiled
def interchange(net: Net) -> bool:
    """Let two robots explore each other's outing, at the turn of their own; what brings them there goes elsewhere."""
    if not net.groups[TARGETS, 0]:
        return False
    one = late_target(net)
    other = net.hints[net.nodes[one, PLACE], NEAR + draw(net, NEIGHBOURS)]
    if other < 0 or draw(net, 4) == 0:
        other = some_target(net)
    one, other = _first_of(net, one), _first_of(net, other)
    if one == other:
        return False
    robot_one, robot_other = net.nodes[one, ROBOT], net.nodes[other, ROBOT]
    at_one, at_other = net.nodes[one, BEFORE], net.nodes[other, BEFORE]
    count_one = _take_outing(net, one, 0)
    count_other = _take_outing(net, other, LONGEST_SEGMENT)
    return _put_outing(net, robot_one, at_one, LONGEST_SEGMENT, count_other) and _put_outing(
        net, robot_other, at_other, 0, count_one
    )


@compiled
def _first_of(net: Net, target: int) -> Any:
    previous = net.nodes[target, BEFORE]
    while net.nodes[previous, KIND] == EXPLORE:
        target = previous
        previous = net.nodes[target, BEFORE]
    return target


@compiled
def _take_outing(net: Net, first: int, top: int) -> Any:
    node, count = first, 0
    while net.nodes[node, KIND] == EXPLORE and count < LONGEST_SEGMENT:
        following = net.nodes[node, AFTER]
        take_out(net, node)
        net.work[TAKEN, top + count] = node
        count += 1
        node = following
    return count


@compiled
def _put_outing(net: Net, robot: int, at: int, top: int, count: int) -> bool:
    previous = at
    for i in range(count):
        node = net.work[TAKEN, top + i]
        insert(net, node, robot, previous)
        previous = node
    if net.nodes[at, KIND] == UNDOCK and net.nodes[at, ROBOT] == robot:
        place = door(net, ENTRIES, robot, net.nodes[net.work[TAKEN, top], PLACE])
        if place < 0:
            return False
        meet_at(net, at, place)
    following = net.nodes[previous, AFTER]
    if net.nodes[following, KIND] == DOCK and net.nodes[following, ROBOT] == robot:
        place = door(net, EXITS, robot, net.nodes[previous, PLACE])
        if place < 0:
            return False
        meet_at(net, following, place)
    return True
