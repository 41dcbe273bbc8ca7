"""Cells as runs of equal neighbours, as events tell of them."""

from __future__ import annotations

import numpy as np

from marsupial.arrays import Bytes, Ints
from marsupial.native import native


def runs_of(indices: Ints, cells: Bytes) -> tuple[int, ...]:
    """Return sorted row-major indices as flat runs (start, length, code) of equal neighbouring cells."""
    runs = np.empty((len(indices), 3), dtype=np.int64)
    count = _runs(indices, cells, runs)
    return tuple(runs[:count].ravel().tolist())


@native
def _runs(indices: Ints, cells: Bytes, runs: Ints) -> int:
    """Enter the runs (n, 3) of sorted row-major indices; return how many there are."""
    count = 0
    for index in indices:
        last = runs[count - 1]
        if count and index == last[0] + last[1] and cells[index] == last[2]:
            last[1] += 1
        else:
            runs[count, 0], runs[count, 1], runs[count, 2] = index, 1, cells[index]
            count += 1
    return count
