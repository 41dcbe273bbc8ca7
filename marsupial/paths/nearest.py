"""Which source is the nearest to each cell, kept up to date as sources and passable cells are added.

The cost goes with what is new and not with the size of the map. Sources and passable cells only ever come on top, so
distances only fall; a cell whose distance falls, or whose nearest source of the same distance turns out to have a lower
index, hands that on to its neighbours until nothing changes.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from marsupial.arrays import Bytes, Ints, Ints32
from marsupial.model.grid import Mask
from marsupial.model.robots import SQRT2
from marsupial.native import inlined, native
from marsupial.paths.kernels import TOLERANCE

_ONE = np.uint64(1)
_NONE: Ints = np.empty(0, dtype=np.int64)
_QUEUED, _CHANGED = np.uint8(1), np.uint8(2)

MANY = 255
"""A limit, in cells, from which the steps of a way that goes just beyond it may not fit in half of two bytes each."""

Steps = npt.NDArray[np.uint16] | npt.NDArray[np.uint64]


class _NearestState(NamedTuple):
    """What is known of each cell, row-major, and buffers.

    Attributes
    ----------
    label
        The index of the nearest source, and one more; 0 where there is none.
    steps
        Of the way to that source: the diagonal ones in the upper half of the bits, the straight ones in the lower. So
        a cell takes two bytes for them wherever the limit allows it.
    flags
        `_QUEUED` and `_CHANGED` while a search runs.
    queue
        A ring of cells to go on from.
    changed
        Receives the cells whose source changed.
    """

    label: Ints32
    steps: Steps
    flags: Bytes
    queue: Ints32
    changed: Ints32


class Nearest:
    """The nearest source within a limit, for every cell of one mask. Not for use by two threads at once.

    Parameters
    ----------
    passable
        Boolean mask (height, width), referred to, not copied: cells may become passable (say so to `add`).
    limit
        Longest distance in cells.
    """

    def __init__(self, passable: Mask, limit: float = math.inf) -> None:
        self._passable = passable
        self._limit = limit + TOLERANCE
        size = passable.size
        # nothing is filled: only the pages a search writes to take up memory
        self._state = _NearestState(
            label=np.zeros(size, dtype=np.int32),
            steps=np.zeros(size, np.uint16) if self._limit < MANY else np.zeros(size, np.uint64),
            flags=np.zeros(size, dtype=np.uint8),
            queue=np.empty(size + 1, dtype=np.int32),
            changed=np.empty(size, dtype=np.int32),
        )

    def add(self, sources: Ints, opened: Ints = _NONE) -> Ints:
        """Take in new sources, and cells that have become passable; return the cells whose source changed.

        Parameters
        ----------
        sources, opened
            Row-major indices. Sources on impassable ground are left out.
        """
        return self._add(sources, opened, self._limit).astype(np.int64)

    def origins(self, cells: Ints) -> Ints:
        """Return the row-major index of the nearest source of each cell, the lowest among equals; -1 for none."""
        return self._state.label[cells].astype(np.int64) - 1

    def once(self, sources: Ints, cells: Ints, limit: float = math.inf) -> Ints:
        """Return what `origins` says of these cells with these sources added, and forget all sources there are.

        `limit` is for this once, if it is less.
        """
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
    """Return the length in cells of a way of so many diagonal and straight steps, see `_NearestState`."""
    return SQRT2 * np.int64(steps >> half) + np.int64(steps & (_ONE << half) - _ONE)


@native
def _settle(passable: Mask, sources: Ints, opened: Ints, limit: float, state: _NearestState) -> int:
    """Take in sources and opened cells, see `Nearest.add`; return how many cells have another source now."""
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
