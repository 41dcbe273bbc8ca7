"""Small drawn grids, random grids, and the sparse graph that scipy searches for comparison."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt
from hypothesis import strategies as st
from scipy.sparse import csr_array
from scipy.sparse.csgraph import dijkstra

from marsupial.model.grid import Cell, Mask

SQRT2 = math.sqrt(2.0)


def drawn(*lines: str) -> Mask:
    """Return the mask of a drawing whose last line is row 0; `#` is impassable."""
    return np.array([[char != "#" for char in line] for line in reversed(lines)], dtype=np.bool_)


@st.composite
def masks(draw: st.DrawFn, most: int = 9) -> Mask:
    height, width = draw(st.integers(1, most)), draw(st.integers(1, most))
    seed, share = draw(st.integers(0, 2**32 - 1)), draw(st.sampled_from((0.0, 0.15, 0.3, 0.45)))
    return np.random.default_rng(seed).random((height, width)) >= share


def cells_of(passable: Mask, *, margin: int = 0) -> st.SearchStrategy[Cell]:
    """Cells of the grid, passable or not, and `margin` cells around it."""
    height, width = passable.shape
    x, y = st.integers(-margin, width - 1 + margin), st.integers(-margin, height - 1 + margin)
    return st.builds(Cell, x, y)


def is_open(passable: Mask, cell: Cell) -> bool:
    height, width = passable.shape
    return 0 <= cell.x < width and 0 <= cell.y < height and bool(passable[cell.y, cell.x])


def is_legal(passable: Mask, a: Cell, b: Cell) -> bool:
    """Say whether one step leads from `a` to `b` without cutting a corner."""
    beside = Cell(a.x, b.y), Cell(b.x, a.y)
    near = max(abs(a.x - b.x), abs(a.y - b.y)) == 1
    return near and all(is_open(passable, cell) for cell in (a, b, *beside))


def all_lengths(passable: Mask, diagonal: float = SQRT2) -> npt.NDArray[np.float64]:
    """Return scipy's distances between all cells, row-major; inf from and to impassable ones."""
    height, width = passable.shape
    starts, ends, lengths = [], [], []
    for a in (Cell(x, y) for y in range(height) for x in range(width)):
        for b in (Cell(a.x + dx, a.y + dy) for dx in (-1, 0, 1) for dy in (-1, 0, 1)):
            if is_legal(passable, a, b):
                starts.append(a.y * width + a.x)
                ends.append(b.y * width + b.x)
                lengths.append(1.0 if b.x == a.x or b.y == a.y else diagonal)
    table = np.asarray(dijkstra(csr_array((lengths, (starts, ends)), shape=(passable.size, passable.size))))
    table[~passable.ravel()] = np.inf
    return table
