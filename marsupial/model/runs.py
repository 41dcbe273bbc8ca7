"""Cells of a map as runs: each stretch of equal neighbours in row-major order is (start, length, code).

Events, requests and answers encode cells this way. Runs are one flat tuple, three numbers for each stretch, and a run
may continue in the next row:

::

    row 1   ~ ~ # #        width 4, '.' is 1, '#' is 0, '~' is 2
    row 0   . . . ~        (0, 3, 1,   3, 3, 2,   6, 2, 0)
"""

from collections.abc import Iterator, Sequence, Set

import numpy as np

from marsupial.arrays import Bytes, Ints
from marsupial.model.grid import UNKNOWN, CellArray

Runs = tuple[int, ...]  # start, length and code of each run, in ascending order of cells


def triples(runs: Sequence[int]) -> Iterator[tuple[int, int, int]]:
    """Yield start, length and code of each run."""
    return zip(runs[0::3], runs[1::3], runs[2::3], strict=True)


def run_table(runs: Sequence[int]) -> Ints:
    """Return the runs as rows (n, 3)."""
    return np.array(runs, dtype=np.int64).reshape(-1, 3)


def runs_of(indices: Ints, cells: Bytes) -> Runs:
    """Return the cells at ascending row-major indices as runs; `cells` has the codes of the whole map."""
    codes = cells[indices]
    begins = np.ones(len(indices) + 1, dtype=np.bool_)  # the last one ends the last run
    begins[1:-1] = (indices[1:] != indices[:-1] + 1) | (codes[1:] != codes[:-1])
    edges = begins.nonzero()[0]
    starts = edges[:-1]
    table = np.empty((len(starts), 3), dtype=np.int64)
    table[:, 0], table[:, 1], table[:, 2] = indices[starts], edges[1:] - starts, codes[starts]
    return tuple(table.ravel().tolist())


def known_runs(cells: CellArray) -> Runs:
    """Return the known cells of a map as runs of maximum length."""
    flat = cells.ravel()
    edges = np.flatnonzero(np.diff(flat)) + 1
    starts, ends = np.concatenate(([0], edges)), np.concatenate((edges, [len(flat)]))
    known = flat[starts] != UNKNOWN
    table = np.stack((starts, ends - starts, flat[starts]), axis=1)[known]
    return tuple(table.ravel().tolist())


def cells_in(runs: Sequence[int]) -> tuple[Ints, Bytes]:
    """Return the row-major indices of the cells in runs, in the order of the runs, and their codes."""
    table = run_table(runs)
    lengths = table[:, 1]
    before = np.cumsum(lengths) - lengths
    indices = np.arange(int(lengths.sum())) + np.repeat(table[:, 0] - before, lengths)
    return indices, np.repeat(table[:, 2].astype(np.uint8), lengths)


def drawn(runs: Sequence[int], shape: tuple[int, ...]) -> CellArray:
    """Return a map of that shape, (height, width), that is unknown except for the cells in runs."""
    cells = np.full(shape, UNKNOWN, dtype=np.uint8)
    paint(cells, runs)
    return cells


def paint(cells: CellArray, runs: Sequence[int]) -> None:
    """Set the cells of a map (height, width) to the codes of runs."""
    flat = cells.reshape(-1)
    for start, length, code in triples(runs):
        flat[start : start + length] = code


def runs_fault(runs: Sequence[int], size: int, codes: Set[int]) -> str | None:
    """Return what is wrong with runs of a map of `size` cells, or None."""
    if len(runs) % 3:
        return "must be (start, length, code) three by three"
    end = 0
    for start, length, code in triples(runs):
        if start < end:
            return f"must be in ascending order without overlap, got a run from cell {start} after cell {end}"
        if length < 1 or start + length > size:
            return f"must stay inside the map of {size} cells, got a run of {length} from cell {start}"
        if code not in codes:
            return f"has no terrain of code {code}; there are {', '.join(map(str, sorted(codes)))}"
        end = start + length
    return None
