"""Shortest distances by jump point search on a grid that is kept in bits.

Theory of operation
-------------------
A breadth-first search settles every cell. A jump point search settles only corners: some shortest path between two
cells changes direction only at corners of closed cells, and once between two corners, from diagonal to straight. So the
search runs in straight lines and stores a cell only where such a change may happen:

    . . . . . . .
    S-+-+-+-+-C .       From S the search scans its row. At C a side opens that was closed one cell before (#):
    # # # # # | .       C is a corner, stored with the direction of arrival. The cells between S and C are
    # # # # # v .       not stored, apart from goals, which get their distance in passing.

The inner loops are in jump_kernels.py. `_expand_corner` continues from a corner ahead and to the sides that opened,
with one call of `_jump` for each direction:

- straight: `_scan` runs along a row or column to the next corner or closed cell. A line is an array of 64-bit words
  with a bit per open cell, and rows and columns are stored separately, so that both are contiguous. With `here` the
  word of the line, and `a`, `b` those of the lines on both sides, one expression finds where a scan upwards ends:

      ends = ~here | a & ~(a << 1) | b & ~(b << 1)
             closed  open beside now, but closed one cell before

  and the lowest set bit of `ends` is the end: 64 cells in a few instructions.
- diagonal: `_jump` steps cell by cell and scans both straight directions from each cell; it stops where a shorter path
  is known.

Corners wait in buckets of width 1 by distance: a bucket queue replaces the heap. Within a bucket the order does not
matter, since no step is shorter than 1. A corner that was reached at lower cost in the meantime is skipped when it is
dequeued. The search ends once every goal has a distance below the current bucket's upper end.

No array over cells is cleared between searches (only the heads of the buckets are): each search has a number, and a
cell's distance is valid only if `found` holds that number. If the entries run out, `search` returns False and
`Jumps.costs` repeats it with a larger array.

`marsupial.paths.kernels` says which turns are pruned and why that costs nothing. `PathSearch` (fields.py) chooses
between this search and the flood: on ragged ground with a corner at every cell, jumping is the slower one.
`Distances` (distances.py) calls it only for the pairs whose distance may have changed.

References
----------
Harabor and Grastien, Online Graph Pruning for Pathfinding on Grid Maps, AAAI 2011; Improving Jump Point Search, ICAPS
2014, section 3 (rows in blocks of bits).
"""

from typing import Any

import numpy as np
import numpy.typing as npt

from marsupial.arrays import Floats, Ints
from marsupial.model.grid import Mask
from marsupial.paths.jump_kernels import FRAME, SEARCHES, STEPS, JumpSearch, OpenBits, flip, search


class JumpMemory:
    """Working memory for masks of one shape (height, width); several `Jumps` may share it, used one at a time."""

    def __init__(self, shape: tuple[int, int]) -> None:
        height, width = shape
        size = height * width
        self.state = JumpSearch(
            cost=np.empty(size, dtype=np.float64),
            found=np.zeros(size, dtype=np.int32),
            arrived=np.empty(size, dtype=np.uint8),
            heads=np.zeros(1 << (2 * (height + width)).bit_length(), dtype=np.int32),
            **_entries(64 + 16 * (height + width)),
            counts=np.zeros(4, dtype=np.int64),
        )


class Jumps:
    """Searches on one mask of a `shape`, which may change between calls; for `memory` see `PathSearch`."""

    def __init__(self, shape: tuple[int, int], diagonal: float, memory: JumpMemory | None = None) -> None:
        height, width = shape
        rows, columns = (height + 2, (width + FRAME) // 64 + 1), (width + 2, (height + FRAME) // 64 + 1)
        self._ground = OpenBits(
            rows=np.zeros(rows, dtype=np.uint64),
            columns=np.zeros(columns, dtype=np.uint64),
            row_goals=np.zeros(rows, dtype=np.uint64),
            column_goals=np.zeros(columns, dtype=np.uint64),
            width=width,
            diagonal=diagonal,
        )
        self._memory = memory or JumpMemory(shape)

    @property
    def steps(self) -> int:
        """Number of diagonal steps of the last search, to which its time is proportional."""
        return int(self._memory.state.counts[STEPS])

    def load(self, passable: Mask) -> Ints | None:
        """Copy the mask; return the cells opened since the last copy, row-major, or None if any was closed."""
        width = self._ground.width
        lines = self._ground.rows[1:-1].view(np.uint8)[:, FRAME // 8 : FRAME // 8 + (width + 7) // 8]
        bits = np.packbits(passable, axis=1, bitorder="little")
        y, byte = np.nonzero(bits != lines)
        if not y.size:
            return np.empty(0, dtype=np.int64)
        before, now = (np.unpackbits(each[y, byte, None], axis=1, bitorder="little") for each in (lines, bits))
        lines[y, byte] = bits[y, byte]
        which, bit = np.nonzero(before != now)
        cells = y[which] * width + byte[which] * 8 + bit
        flip(self._ground.columns, cells, width, False)
        return None if before[which, bit].any() else cells.astype(np.int64)

    def open(self, cells: Ints) -> None:
        """Open these cells (n,), which were closed."""
        flip(self._ground.columns, cells, self._ground.width, False)
        flip(self._ground.rows, cells, self._ground.width, True)

    def costs(self, source: int, wanted: Ints) -> Floats:
        """Return the distances (n,) of n open cells from an open one, all row-major; inf where there is no route."""
        memory = self._memory
        while not search(self._ground, memory.state, source, wanted):
            memory.state = memory.state._replace(**_entries(4 * len(memory.state.cell)))
        reached = memory.state.found[wanted] == memory.state.counts[SEARCHES]
        return np.where(reached, memory.state.cost[wanted], np.inf)


def _entries(count: int) -> dict[str, Any]:
    kinds: dict[str, npt.DTypeLike] = {"next": np.int32, "cell": np.int32, "direction": np.uint8, "length": np.float64}
    return {name: np.empty(count, dtype=kind) for name, kind in kinds.items()}
