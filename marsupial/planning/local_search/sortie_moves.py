"""Changes of whole sorties: what a robot explores between two transfers. Compiled."""

from __future__ import annotations

from marsupial.native import inlined
from marsupial.planning.local_search import columns as col
from marsupial.planning.local_search.choices import late_target, near_target
from marsupial.planning.local_search.net import Net, door
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
    robot_one, robot_other = net.nodes[one, col.ROBOT], net.nodes[other, col.ROBOT]
    at_one, at_other = net.nodes[one, col.BEFORE], net.nodes[other, col.BEFORE]
    count_one = take_targets(net, one, LONGEST_SEGMENT, 0)
    count_other = take_targets(net, other, LONGEST_SEGMENT, LONGEST_SEGMENT)
    return _put_sortie(net, robot_one, at_one, count_other, LONGEST_SEGMENT) and _put_sortie(
        net, robot_other, at_other, count_one, 0
    )


@inlined
def _put_sortie(net: Net, robot: int, at: int, count: int, top: int) -> bool:
    """Put what was taken behind a node, with the transfers around it moved near; False if one can't be."""
    last = put_targets(net, robot, at, count, top, True)
    if net.nodes[at, col.KIND] == col.UNDOCK and net.nodes[at, col.ROBOT] == robot:
        place = door(net, col.ENTRIES, robot, net.nodes[net.work[col.TAKEN, top], col.PLACE])
        if place < 0:
            return False
        move_to(net, at, place)
    following = net.nodes[last, col.AFTER]
    if net.nodes[following, col.KIND] == col.DOCK and net.nodes[following, col.ROBOT] == robot:
        place = door(net, col.EXITS, robot, net.nodes[last, col.PLACE])
        if place < 0:
            return False
        move_to(net, following, place)
    return True
