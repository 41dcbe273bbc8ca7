"""Changes of whole sorties: what a robot explores between two transfers. Compiled."""

from __future__ import annotations

from marsupial.native import inlined
from marsupial.planning.local_search.choices import late_target, near_target
from marsupial.planning.local_search.encoding import DOCK, ENTRIES, EXITS, UNDOCK
from marsupial.planning.local_search.net import AFTER, BEFORE, KIND, PLACE, ROBOT, TAKEN, Net, door
from marsupial.planning.local_search.target_moves import LONGEST_SEGMENT, first_target, put_targets, take_targets
from marsupial.planning.local_search.transfer_moves import move_to


@inlined
def swap_sorties(net: Net) -> bool:
    """Let two robots explore each other's sortie, at the turn of their own; what brings them there goes elsewhere."""
    one = late_target(net)
    other = first_target(net, near_target(net, one))
    one = first_target(net, one)
    if one == other:
        return False
    robot_one, robot_other = net.nodes[one, ROBOT], net.nodes[other, ROBOT]
    at_one, at_other = net.nodes[one, BEFORE], net.nodes[other, BEFORE]
    count_one = take_targets(net, one, LONGEST_SEGMENT, 0)
    count_other = take_targets(net, other, LONGEST_SEGMENT, LONGEST_SEGMENT)
    return _put_sortie(net, robot_one, at_one, count_other, LONGEST_SEGMENT) and _put_sortie(
        net, robot_other, at_other, count_one, 0
    )


@inlined
def _put_sortie(net: Net, robot: int, at: int, count: int, top: int) -> bool:
    """Put what was taken behind a node, with the transfers around it moved near; False if one can't be."""
    last = put_targets(net, robot, at, count, top, True)
    if net.nodes[at, KIND] == UNDOCK and net.nodes[at, ROBOT] == robot:
        place = door(net, ENTRIES, robot, net.nodes[net.work[TAKEN, top], PLACE])
        if place < 0:
            return False
        move_to(net, at, place)
    following = net.nodes[last, AFTER]
    if net.nodes[following, KIND] == DOCK and net.nodes[following, ROBOT] == robot:
        place = door(net, EXITS, robot, net.nodes[last, PLACE])
        if place < 0:
            return False
        move_to(net, following, place)
    return True
