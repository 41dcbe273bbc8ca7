"""Small drawn grids, random grids, and the sparse graph that scipy searches for comparison."""

import math
from typing import Any

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
    """Draw cells of the grid, passable or not, or up to `margin` cells outside it."""
    height, width = passable.shape
    x, y = st.integers(-margin, width - 1 + margin), st.integers(-margin, height - 1 + margin)
    return st.builds(Cell, x, y)


def is_open(passable: Mask, cell: Cell) -> bool:
    height, width = passable.shape
    return 0 <= cell.x < width and 0 <= cell.y < height and bool(passable[cell.y, cell.x])


def is_legal(passable: Mask, a: Cell, b: Cell) -> bool:
    """Return whether one step leads from `a` to `b` without cutting a corner."""
    beside = Cell(a.x, b.y), Cell(b.x, a.y)
    near = max(abs(a.x - b.x), abs(a.y - b.y)) == 1
    return near and all(is_open(passable, cell) for cell in (a, b, *beside))


def all_lengths(passable: Mask, diagonal: float = SQRT2) -> npt.NDArray[np.float64]:
    """Return scipy's distances between all cells, row-major; inf from and to impassable ones."""
    numbers = np.arange(passable.size).reshape(passable.shape)
    graph = csr_array((passable.size, passable.size))
    for dx, dy in ((1, 0), (0, 1), (1, 1), (-1, 1)):
        legal = _shifted(passable, 0, 0, dx, dy)
        for x, y in ((dx, 0), (0, dy), (dx, dy)):
            legal = legal & _shifted(passable, x, y, dx, dy)
        ends = _shifted(numbers, 0, 0, dx, dy)[legal], _shifted(numbers, dx, dy, dx, dy)[legal]
        length = diagonal if dx and dy else 1.0
        graph += csr_array((np.full(ends[0].size, length), ends), shape=graph.shape)
    table = np.asarray(dijkstra(graph, directed=False))
    table[~passable.ravel()] = np.inf
    return table


def _shifted(cells: npt.NDArray[Any], x: int, y: int, dx: int, dy: int) -> npt.NDArray[Any]:
    """Return the cells `x` and `y` (part of a step) beside those from which a step of `dx` and `dy` stays inside."""
    height, width = cells.shape
    low = max(0, -dx)
    return cells[y : height - dy + y, low + x : width - abs(dx) + low + x]
