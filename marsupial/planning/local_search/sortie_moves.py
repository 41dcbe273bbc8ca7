"""Moves of whole sorties: what a robot explores between two transfers. Compiled."""

from __future__ import annotations

from marsupial.native import inlined
from marsupial.planning.local_search import columns as col
from marsupial.planning.local_search.choices import late_target, near_target
from marsupial.planning.local_search.linked_schedule import LinkedSchedule, near_meeting
from marsupial.planning.local_search.target_moves import LONGEST_SEGMENT, first_target, put_targets, take_targets
from marsupial.planning.local_search.transfer_moves import move_to


@inlined
def swap_sorties(sched: LinkedSchedule) -> bool:
    """Exchange the targets of two sorties; their transfers keep their positions and move to meetings nearby."""
    one = late_target(sched)
    other = first_target(sched, near_target(sched, one))
    one = first_target(sched, one)
    if one == other:
        return False
    robot_one, robot_other = sched.nodes[one, col.ROBOT], sched.nodes[other, col.ROBOT]
    at_one, at_other = sched.nodes[one, col.BEFORE], sched.nodes[other, col.BEFORE]
    count_one = take_targets(sched, one, LONGEST_SEGMENT, 0)
    count_other = take_targets(sched, other, LONGEST_SEGMENT, LONGEST_SEGMENT)
    return _put_sortie(sched, robot_one, at_one, count_other, LONGEST_SEGMENT) and _put_sortie(
        sched, robot_other, at_other, count_one, 0
    )


@inlined
def _put_sortie(sched: LinkedSchedule, robot: int, at: int, count: int, top: int) -> bool:
    """Insert the targets taken behind a node and move the transfers around them; return whether there are meetings."""
    last = put_targets(sched, robot, at, count, top, True)
    if sched.nodes[at, col.KIND] == col.UNDOCK and sched.nodes[at, col.ROBOT] == robot:
        place = near_meeting(sched, col.ENTRIES, robot, sched.nodes[sched.work[col.TAKEN, top], col.PLACE])
        if place < 0:
            return False
        move_to(sched, at, place)
    following = sched.nodes[last, col.AFTER]
    if sched.nodes[following, col.KIND] == col.DOCK and sched.nodes[following, col.ROBOT] == robot:
        place = near_meeting(sched, col.EXITS, robot, sched.nodes[last, col.PLACE])
        if place < 0:
            return False
        move_to(sched, following, place)
    return True
