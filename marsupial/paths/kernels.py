"""The compiled inner loops of the path searches.

Grids arrive flat and framed by closed cells, so no loop tests for the edge of the map: cell (x, y) has index
``(y + 1) * (width + 2) + x + 1``. The search keeps a queue of three buckets of width 1. No step is shorter than a
bucket, so all cells of the lowest bucket are final, a cell enters at most two buckets, and no buffer has to grow.
Indices are unsigned, arrays are never rebound in a loop and the inner loop calls no function that hands back its
counters: each of these costs a multiple under numba.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import numpy.typing as npt
from numba import njit

Array = npt.NDArray[Any]

SQRT2 = math.sqrt(2.0)
TOLERANCE = 1e-9
"""Lengths that differ by less are equal: sums of the same steps in another order."""

ZERO = np.uint64(0)
ONE = np.uint64(1)


@njit(cache=True, nogil=True)
def flood(
    passable: Array,
    offsets: Array,
    cost: Array,
    origin: Array,
    queue: Array,
    touched: Array,
    stale: np.uint64,
    sources: Array,
    wanted: Array,
    limit: float,
) -> tuple[float, np.uint64]:
    """Settle cells outward from `sources`.

    Parameters
    ----------
    passable, cost
        uint8 and float64, framed and flat. `cost` is inf but at the first `stale` cells of `touched`, reset here.
    offsets
        uint64 (9,): from a cell to its neighbours, counter-clockwise from east, and east once more.
    origin
        int64, framed and flat: the label of each source. Receives the lowest label among the nearest sources of each
        cell that is reached. Empty where nobody asks.
    queue, touched
        uint32 buffers, three times and once the size of the grid. `touched` receives every cell given a cost.
    sources
        uint32: passable cells, each once.
    wanted
        uint32: the search ends once all of these are final. Empty for a whole field.
    limit
        Longest length to follow.

    Returns
    -------
    tuple of float and int
        The length below which costs are final, and how many cells were touched.
    """
    for k in range(stale):
        cost[touched[k]] = np.inf
    seen = ZERO
    for k in range(sources.size):
        cost[sources[k]] = 0.0
        touched[seen] = sources[k]
        seen += ONE
    size = np.uint64(cost.size)
    here, near, far = ZERO, size, size + size
    here_end, near_end, far_end = here, near, far
    for k in range(sources.size):  # sources amid sources have nothing to give
        cell = np.uint64(sources[k])
        for turn in range(8):
            if passable[cell + offsets[turn]] and cost[cell + offsets[turn]] > 0.0:
                queue[here_end] = cell
                here_end += ONE
                break
    tracked = origin.size > 0
    left = np.uint64(wanted.size)
    level = 0.0
    while here_end > here or near_end > near or far_end > far:
        while left > ZERO and cost[wanted[left - ONE]] < level + 1.0:
            left -= ONE
        if left == ZERO and wanted.size > 0:
            return level + 1.0, seen
        for k in range(here, here_end):
            cell = np.uint64(queue[k])
            reached = cost[cell]
            if reached < level:
                continue  # it moved to the bucket before
            for turn in range(8):
                side = cell + offsets[turn]
                if not passable[side]:
                    continue
                length = reached + 1.0
                if turn & 1:
                    if not (passable[cell + offsets[turn - 1]] and passable[cell + offsets[turn + 1]]):
                        continue
                    length = reached + SQRT2
                before = cost[side]
                if length > limit or length > before + TOLERANCE:
                    continue
                if tracked and (length < before - TOLERANCE or origin[cell] < origin[side]):
                    origin[side] = origin[cell]
                if length >= before:
                    continue
                cost[side] = length
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
        here, near, far = near, far, here
        here_end, near_end, far_end = near_end, far_end, far
        level += 1.0
    return np.inf, seen


@njit(cache=True, nogil=True)
def descend(passable: Array, offsets: Array, cost: Array, start: np.uint64, steps: Array) -> np.uint64:
    """Walk from `start` down to where `cost` is 0 and return the number of steps, which `steps` (uint8) receives.

    Among equals the walk goes straight on, else it takes the first step counter-clockwise from east.
    """
    cell = start
    count = ZERO
    last = 0
    while cost[cell] > 0.0:
        best = 8
        for turn in range(8):
            if not passable[cell + offsets[turn]]:
                continue
            length = 1.0
            if turn & 1:
                if not (passable[cell + offsets[turn - 1]] and passable[cell + offsets[turn + 1]]):
                    continue
                length = SQRT2
            fits = cost[cell + offsets[turn]] + length <= cost[cell] + TOLERANCE
            if fits and (best == 8 or turn == last):
                best = turn
        cell = cell + offsets[best]
        steps[count] = best
        count += ONE
        last = best
    return count
