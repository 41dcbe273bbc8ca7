"""Where robots fit, on the ground and aboard, and what a team can reach: the oracle's own geometry.

Coordinates are cells (column, row), row 0 at the bottom; arrays are (height, width). A type of robot is the log's
description of it, with its `radius`, `range` and `radio` in cells.
"""

from __future__ import annotations

import heapq
import math
from collections import deque
from collections.abc import Iterable, Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.storm.logs import STEPS, Cell

Document = dict[str, Any]
CODES = {"#": 0, ".": 1, "~": 2, "m": 3, "g": 4, "?": 0}
"""Terrain codes of the characters that `worlds` draws; cells unknown to the map are solid."""

UNKNOWN = 255
BLOCKS_SIGHT = (0, 4)

RIM = 1e-6
"""A centre of a cell this near to the rim of a footprint, in cells, may count either way."""


def most_aboard(carrier: Document, rover: Document) -> int:
    """Return how many rovers of a type a type of carrier can carry."""
    seats = dict(carrier.get("seats", ()))
    return min(carrier["capacity"], seats.get(rover["name"], 0)) if seats else int(carrier["capacity"])


def has_places(carrier: Document, aboard: list[Document]) -> bool:
    """Return whether a type of carrier has places for rovers of these types together."""
    few = all(aboard.count(rover) <= most_aboard(carrier, rover) for rover in aboard)
    return few and len(aboard) <= carrier["capacity"]


def drawn_cells(rows: list[str]) -> NDArray[np.uint8]:
    """Return the terrain codes of a drawn map."""
    return np.array([[CODES[c] for c in row] for row in reversed(rows)], dtype=np.uint8)


def disc(radius: float) -> list[Cell]:
    """Return the offsets of the cells whose centres lie within a radius."""
    reach = range(-math.floor(radius), math.floor(radius) + 1)
    return [(u, v) for u in reach for v in reach if u * u + v * v <= radius * radius]


def footprint(kind: Document, slack: float = RIM) -> list[Cell]:
    """Return the offsets of the cells under a robot, whose radius is less by `slack`."""
    return disc(max(0.0, kind["radius"] - slack))


def dock_cells(carrier: Document, rover: Document) -> float:
    """Return the longest path over see-through ground between docking robots: bodies touch, give or take a cell."""
    return float(carrier["radius"] + rover["radius"] + math.sqrt(2) + 1e-6)


def standable(kind: Document, cells: NDArray[np.uint8], slack: float = RIM) -> NDArray[np.bool_]:
    """Return where a type can stand: it can drive on all cells of its footprint."""
    offsets, (height, width) = footprint(kind, slack), cells.shape
    reach = max(u for u, _ in offsets)
    free = np.pad(np.isin(cells, kind["terrains"]), reach)
    return np.logical_and.reduce([free[reach + v :, reach + u :][:height, :width] for u, v in offsets])


def around(cell: Cell, reach: int) -> tuple[slice, slice]:
    """Return the part of an array within some columns and rows of a cell."""
    x, y = cell
    return np.s_[max(0, y - reach) : y + reach + 1, max(0, x - reach) : x + reach + 1]


def beside(mask: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return the cells with a neighbour in the same column or row in a mask."""
    mask = np.pad(mask, 1)
    return mask[:-2, 1:-1] | mask[2:, 1:-1] | mask[1:-1, :-2] | mask[1:-1, 2:]


def inside(cells: NDArray[Any], cell: Cell) -> bool:
    """Return whether a cell is on a map."""
    return 0 <= cell[0] < cells.shape[1] and 0 <= cell[1] < cells.shape[0]


def moves(fits: NDArray[np.bool_], cell: Cell) -> Iterator[Cell]:
    """Yield the cells that a robot can step to from a cell, without cutting corners."""
    x, y = cell
    for u, v in STEPS:
        there = (x + u, y + v)
        if inside(fits, there) and fits[y + v, x + u] and fits[y, x + u] and fits[y + v, x]:
            yield there


def flood(fits: NDArray[np.bool_], starts: Iterable[Cell]) -> NDArray[np.bool_]:
    """Return the cells that steps lead to from some starts."""
    reached = np.zeros_like(fits)
    queue = deque(start for start in starts if fits[start[1], start[0]])
    for x, y in queue:
        reached[y, x] = True
    while queue:
        for x, y in moves(fits, queue.popleft()):
            if not reached[y, x]:
                reached[y, x] = True
                queue.append((x, y))
    return reached


def near(clear: NDArray[np.bool_], sources: Iterable[Cell], limit: float) -> dict[Cell, float]:
    """Return the cells within a path of at most `limit` cells over clear ground from some sources."""
    lengths = {source: 0.0 for source in sources if clear[source[1], source[0]]}
    heap = [(0.0, source) for source in lengths]
    while heap:
        length, cell = heapq.heappop(heap)
        if length > lengths[cell]:
            continue
        for there in moves(clear, cell):
            longer = length + math.dist(cell, there)
            if longer <= limit and longer < lengths.get(there, math.inf):
                lengths[there] = longer
                heapq.heappush(heap, (longer, there))
    return lengths


class TeamGround:
    """What robots, given by type and cell, can reach on a map whose `barred` cells are closed.

    Rovers are set down and picked up within sight on the map `sight`.
    """

    def __init__(
        self,
        team: list[tuple[Document, Cell | None]],
        cells: NDArray[np.uint8],
        sight: NDArray[np.uint8],
        barred: NDArray[np.bool_],
    ) -> None:
        self._team, self._cells = team, np.where(barred, np.uint8(0), cells)
        self._clear = ~np.isin(sight, BLOCKS_SIGHT) & ~barred

    def reaches(self, slack: float) -> Iterator[tuple[Document, NDArray[np.bool_]]]:
        """Yield what each robot can reach: carriers from their starts, rovers also from where they are set down.

        Any carrier counts for any rover that fits on it: one carrier may fetch a rover that another has brought.
        """
        by_carrier: list[tuple[Document, NDArray[np.bool_]]] = []
        for kind, cell in self._team:
            if kind["role"] == "carrier" and cell is not None:
                by_carrier.append((kind, flood(standable(kind, self._cells, slack), [cell])))
        yield from by_carrier
        for kind, cell in self._team:
            if kind["role"] == "rover":
                fits = standable(kind, self._cells, slack)
                starts = [] if cell is None else [cell]
                for carrier, mask in (pair for pair in by_carrier if most_aboard(pair[0], kind)):
                    held = [(x, y) for y, x in np.argwhere(mask).tolist()]
                    starts += [(x, y) for x, y in near(self._clear, held, dock_cells(carrier, kind)) if fits[y, x]]
                yield kind, flood(fits, starts)

    def reach(self, slack: float) -> NDArray[np.bool_]:
        """Return what the robots together can reach."""
        return np.logical_or.reduce([np.zeros_like(self._clear), *(mask for _, mask in self.reaches(slack))])

    def pockets(self) -> int:
        """Return the number of cells of rovers' ground in parts no larger than a rover, which need no search."""
        found = np.zeros_like(self._clear)
        for kind in (kind for kind, _ in self._team if kind["role"] == "rover"):
            fits = standable(kind, self._cells)
            left, most = fits.copy(), len(footprint(kind, slack=0))
            while left.any():
                y, x = np.argwhere(left)[0].tolist()
                part = flood(fits, [(x, y)])
                left &= ~part
                if np.count_nonzero(part) <= most:
                    found |= part
        return int(np.count_nonzero(found))
