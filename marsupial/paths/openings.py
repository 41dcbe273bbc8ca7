"""The few cells that represent all places where opening cells may have shortened a path.

A new path crosses an opened cell beside a formerly open one (an *entry*), or passes such a cell diagonally. Searching
to every entry would cost too much, so one entry represents all entries of a square that are connected within it, with a
known error: a path through any of them is at most that much shorter than a path through the representative.

    before    now        o: opened, e: entry, R: the representative of the entries in this square
    . . . #   . . e o
    . . . #   . . R o    error = 2 x the distance from R to the farthest e (there and back)
    . . . #   . . e o            + what a diagonal step beside an opened cell saves
"""

from typing import NamedTuple

import numpy as np

from marsupial.arrays import Flags, Floats, Ints
from marsupial.model.grid import Mask
from marsupial.native import inlined, native
from marsupial.paths.kernels import TOLERANCE

SIDE = 8
"""Side of the squares, in cells.

On a real building at 5 cm, squares of 16 cost 3 % more searches with 40 % fewer representatives; squares of 5 save 1 %
of the searches with half as many representatives again.
"""


class Openings(NamedTuple):
    """Representatives (n,), row-major, and their errors (n,): how much shorter a path through an entry may be."""

    cells: Ints
    errors: Floats


NO_OPENINGS = Openings(np.empty(0, dtype=np.int64), np.empty(0))


def openings(passable: Mask, opened: Ints, diagonal: float) -> Openings:
    """Return the representatives of the entries among these newly passable cells (n,)."""
    where = np.sort(opened)
    news = np.zeros(passable.size, dtype=np.bool_)
    news[where] = True
    cells, errors = np.empty(where.size, dtype=np.int64), np.empty(where.size)
    count = _represent(passable, _entries(passable, where, news), news, diagonal, cells, errors)
    # a diagonal step beside an opened cell is shorter than the path through that cell
    return Openings(cells[:count], 2.0 * errors[:count] + (2.0 - diagonal))


@native
def _entries(passable: Mask, opened: Ints, news: Flags) -> Ints:
    """Return the opened cells beside cells that were open before, and leave only these set in `news`."""
    height, width = passable.shape
    out = np.empty(opened.size, dtype=np.int64)
    count = 0
    for index in opened:
        y, x = index // width, index % width
        beside = False
        for v in range(max(y - 1, 0), min(y + 2, height)):
            for u in range(max(x - 1, 0), min(x + 2, width)):
                beside |= passable[v, u] and not news[v * width + u]
        if beside:
            out[count] = index
            count += 1
    for index in opened:
        news[index] = False
    for k in range(count):
        news[out[k]] = True
    return out[:count].copy()


@native
def _represent(passable: Mask, entries: Ints, left: Flags, diagonal: float, cells: Ints, errors: Floats) -> int:
    """Choose representatives of the entries set in `left`, with the distance to their farthest; return their number."""
    away = np.empty((SIDE, SIDE))
    count = 0
    for index in entries:
        while left[index]:
            seed = _middle(left, index, passable.shape)
            _measure(passable, seed, diagonal, away)
            cells[count], errors[count] = seed, _clear_reached(left, seed, passable.shape, away)
            count += 1
    return count


@inlined
def _square(index: int, shape: tuple[int, int]) -> tuple[int, int, int, int]:
    """Return the bounds of a cell's square: bottom, top, first and end."""
    y, x = index // shape[1] // SIDE * SIDE, index % shape[1] // SIDE * SIDE
    return y, min(y + SIDE, shape[0]), x, min(x + SIDE, shape[1])


@inlined
def _middle(left: Flags, index: int, shape: tuple[int, int]) -> int:
    """Return the remaining entry of a cell's square that is nearest to the square's middle."""
    bottom, top, first, end = _square(index, shape)
    seed, nearest = index, np.inf
    for y in range(bottom, top):
        for x in range(first, end):
            apart = (2 * (y - bottom) - SIDE) ** 2 + (2 * (x - first) - SIDE) ** 2
            if left[y * shape[1] + x] and apart < nearest:
                seed, nearest = y * shape[1] + x, apart
    return seed


@native
def _measure(passable: Mask, seed: int, diagonal: float, away: Floats) -> None:
    """Write the distances from a cell to the cells of its square, by paths inside the square."""
    height, width = passable.shape
    bottom, top, first, end = _square(seed, (height, width))
    # relaxed until nothing changes: 64 cells need no queue
    away[:] = np.inf
    away[seed // width - bottom, seed % width - first] = 0.0
    shorter = True
    while shorter:
        shorter = False
        for y in range(bottom, top):
            for x in range(first, end):
                length = away[y - bottom, x - first]
                for v in range(max(y - 1, bottom), min(y + 2, top)):
                    for u in range(max(x - 1, first), min(x + 2, end)):
                        diagonally = u != x and v != y
                        if not (passable[v, u] and passable[y, u] and passable[v, x]):
                            continue
                        there = length + (diagonal if diagonally else 1.0)
                        if there < away[v - bottom, u - first] - TOLERANCE:
                            away[v - bottom, u - first] = there
                            shorter = True


@inlined
def _clear_reached(left: Flags, seed: int, shape: tuple[int, int], away: Floats) -> float:
    """Clear the reached entries of a square; return the distance of the farthest."""
    bottom, top, first, end = _square(seed, shape)
    farthest = 0.0
    for y in range(bottom, top):
        for x in range(first, end):
            if left[y * shape[1] + x] and away[y - bottom, x - first] < np.inf:
                left[y * shape[1] + x] = False
                farthest = max(farthest, away[y - bottom, x - first])
    return farthest
