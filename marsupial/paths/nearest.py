"""The nearest source to each cell, updated incrementally as sources and passable cells are added.

The cost is proportional to what changes, not to the size of the map. Nothing is ever removed, so distances only fall: a
cell whose distance falls, or that gets a source of lower index at the same distance, updates its neighbours until
nothing changes.
"""

import math
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from marsupial.arrays import Bytes, Ints, Ints32
from marsupial.model import SQRT2, Mask
from marsupial.native import inlined, native
from marsupial.paths.kernels import TOLERANCE

_ONE = np.uint64(1)
_NONE: Ints = np.empty(0, dtype=np.int64)
_QUEUED, _CHANGED = np.uint8(1), np.uint8(2)

MANY = 255  # limits from here on, in cells, need more than one byte per kind of step of a path

Steps = npt.NDArray[np.uint16] | npt.NDArray[np.uint64]


class _NearestState(NamedTuple):
    """The state per cell, row-major, and buffers."""

    label: Ints32  # index of the nearest source, plus 1; 0 for none
    # steps of the path to that source: diagonal ones in the upper half of the bits, straight ones in the lower. Counts
    # instead of a length: exact, and two bytes per cell where the limit allows it.
    steps: Steps
    flags: Bytes  # `_QUEUED` and `_CHANGED` while a search runs
    queue: Ints32  # a ring of cells to expand
    changed: Ints32  # output: the cells whose source changed


class Nearest:
    """The nearest source within a limit (in cells) for every cell of one mask, which may open. Not thread-safe."""

    def __init__(self, passable: Mask, limit: float = math.inf) -> None:
        self._passable = passable
        self._limit = limit + TOLERANCE
        size = passable.size
        # zeroed or empty arrays: only the pages that a search writes to use memory
        self._state = _NearestState(
            label=np.zeros(size, dtype=np.int32),
            steps=np.zeros(size, np.uint16) if self._limit < MANY else np.zeros(size, np.uint64),
            flags=np.zeros(size, dtype=np.uint8),
            queue=np.empty(size + 1, dtype=np.int32),
            changed=np.empty(size, dtype=np.int32),
        )

    def add(self, sources: Ints, opened: Ints = _NONE) -> Ints:
        """Add passable sources and cells that became passable (row-major); return the cells whose source changed."""
        return self._add(sources, opened, self._limit).astype(np.int64)

    def origins(self, cells: Ints) -> Ints:
        """Return the row-major index of the nearest source of each cell, the lowest index if tied; -1 for none."""
        return self._state.label[cells].astype(np.int64) - 1

    def once(self, sources: Ints, cells: Ints, limit: float = math.inf) -> Ints:
        """Return the `origins` of cells with these sources added and a lower limit, then remove all sources."""
        changed = self._add(sources, _NONE, min(self._limit, limit + TOLERANCE))
        found = self.origins(cells)
        self._state.label[changed] = 0
        return found

    def _add(self, sources: Ints, opened: Ints, limit: float) -> Ints32:
        count = _settle(self._passable, sources, opened, limit, self._state)
        changed: Ints32 = self._state.changed[:count]
        return changed


@inlined
def _length(steps: np.uint64, half: np.uint64) -> float:
    """Return the length in cells of a path, given its packed steps (`_NearestState`)."""
    return SQRT2 * np.int64(steps >> half) + np.int64(steps & (_ONE << half) - _ONE)


@native
def _settle(passable: Mask, sources: Ints, opened: Ints, limit: float, state: _NearestState) -> int:
    """Add sources and opened cells, see `Nearest.add`; return the number of cells whose source changed."""
    label, steps, flags, queue, changed = state
    height, width = passable.shape
    half = np.uint64(4 * steps.itemsize)
    count = head = tail = 0
    for index in sources:
        if passable[index // width, index % width] and label[index] != index + 1:
            label[index], steps[index] = index + 1, 0
            changed[count] = queue[tail] = index
            count += 1
            tail += 1
            flags[index] = _QUEUED | _CHANGED
    # an opened cell gets its source from its neighbours: expand those again
    for index in opened:
        y, x = index // width, index % width
        for v in range(max(y - 1, 0), min(y + 2, height)):
            for u in range(max(x - 1, 0), min(x + 2, width)):
                near = v * width + u
                if label[near] and not flags[near] & _QUEUED:
                    flags[near] |= _QUEUED
                    queue[tail] = near
                    tail += 1
    while head != tail:
        cell = queue[head]
        head = head + 1 if head + 1 < queue.size else 0
        flags[cell] &= _CHANGED
        y, x = cell // width, cell % width
        reached = np.uint64(steps[cell])
        for v in range(max(y - 1, 0), min(y + 2, height)):
            for u in range(max(x - 1, 0), min(x + 2, width)):
                if not passable[v, u] or not (passable[y, u] and passable[v, x]):
                    continue
                onward = reached + (_ONE << half if u != x and v != y else _ONE)
                length = _length(onward, half)
                near = v * width + u
                if length > limit or near == cell:
                    continue
                if label[near]:
                    known = _length(np.uint64(steps[near]), half)
                    if length > known + TOLERANCE:
                        continue
                    if length >= known - TOLERANCE and label[cell] >= label[near]:
                        continue
                label[near], steps[near] = label[cell], onward
                if not flags[near] & _CHANGED:
                    changed[count] = near
                    count += 1
                if not flags[near] & _QUEUED:
                    queue[tail] = near
                    tail = tail + 1 if tail + 1 < queue.size else 0
                flags[near] = _QUEUED | _CHANGED
    for k in range(count):
        flags[changed[k]] = 0
    return count
