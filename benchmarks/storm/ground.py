"""Where robots fit, what they reach and what they see on the true map, computed independently from the documentation.

Coordinates are cells (column, row), row 0 at the bottom; arrays are (height, width).
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


def most_aboard(carrier: Document, rover: Document) -> int:
    """Return how many rovers of a type a carrier can carry, by the types of a log."""
    seats = dict(carrier.get("seats", ()))
    return min(carrier["capacity"], seats.get(rover["name"], 0)) if seats else int(carrier["capacity"])


def drawn_cells(rows: list[str]) -> NDArray[np.uint8]:
    """Return the terrain codes of a drawn map."""
    return np.array([[CODES[c] for c in row] for row in reversed(rows)], dtype=np.uint8)


class TrueGround:
    """The true map, and its known part; a metre has `metre` cells."""

    def __init__(self, truth: NDArray[np.uint8], metre: float) -> None:
        self._truth, self._metre = truth, metre
        self._height, self._width = self._truth.shape
        self._known = np.full_like(self._truth, UNKNOWN)
        self._barred = np.zeros(self._truth.shape, dtype=bool)  # cells of no-go zones

    def _standable(self, kind: Document, cells: NDArray[np.uint8], slack: float) -> NDArray[np.bool_]:
        """Return where a type can stand: no centre of a cell that it can't drive on within its radius less `slack`."""
        free = np.isin(cells, kind["terrains"])
        radius = max(0.0, kind["radius_m"] * self._metre - slack)
        reach = math.floor(radius)
        padded = np.pad(free, reach)
        fits = np.ones_like(free)
        for v in range(-reach, reach + 1):
            for u in range(-reach, reach + 1):
                if u * u + v * v <= radius * radius:
                    fits &= padded[reach + v : reach + v + self._height, reach + u : reach + u + self._width]
        return fits

    def _under(self, kind: Document, slack: float = 1e-6) -> list[Cell]:
        """Return the offsets of the cells under a robot."""
        radius = max(0.0, kind["radius_m"] * self._metre - slack)
        reach = range(-math.floor(radius), math.floor(radius) + 1)
        return [(u, v) for u in reach for v in reach if u * u + v * v <= radius * radius]

    def _moves(self, fits: NDArray[np.bool_], cell: Cell) -> Iterable[Cell]:
        x, y = cell
        for u, v in STEPS:
            there = (x + u, y + v)
            if self._inside(there) and fits[y + v, x + u] and fits[y, x + u] and fits[y + v, x]:
                yield there

    def _inside(self, cell: Cell) -> bool:
        return 0 <= cell[0] < self._width and 0 <= cell[1] < self._height

    def _flood(self, fits: NDArray[np.bool_], starts: Iterable[Cell]) -> NDArray[np.bool_]:
        reached = np.zeros_like(fits)
        queue = deque(start for start in starts if fits[start[1], start[0]])
        for x, y in queue:
            reached[y, x] = True
        while queue:
            for x, y in self._moves(fits, queue.popleft()):
                if not reached[y, x]:
                    reached[y, x] = True
                    queue.append((x, y))
        return reached

    def _dock_cells(self, carrier: Document, rover: Document) -> float:
        """Return the longest path over see-through ground between docking robots: bodies touch, give or take a cell."""
        return (carrier["radius_m"] + rover["radius_m"]) * self._metre + math.sqrt(2) + 1e-6

    def _reach(
        self, cells: NDArray[np.uint8], team: list[tuple[Document, Cell | None]], slack: float
    ) -> NDArray[np.bool_]:
        """Return what the robots of a team can reach."""
        masks = [mask for _, mask in self._reaches(cells, team, slack)]
        return np.logical_or.reduce([np.zeros(cells.shape, dtype=bool), *masks])

    def _reaches(
        self, cells: NDArray[np.uint8], team: list[tuple[Document, Cell | None]], slack: float
    ) -> Iterator[tuple[Document, NDArray[np.bool_]]]:
        """Yield what each robot can reach: carriers from their starts, rovers also from where they are set down.

        Any carrier counts for any rover that fits on it: one carrier may fetch a rover that another has brought.
        """
        cells = np.where(self._barred, 0, cells)
        by_carrier: list[tuple[Document, NDArray[np.bool_]]] = []
        for kind, cell in team:
            if kind["role"] == "carrier" and cell is not None:
                mask = self._flood(self._standable(kind, cells, slack), [cell])
                by_carrier.append((kind, mask))
                yield kind, mask
        for kind, cell in team:
            if kind["role"] == "rover":
                fits = self._standable(kind, cells, slack)
                starts = [] if cell is None else [cell]
                for carrier, mask in (pair for pair in by_carrier if most_aboard(pair[0], kind)):
                    held = [(x, y) for y, x in np.argwhere(mask).tolist()]
                    near = self._near(held, self._dock_cells(carrier, kind))
                    starts += [(x, y) for x, y in near if fits[y, x]]
                yield kind, self._flood(fits, starts)

    def _pockets(self, cells: NDArray[np.uint8], team: list[tuple[Document, Cell | None]]) -> int:
        """Return the number of cells of rovers' ground in parts no larger than a rover, which need no search."""
        found, cells = np.zeros(cells.shape, dtype=bool), np.where(self._barred, 0, cells)
        for kind in (kind for kind, _ in team if kind["role"] == "rover"):
            fits, radius = self._standable(kind, cells, 1e-6), kind["radius_m"] * self._metre
            reach = range(-math.floor(radius), math.floor(radius) + 1)
            most = max(1, sum(u * u + v * v <= radius * radius for u in reach for v in reach))
            left = fits.copy()
            while left.any():
                y, x = np.argwhere(left)[0].tolist()
                part = self._flood(fits, [(x, y)])
                left &= ~part
                if np.count_nonzero(part) <= most:
                    found |= part
        return int(np.count_nonzero(found))

    def _near(self, sources: Iterable[Cell], limit: float) -> dict[Cell, float]:
        """Return the cells within a path of at most `limit` cells over see-through ground from some sources."""
        clear = ~np.isin(self._truth, BLOCKS_SIGHT) & ~self._barred
        lengths = {source: 0.0 for source in sources if clear[source[1], source[0]]}
        heap = [(0.0, source) for source in lengths]
        while heap:
            length, cell = heapq.heappop(heap)
            if length > lengths[cell]:
                continue
            for there in self._moves(clear, cell):
                longer = length + math.dist(cell, there)
                if longer <= limit and longer < lengths.get(there, math.inf):
                    lengths[there] = longer
                    heapq.heappush(heap, (longer, there))
        return lengths

    def _missed(self, cell: Cell, radius: float) -> Cell | None:
        x, y = cell
        reach = min(math.floor(radius), max(self._width, self._height))
        low, left = max(0, y - reach), max(0, x - reach)
        window = self._known[low : y + reach + 1, left : x + reach + 1]
        for v, u in np.argwhere(window == UNKNOWN).tolist():
            there = (left + u, low + v)
            if math.dist(cell, there) <= radius - 1e-6 and self._plain(cell, there):
                return there
        return None

    def _plain(self, here: Cell, there: Cell) -> bool:
        """Return whether no cell within one cell of the line between two cells, except `there`, blocks sight."""
        steps = max(abs(there[0] - here[0]), abs(there[1] - here[1])) * 2
        for k in range(steps + 1):
            x = here[0] + (there[0] - here[0]) * k / max(1, steps)
            y = here[1] + (there[1] - here[1]) * k / max(1, steps)
            for v in range(math.floor(y - 0.5), math.ceil(y + 0.5) + 1):
                for u in range(math.floor(x - 0.5), math.ceil(x + 0.5) + 1):
                    beside = (u, v) != there and self._inside((u, v))
                    if beside and self._truth[v, u] in BLOCKS_SIGHT and math.dist((u, v), (x, y)) < 1.0:
                        return False
        return True
