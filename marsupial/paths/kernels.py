"""The compiled inner loops of the flood search.

Grids are flat and framed by closed cells, so no loop tests for the edge of the map: cell (x, y) has index
``(y + 1) * (width + 2) + x + 1``. The queue has three buckets of width 1. A step costs between 1 and sqrt 2, so the
neighbours of a cell in the lowest bucket belong to the next two:

    level           level + 1       level + 2
    here: settled   near: cost < level + 2      far: the rest

All cells of the lowest bucket are final, a cell enters at most two buckets, and no buffer has to grow. After a level
the three parts of the queue change roles.

For numba's sake indices are unsigned, arrays are never rebound in a loop, and the innermost loop calls no function that
returns counters: each of these would multiply the running time.
"""

from typing import NamedTuple

import numpy as np

from marsupial.arrays import Bytes, Cells, Floats, Words
from marsupial.native import inlined, native

TOLERANCE = 1e-9  # lengths that differ by less count as equal: sums of the same steps in another order

ZERO = np.uint64(0)
ONE = np.uint64(1)
SOURCE = 8  # arrival direction of a source; other cells hold the direction (0 to 7) of the last step


class Buffers(NamedTuple):
    """The arrays of a search, all flat and framed except `offsets`."""

    # passable, cost: 1 for passable cells; length of the way to each cell, inf for cells not touched by the last search
    passable: Bytes
    cost: Floats
    arrival: Bytes  # per cell, the direction of the last step to it
    offsets: Words  # (24,): from a cell to its neighbours, counter-clockwise from east, three times round
    # queue, touched: three times the size of the grid for the buckets; once, for every cell that is given a cost
    queue: Cells
    touched: Cells
    diagonal: float  # length of a diagonal step, 1 to sqrt 2


@native
def flood(work: Buffers, stale: np.uint64, sources: Cells, wanted: Cells, limit: float) -> np.uint64:
    """Settle cells outward from passable `sources`, each given once, up to a length `limit` in cells.

    The search ends once all `wanted` cells are final (empty: at a whole field). The costs of the `stale` cells touched
    by the last search are reset. Return the number of cells touched.
    """
    cost = work.cost
    for k in range(stale):
        cost[work.touched[k]] = np.inf
    size = np.uint64(cost.size)
    here, near, far = ZERO, size, size + size
    here_end, near_end, far_end = _plant(work, sources), near, far
    seen, left = np.uint64(sources.size), np.uint64(wanted.size)
    level = 0.0
    while here_end > here or near_end > near or far_end > far:
        while left > ZERO and cost[wanted[left - ONE]] < level + 1.0:
            left -= ONE
        if left == ZERO and wanted.size > 0:
            return seen
        near_end, far_end, seen = _settle(work, (here, here_end), (near_end, far_end, seen), level, limit)
        here, near, far = near, far, here
        here_end, near_end, far_end = near_end, far_end, far
        level += 1.0
    return seen


@inlined
def _settle(
    work: Buffers,
    bucket: tuple[np.uint64, np.uint64],
    ends: tuple[np.uint64, np.uint64, np.uint64],
    level: float,
    limit: float,
) -> tuple[np.uint64, np.uint64, np.uint64]:
    """Settle the cells of a bucket, and queue their neighbours; return the ends of both other buckets and of `touched`.

    Turns that the previous cell could make at equal cost are pruned, as in jump point search: after a diagonal step
    three are left; after a straight one the step ahead, and on either side the two turns only where the cell diagonally
    behind is closed. The replacement of a pruned turn is either shorter or ends in a straight step, and straight steps
    are pruned in favour of shorter ones only, so costs stay exact.

    References
    ----------
    Harabor and Grastien, Online Graph Pruning for Pathfinding on Grid Maps, AAAI 2011, section 3.
    """
    passable, cost, arrival, offsets, queue, touched, diagonal = work
    near_end, far_end, seen = ends
    for k in range(bucket[0], bucket[1]):
        cell = np.uint64(queue[k])
        reached = cost[cell]
        if reached < level:
            continue  # already settled: it was queued here, then again in the previous bucket
        ahead = np.int64(arrival[cell])
        first, end = np.int64(8), np.int64(16)
        if ahead != SOURCE:
            if ahead & 1:  # diagonal
                first, end = ahead + 7, ahead + 10
            else:
                first = ahead + 6 + 2 * np.int64(passable[cell + offsets[ahead + 5]])
                end = ahead + 11 - 2 * np.int64(passable[cell + offsets[ahead + 3]])
        for turn in range(first, end):
            side = cell + offsets[turn]
            step = _step(passable, offsets, diagonal, cell, turn)
            length, before = reached + step, cost[side]
            if step == 0.0 or length > limit or length >= before:
                continue
            cost[side] = length
            arrival[side] = turn & 7
            if before == np.inf:
                touched[seen] = side
                seen += ONE
            if length < level + 2.0:
                if before >= level + 2.0:
                    queue[near_end] = side
                    near_end += ONE
            elif before == np.inf:
                queue[far_end] = side
                far_end += ONE
    return near_end, far_end, seen


@inlined
def _step(passable: Bytes, offsets: Words, diagonal: float, cell: np.uint64, turn: int) -> float:
    """Return the length of a step, 0 if it is blocked."""
    if not passable[cell + offsets[turn]]:
        return 0.0
    if not turn & 1:
        return 1.0
    return diagonal if passable[cell + offsets[turn - 1]] and passable[cell + offsets[turn + 1]] else 0.0


@native
def _plant(work: Buffers, sources: Cells) -> np.uint64:
    """Set the cost of all sources to 0, queue those beside a cell that is no source; return the number queued."""
    for k in range(sources.size):
        work.cost[sources[k]] = 0.0
        work.arrival[sources[k]] = SOURCE
        work.touched[k] = sources[k]
    queued = ZERO
    for k in range(sources.size):
        cell = np.uint64(sources[k])
        for turn in range(8):
            side = cell + work.offsets[turn]
            if work.passable[side] and work.cost[side] > 0.0:
                work.queue[queued] = cell
                queued += ONE
                break
    return queued


@native
def descend(work: Buffers, start: np.uint64, steps: Bytes) -> np.uint64:
    """Walk from `start` down to cost 0; write the steps and return their number."""
    cost, offsets = work.cost, work.offsets
    cell = start
    count = ZERO
    last = 0
    while cost[cell] > 0.0:
        best = 0
        for turn in range(8, 16):
            step = _step(work.passable, offsets, work.diagonal, cell, turn)
            fits = step > 0.0 and cost[cell + offsets[turn]] + step <= cost[cell] + TOLERANCE
            # among equal steps the straight one, else the first counter-clockwise from east
            if fits and (best == 0 or turn == last):
                best = turn
        cell = cell + offsets[best]
        steps[count] = best & 7
        count += ONE
        last = best
    return count
