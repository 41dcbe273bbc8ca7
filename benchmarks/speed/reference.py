"""Searches in plain C to compare marsupial's with: compiled at their first use, if there is a compiler.

The compiled libraries are in a temporary folder until the process ends.
"""

from __future__ import annotations

import ctypes
import shutil
import subprocess
import tempfile
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np

from marsupial.arrays import Floats, Ints
from marsupial.model.grid import Cell, Grid, Mask

COMPILER = ("cc", "-O3", "-march=native", "-shared", "-fPIC")
COMPILER_S = 60.0
"""Time limit of compiling."""

HEAP, BUCKETS = 0, 1
"""The queues of `dijkstra.c`."""


@dataclass(frozen=True, slots=True)
class NotCompiled:
    """The reason why nothing was compiled."""

    reason: str


@cache
def compiled(name: str) -> ctypes.CDLL | NotCompiled:
    """Return the library compiled from the C source of that name."""
    compiler = shutil.which(COMPILER[0])
    if compiler is None:
        return NotCompiled(f"there is no compiler ({COMPILER[0]})")
    source = Path(__file__).with_name(f"{name}.c")
    with tempfile.TemporaryDirectory(prefix="marsupial-") as folder:
        library = Path(folder, f"{name}.so")
        command = [compiler, *COMPILER[1:], str(source), "-o", str(library), "-lm"]
        try:
            done = subprocess.run(command, capture_output=True, text=True, timeout=COMPILER_S, check=False)
            if done.returncode:
                return NotCompiled(f"{' '.join(COMPILER)} failed: {_first_line(done.stderr)}")
            return ctypes.CDLL(str(library))  # once loaded it needs no file
        except (OSError, subprocess.TimeoutExpired) as error:
            return NotCompiled(_first_line(str(error)))


def _first_line(text: str) -> str:
    return text.strip().partition("\n")[0] or "it said nothing"


class PlainSearch:
    """Dijkstra's search of `dijkstra.c` on a copy of one mask.

    Parameters
    ----------
    passable
        Boolean mask (height, width).
    queue
        `HEAP` or `BUCKETS`.
    """

    def __init__(self, library: ctypes.CDLL, passable: Mask, queue: int) -> None:
        self._library, self._queue = library, queue
        self._open = np.ascontiguousarray(np.pad(passable, 1).astype(np.uint8))
        self._cost = np.full(self._open.shape, np.inf)  # written now, so that the first search need not allocate pages

    def field(self, source: Cell, wanted: Cell | None = None) -> Floats:
        """Return the distances (height, width) from a passable cell, a view that the next search overwrites.

        If one cell is `wanted`, only its distance has to be right.
        """
        goals = self._indices([] if wanted is None else [wanted])
        self._call("field", ctypes.c_int64(int(self._indices([source])[0])), *_array(goals), self._cost.ctypes)
        return self._cost[1:-1, 1:-1]

    def matrix(self, cells: list[Cell]) -> Floats:
        """Return the distances (k, k) between passable cells."""
        found = np.empty((len(cells), len(cells)))
        self._call("table", *_array(self._indices(cells)), self._cost.ctypes, found.ctypes)
        return found

    def _indices(self, cells: list[Cell]) -> Ints:
        return np.array([(cell.y + 1) * self._open.shape[1] + cell.x + 1 for cell in cells], dtype=np.int64)

    def _call(self, function: str, *arguments: object) -> None:
        row, size = ctypes.c_int64(self._open.shape[1]), ctypes.c_int64(self._open.size)
        done = getattr(self._library, function)(self._open.ctypes, row, size, ctypes.c_int(self._queue), *arguments)
        if not done:
            raise MemoryError(f"no memory for a search on {self._open.size} cells")


def _array(values: Ints) -> tuple[object, ctypes.c_int64]:
    return values.ctypes, ctypes.c_int64(values.size)


class PlainSight:
    """The field of view of `sight.c` on one map."""

    def __init__(self, library: ctypes.CDLL, grid: Grid) -> None:
        library.sight.restype = ctypes.c_int64
        self._library = library
        self._cells, self._opaque = np.ascontiguousarray(grid.cells), grid.opaque_codes()
        self._stamps = np.zeros(self._cells.shape, dtype=np.int64)
        self._seen = np.empty(self._cells.size, dtype=np.int64)
        self._stamp = 0

    def visible(self, cell: Cell, range_cells: float) -> Ints:
        """Return the row-major indices of the cells visible from a cell, a view that the next call overwrites."""
        self._stamp += 1
        numbers = (ctypes.c_int64(number) for number in (*self._cells.shape, self._stamp, *cell))
        height, width, stamp, x, y = numbers
        count = self._library.sight(
            self._cells.ctypes, self._opaque.ctypes, height, width, self._stamps.ctypes, stamp, self._seen.ctypes,
            x, y, ctypes.c_double(range_cells),
        )  # fmt: skip
        if count < 0:
            raise MemoryError("no memory for a field of view")
        return self._seen[:count]
