"""The part of a map that nobody has seen yet, in squares, each about as large as a room, and the ways there.

A square belongs to it as long as at least half of it is unknown and may be ground: carriers would get there from some
target if they could drive on all that is unknown. So the inside of rock is left out once its walls are known. The map
is taken to end where its grid does.

All this is done on cells of a quarter of a metre or larger: finer ones would tell no more.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from marsupial.maps.targets import Target
from marsupial.maps.territory import Territory
from marsupial.model.grid import UNKNOWN, Cell, Mask
from marsupial.model.robots import Role
from marsupial.model.unseen import Square, Unseen
from marsupial.paths.fields import PathSearch, grow

SIDE_M = 10.0
"""Length of the side of a square."""

UNKNOWN_SHARE = 0.5
"""Which share of a square has to be unknown."""

MOST_SQUARES = 40
"""How many squares are told of: those with the shortest ways there."""

CELL_M = 0.25
"""Length of the side of the smallest cells that ways are looked for on."""

FIRST_GUESS, FIRST_GUESS_M2 = 0.3, 25.0
"""The share of ground for rovers only that is expected before any is seen, and how much seen ground that weighs."""


def unseen(territory: Territory, targets: Sequence[Target]) -> Unseen:
    """Return what is unseen of a territory beyond these targets."""
    grid = territory.grid
    carriers = territory.of_role(Role.CARRIER)
    ground = frozenset[int]().union(*(kind.terrains for kind in carriers))
    unknown = grid.cells == UNKNOWN
    shrunk = max(1, round(CELL_M / grid.resolution_m))
    # closed where as many cells are as a wall of one cell takes
    passable = _sums(~(unknown | grid.mask_of(ground)), shrunk) < shrunk
    gates = {t.name: t.viewpoints[k.name] for t in targets for k in carriers if k.name in t.viewpoints}
    cells = [Cell(cell.x // shrunk, cell.y // shrunk) for cell in gates.values()]
    for cell in cells:
        passable[cell.y, cell.x] = True
    ways, _ = grow(passable, cells, math.inf)
    unexplored = np.isfinite(ways) & (_sums(unknown, shrunk) >= UNKNOWN_SHARE * shrunk**2)
    squares = _squares(unexplored, max(1, round(SIDE_M / (shrunk * grid.resolution_m))))
    squares = sorted(squares, key=lambda square: float(ways[square[1].y, square[1].x]))[:MOST_SQUARES]
    metres = PathSearch(passable).matrix([*cells, *(middle for _, middle in squares)]) * shrunk * grid.resolution_m
    return Unseen(
        squares=tuple(square for square, _ in squares),
        gates=tuple(gates),
        from_gates_m=metres[: len(cells), len(cells) :],
        between_m=metres[len(cells) :, len(cells) :],
        rovers_only=_rovers_only(territory),
        speed_mps={kind.name: kind.speed_mps for kind in territory.kinds.values()},
    )


def _sums(mask: Mask, side: int) -> npt.NDArray[np.int64]:
    """Return how many cells of the mask there are in each block of `side` x `side`."""
    height, width = mask.shape
    rows, columns = -(-height // side), -(-width // side)
    padded = np.zeros((rows * side, columns * side), dtype=np.int64)
    padded[:height, :width] = mask
    return padded.reshape(rows, side, columns, side).sum(axis=(1, 3))


def _squares(unknown: Mask, side: int) -> list[tuple[Square, Cell]]:
    """Return the squares of `side` cells that are left, each with the unknown cell in the middle."""
    share = _sums(unknown, side) / side**2
    found = []
    for row, column in np.argwhere(share >= UNKNOWN_SHARE).tolist():
        y, x = np.nonzero(unknown[row * side : (row + 1) * side, column * side : (column + 1) * side])
        middle = int(np.argmin((y - y.mean()) ** 2 + (x - x.mean()) ** 2))
        square = Square(
            name=f"{column}_{row}",
            share=float(share[row, column]),
            draw=(37 * column + 61 * row) % 100 / 100,
        )
        found.append((square, Cell(column * side + int(x[middle]), row * side + int(y[middle]))))
    return found


def _rovers_only(territory: Territory) -> float:
    rovers, carriers = (
        frozenset[int]().union(*(kind.terrains for kind in territory.of_role(role)))
        for role in (Role.ROVER, Role.CARRIER)
    )
    cells = np.bincount(territory.grid.cells.ravel(), minlength=256) * territory.grid.cell_area_m2
    only, all_ground = (float(cells[sorted(codes)].sum()) for codes in (rovers - carriers, rovers | carriers))
    return (only + FIRST_GUESS * FIRST_GUESS_M2) / (all_ground + FIRST_GUESS_M2)
