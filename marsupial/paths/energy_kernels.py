"""The compiled inner loops of the search for routes of least energy.

A state is a cell and the heading to leave it by: 8 states a cell, adjacent in memory. A state has one step, to the
neighbour ahead; the robot arriving there may go straight on, or stop and turn once. So settling a state updates the 8
costs of one cell. Grids are flat and framed as in `marsupial.paths.kernels`.

The unit of energy is a straight step, so no step costs less than 1, and states whose costs lie within the same unit can
be settled in any order. Buckets form a ring, and a cell waits in the bucket of its next state to settle, at most once
per bucket. A cell due beyond the ring waits in the last bucket, and is requeued from there.
"""

from typing import NamedTuple

import numpy as np

from marsupial.arrays import Bytes, Cells, Floats, Ints, Words
from marsupial.native import inlined, native
from marsupial.paths.kernels import ONE, SOURCE, ZERO

BUCKETS = 8
HEADINGS = np.uint64(8)
TIE = 1.0 + 2.0**-30
"""Factor on the energy of each step that breaks ties in favour of the shorter route: over a whole route far less than a
turn, but far more than the rounding of the sum."""


class EnergyBuffers(NamedTuple):
    """The arrays and rules of a search; arrays are flat and framed except `offsets`, `ends` and `turning`."""

    passable: Bytes
    # cost, came: per state: energy in straight steps, inf if the last search did not reach it; heading by which the
    # robot came to the cell
    cost: Floats
    came: Bytes
    offsets: Words  # (24,): from a cell to its neighbours, counter-clockwise from east, three times round
    # queue, queued: `BUCKETS` buckets, each of the size of the grid; per cell, the bit set of the buckets it is in
    queue: Cells
    queued: Bytes
    touched: Cells  # every cell that received costs
    ends: Words  # (`BUCKETS` + 1,): the end of each bucket in `queue`, and of `touched`
    # (8,): energy of a stop and a turn by k times 45 degrees, in straight steps; 0 for driving straight on
    turning: Floats
    gain: float  # the most that turning twice can save over turning once; 0 if it never saves energy
    diagonal: float  # energy of a diagonal step, 1 to sqrt 2
    cuts_corners: bool  # whether a diagonal step ignores the cells beside it


@native
def spread(work: EnergyBuffers, source: np.uint64, heading: int, wanted: Cells) -> None:
    """Settle states outward from a cell, until the costs of `wanted` cells are final (empty: of all)."""
    size = np.uint64(work.passable.size)
    _begin(work, source, heading)
    left = np.uint64(wanted.size)
    level, slot = 0.0, 0
    waiting = work.passable[source] > 0
    while waiting:
        while left > ZERO and _least(work.cost, wanted[left - ONE]) < level + 1.0:
            left -= ONE
        if left == ZERO and wanted.size > 0:
            break
        _settle(work, slot, level)
        work.ends[slot] = np.uint64(slot) * size
        slot = (slot + 1) % BUCKETS
        level += 1.0
        waiting = False
        for bucket in range(BUCKETS):
            waiting |= work.ends[bucket] > np.uint64(bucket) * size
    for bucket in range(BUCKETS):
        for k in range(np.uint64(bucket) * size, work.ends[bucket]):
            work.queued[work.queue[k]] = 0


@native
def _begin(work: EnergyBuffers, source: np.uint64, heading: int) -> None:
    """Reset the last search and put the source in the first bucket."""
    size = np.uint64(work.passable.size)
    for k in range(work.ends[BUCKETS]):
        first = np.uint64(work.touched[k]) * HEADINGS
        for ahead in range(8):
            work.cost[first + np.uint64(ahead)] = np.inf
    for bucket in range(BUCKETS):
        work.ends[bucket] = np.uint64(bucket) * size
    work.ends[BUCKETS] = ZERO
    if not work.passable[source]:
        return
    first = source * HEADINGS
    for ahead in range(8):
        work.cost[first + np.uint64(ahead)] = work.turning[(ahead - heading) & 7] if heading >= 0 else 0.0
        work.came[first + np.uint64(ahead)] = SOURCE
    work.touched[0] = work.queue[0] = source
    work.ends[0] = work.ends[BUCKETS] = ONE
    work.queued[source] = 1


@inlined
def _settle(work: EnergyBuffers, slot: int, level: float) -> None:
    passable, cost, came, offsets, queue, queued, touched, ends, turning, gain, diagonal, cuts_corners = work
    size = np.uint64(passable.size)
    others = np.uint8(255 ^ (1 << slot))
    for k in range(np.uint64(slot) * size, ends[slot]):
        cell = np.uint64(queue[k])
        queued[cell] &= others
        here = cell * HEADINGS
        next_due = np.inf
        for ahead in range(8):
            reached = cost[here + np.uint64(ahead)]
            if reached < level:  # already settled
                continue
            if reached >= level + 1.0:  # a later bucket's: queue the cell again below
                next_due = min(next_due, reached)
                continue
            turn = np.uint64(ahead + 8)
            side = cell + offsets[turn]
            if not passable[side]:
                continue
            step = TIE
            if ahead & 1:
                beside = passable[cell + offsets[turn - ONE]] and passable[cell + offsets[turn + ONE]]
                if not (beside or cuts_corners):
                    continue
                step = diagonal * TIE
            there = side * HEADINGS
            arrival, before = reached + step, cost[there + np.uint64(ahead)]
            if arrival >= before + gain:  # no turn from this arrival can improve a state there
                continue
            if before == np.inf:
                touched[ends[BUCKETS]] = side
                ends[BUCKETS] += ONE
            for after in range(8):
                energy = arrival + turning[(after - ahead) & 7]
                if energy < cost[there + np.uint64(after)]:
                    cost[there + np.uint64(after)] = energy
                    came[there + np.uint64(after)] = ahead
            _queue(queue, queued, ends, side, slot + min(int(arrival - level), BUCKETS - 1))
        if next_due < np.inf:
            _queue(queue, queued, ends, cell, slot + min(int(next_due - level), BUCKETS - 1))


@inlined
def _queue(queue: Cells, queued: Bytes, ends: Words, cell: np.uint64, slot: int) -> None:
    bucket = slot % BUCKETS
    bit = np.uint8(1 << bucket)
    if not queued[cell] & bit:
        queued[cell] |= bit
        queue[ends[bucket]] = cell
        ends[bucket] += ONE


@inlined
def _least(cost: Floats, cell: np.uint32) -> float:
    first = np.uint64(cell) * HEADINGS
    least = cost[first]
    for ahead in range(1, 8):
        least = min(least, cost[first + np.uint64(ahead)])
    return least


@native
def least(work: EnergyBuffers, cells: Cells, energies: Floats) -> None:
    """Write the energies at which the last search reached these cells, inf for the others."""
    for k in range(cells.size):
        energies[k] = _least(work.cost, cells[k])


@inlined
def _arrived(work: EnergyBuffers, cell: np.uint64) -> int:
    """Return the heading of arrival at a cell at its least energy; `SOURCE` at the source."""
    first = cell * HEADINGS
    best = 0
    for ahead in range(1, 8):
        if work.cost[first + np.uint64(ahead)] < work.cost[first + np.uint64(best)]:
            best = ahead
    return int(work.came[first + np.uint64(best)])


@native
def trace(work: EnergyBuffers, goal: np.uint64, steps: Bytes) -> np.uint64:
    """Walk back from a reached cell to the source; write the step digits, last step first, and return their number."""
    cell, count = goal, ZERO
    last = _arrived(work, cell)
    while last != SOURCE:
        steps[count] = last
        count += ONE
        cell = cell - work.offsets[np.uint64(last)]
        last = int(work.came[cell * HEADINGS + np.uint64(last)])
    return count


@native
def tally(work: EnergyBuffers, heading: int, cells: Cells, counts: Ints) -> None:
    """Count the steps and turns of the routes to reached cells from the initial `heading`.

    `counts` (k, 6) receives straight and diagonal steps, and turns by 45, 90, 135 and 180 degrees.
    """
    for k in range(cells.size):
        cell = np.uint64(cells[k])
        last = _arrived(work, cell)
        while last != SOURCE:
            counts[k, last & 1] += 1
            cell = cell - work.offsets[np.uint64(last)]
            before = int(work.came[cell * HEADINGS + np.uint64(last)])
            faced = heading if before == SOURCE else before
            if faced >= 0 and faced != last:
                turn = abs(last - faced)
                counts[k, 1 + min(turn, 8 - turn)] += 1
            last = before
