"""Run-length encoding of cells, for the events that report newly seen cells."""

import numpy as np

from marsupial.arrays import Bytes, Ints
from marsupial.native import native


def runs_of(indices: Ints, cells: Bytes) -> tuple[int, ...]:
    """Return the cells at sorted row-major indices as flat runs (start, length, code)."""
    runs = np.empty((len(indices), 3), dtype=np.int64)
    count = _runs(indices, cells, runs)
    return tuple(runs[:count].ravel().tolist())


@native
def _runs(indices: Ints, cells: Bytes, runs: Ints) -> int:
    """Write the runs (n, 3) of sorted row-major indices to `runs`; return their number."""
    count = 0
    for index in indices:
        last = runs[count - 1]  # for the first cell any row: `count` is tested first
        if count and index == last[0] + last[1] and cells[index] == last[2]:
            last[1] += 1
        else:
            runs[count, 0], runs[count, 1], runs[count, 2] = index, 1, cells[index]
            count += 1
    return count
