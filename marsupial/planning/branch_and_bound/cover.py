"""Whether a set of targets can be shared among robots so that each of them is done in time."""

from __future__ import annotations

from marsupial.arrays import Ints
from marsupial.native import inlined
from marsupial.planning.branch_and_bound import columns as col

YES, NO, UNKNOWN = 1, 0, -1


@inlined
def fits(book: Ints, part: Ints, share: int, limit: int) -> bool:
    """Say whether a robot with such a part is done with the set `share` before `limit`; doing nothing always fits."""
    time = book[part[col.ROW], share]
    return time == 0 or part[col.FROM] + time < limit


@inlined
def cover(book: Ints, parts: Ints, scratch: Ints, targets: int, limit: int, tries: int) -> int:
    """Try to give each target of a set to a robot such that each is done before `limit`.

    Parameters
    ----------
    parts
        (robots, 4): `ROW` and so on; the shares are entered.
    scratch
        (4, n), n at least the number of targets.
    tries
        How often a target is given to a robot before the answer is `UNKNOWN`.
    """
    robots = len(parts)
    for r in range(robots):
        parts[r, col.SHARE] = 0
        if not fits(book, parts[r], 0, limit):
            return NO
    size = _hardest_first(book, parts, scratch, targets, limit)
    if size < 0:
        return NO
    level = 0
    scratch[2, 0] = -1
    while 0 <= level < size:
        bit = 1 << scratch[0, level]
        r = scratch[2, level]
        if r >= 0:
            parts[r, col.SHARE] ^= bit
        r += 1
        while r < robots:
            if (
                parts[r, col.MAY] & bit
                and fits(book, parts[r], parts[r, col.SHARE] | bit, limit)
                and not _tried(parts, r)
            ):
                break
            r += 1
        if r == robots:
            level -= 1
            continue
        tries -= 1
        if tries < 0:
            return UNKNOWN
        parts[r, col.SHARE] |= bit
        scratch[2, level] = r
        level += 1
        if level < size:
            scratch[2, level] = -1
    return YES if level == size else NO


@inlined
def _hardest_first(book: Ints, parts: Ints, scratch: Ints, targets: int, limit: int) -> int:
    """List the targets, those that few robots can take first; return how many there are, -1 if none can take one."""
    size = 0
    for j in range(scratch.shape[1]):
        if not targets >> j & 1:
            continue
        takers = 0
        for r in range(len(parts)):
            if parts[r, col.MAY] >> j & 1 and fits(book, parts[r], 1 << j, limit):
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
def _tried(parts: Ints, r: int) -> bool:
    for q in range(r):
        same = parts[q, col.ROW] == parts[r, col.ROW] and parts[q, col.FROM] == parts[r, col.FROM]
        if same and parts[q, col.SHARE] == parts[r, col.SHARE] and parts[q, col.MAY] == parts[r, col.MAY]:
            return True
    return False
