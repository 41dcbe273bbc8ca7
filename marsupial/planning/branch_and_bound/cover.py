"""Sharing a set of targets among robots so that each is done in time, by backtracking.

The hardest targets, those that the fewest robots can take, come first, so that dead ends show early.
"""

from marsupial.arrays import Ints
from marsupial.native import inlined
from marsupial.planning.branch_and_bound import columns as col

YES, NO, UNKNOWN = 1, 0, -1


@inlined
def fits(solo_times: Ints, assignment: Ints, share: int, limit: int) -> bool:
    """Return whether a robot is done with the set `share` before `limit`; doing nothing always fits."""
    time = solo_times[assignment[col.ROW], share]
    return time == 0 or assignment[col.READY] + time < limit


@inlined
def cover(solo_times: Ints, assignments: Ints, scratch: Ints, targets: int, limit: int, tries: int) -> int:
    """Try to share a set of targets among robots (in `assignments`) such that each is done before `limit`.

    `scratch` is (4, n), n at least the number of targets. The answer is `UNKNOWN` after so many `tries`.
    """
    robots = len(assignments)
    for r in range(robots):
        assignments[r, col.SHARE] = 0
        if not fits(solo_times, assignments[r], 0, limit):
            return NO
    # Iterative backtracking, as compiled functions here make no arrays: `scratch[2]` holds the robot tried per target.
    size = _hardest_first(solo_times, assignments, scratch, targets, limit)
    if size < 0:
        return NO
    level = 0
    scratch[2, 0] = -1
    while 0 <= level < size:
        bit = 1 << scratch[0, level]
        r = scratch[2, level]
        if r >= 0:
            assignments[r, col.SHARE] ^= bit
        r += 1
        while r < robots:
            if (
                assignments[r, col.ALLOWED] & bit
                and fits(solo_times, assignments[r], assignments[r, col.SHARE] | bit, limit)
                and not _has_twin_before(assignments, r)
            ):
                break
            r += 1
        if r == robots:
            level -= 1
            continue
        tries -= 1
        if tries < 0:
            return UNKNOWN
        assignments[r, col.SHARE] |= bit
        scratch[2, level] = r
        level += 1
        if level < size:
            scratch[2, level] = -1
    return YES if level == size else NO


@inlined
def _hardest_first(solo_times: Ints, assignments: Ints, scratch: Ints, targets: int, limit: int) -> int:
    """List the targets, those that the fewest robots can take first; return their number, -1 if one fits none."""
    size = 0
    for j in range(scratch.shape[1]):
        if not targets >> j & 1:
            continue
        takers = 0
        for r in range(len(assignments)):
            if assignments[r, col.ALLOWED] >> j & 1 and fits(solo_times, assignments[r], 1 << j, limit):
                takers += 1
        if not takers:
            return -1
        at = size
        while at > 0 and scratch[1, at - 1] > takers:
            scratch[0, at], scratch[1, at] = scratch[0, at - 1], scratch[1, at - 1]
            at -= 1
        scratch[0, at], scratch[1, at] = j, takers
        size += 1
    return size


@inlined
def _has_twin_before(assignments: Ints, r: int) -> bool:
    # Robots that are equal so far: assigning the target to the second is redundant.
    for q in range(r):
        same = True
        for column in range(assignments.shape[1]):
            same = same and assignments[q, column] == assignments[r, column]
        if same:
            return True
    return False
