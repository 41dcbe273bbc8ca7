"""What robots report of a map: late, in parts, in boxes that end where sensors hit something, and with wrong cells.

The simulator reveals cells once and for good. Maps of other software don't: a distortion lies between what the robots
of the simulator have seen, and what is reported of it.

- Some cells are never reported: panes of glass in walls and in the open.
- Some known cells are reported as another terrain or as unknown, in some reports.
- Reports are some reports late, but by no more than `MOST_LATE_MS`; sometimes one has only a part of the map.
- The frame is the whole map, the box of all known cells, or the box of the obstacles, which may be open at an edge.
- The lattice of the map moves by parts of a cell, as SLAM's does: then walls get thicker by a cell now and then.

Coordinates are cells of the true map (column, row), row 0 at the bottom; arrays are (height, width).
"""

from __future__ import annotations

import random
from collections import deque
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from benchmarks.storm.ground import UNKNOWN, Document
from benchmarks.storm.logs import Cell

OBSTACLE, FLOOR = 0, 1

MOST_LATE_MS = 10_000
"""SLAM publishes its map every 5 to 10 s. What is later than several looks of robots may rightly be given up."""

THICKER = 0.3
"""From this shift of the lattice on, in cells, a wall fills two cells."""


@dataclass(frozen=True, eq=False)
class Distortion:
    """How the reports of one mission differ from what its robots have seen."""

    seed: int
    frame: str = "whole"  # or "known": the box of what is known, or "hits": that of the obstacles
    hidden: NDArray[np.bool_] = field(
        default_factory=lambda: np.zeros((0, 0), dtype=bool)
    )  # cells that are never reported
    flickers: NDArray[np.bool_] = field(
        default_factory=lambda: np.zeros((0, 0), dtype=bool)
    )  # cells that are reported wrongly
    wrong: float = 0.0  # in this share of reports
    late: int = 0  # reports
    shrinks: float = 0.0  # share of reports that have only a part of the map
    shifts: float = 0.0  # share of reports in which the lattice moves; 0: never

    def label(self) -> str:
        """Return what is drawn, in short."""
        hidden, flickers = int(self.hidden.sum()), int(self.flickers.sum())
        return (
            f"frame={self.frame} hidden={hidden} flickers={flickers}/{self.wrong} late={self.late} "
            f"shrinks={self.shrinks} shifts={self.shifts}"
        )


def draw_distortion(rng: random.Random, truth: NDArray[np.uint8], stands: list[tuple[Cell, float]]) -> Distortion:
    """Return a distortion of a true map; cells within some cells of where robots stand at first are reported."""
    near = np.zeros(truth.shape, dtype=bool)
    rows, columns = np.indices(truth.shape)
    for (x, y), cells in stands:
        near |= np.hypot(columns - x, rows - y) <= cells + 1.5
    hidden = np.zeros(truth.shape, dtype=bool)
    if rng.random() < 0.6:
        for _ in range(rng.choice((1, 1, 2, 4))):
            _draw_pane(rng, truth, hidden)
    flickers = np.zeros(truth.shape, dtype=bool)
    if rng.random() < 0.4:
        share = rng.choice((0.002, 0.01, 0.05))
        floor_too = rng.random() < 0.3
        drawn = np.random.default_rng(rng.randrange(2**32)).random(truth.shape) < share
        flickers = drawn & ((truth == OBSTACLE) | floor_too)
    return Distortion(
        seed=rng.randrange(2**32),
        frame=rng.choice(("whole", "whole", "known", "hits", "hits")),
        hidden=hidden & ~near,
        flickers=flickers & ~near,
        wrong=rng.choice((0.02, 0.2, 0.5)) if flickers.any() else 0.0,
        late=rng.choice((0, 0, 1, 3, 10)),
        shrinks=rng.choice((0.0, 0.0, 0.01, 0.05)),
        shifts=rng.choice((0.0, 0.0, 0.0, 0.02, 0.2)),
    )


def _draw_pane(rng: random.Random, truth: NDArray[np.uint8], hidden: NDArray[np.bool_]) -> None:
    """Hide a straight pane in a wall, or some ground in the open."""
    in_wall = rng.random() < 0.6
    places = np.argwhere(truth == OBSTACLE if in_wall else truth != OBSTACLE).tolist()
    if not places:
        return
    y, x = rng.choice(places)
    if in_wall:
        length, along = rng.choice((1, 2, 3, 6)), rng.random() < 0.5
        pane = np.s_[y : y + 1, x : x + length] if along else np.s_[y : y + length, x : x + 1]
        hidden[pane] |= truth[pane] == OBSTACLE
    else:
        hidden[y : y + rng.choice((1, 1, 2, 4)), x : x + rng.choice((1, 1, 2, 4))] = True


def lattice_terrain(document: Document) -> None:
    """Leave floor and obstacles only: what a grid of occupancies can hold."""
    rows = document["map"]["rows"]
    document["map"]["rows"] = [row.replace("~", ".").replace("m", ".").replace("g", ".") for row in rows]
    for fault in document.get("faults", []):
        if fault["fault"] == "ground" and fault["terrain"] != "obstacle":
            fault["terrain"] = "floor"


@dataclass(frozen=True, eq=False)
class ReportedPicture:
    """A reported map: the cells of a box with `corner` as its lower left cell, which lies `shift` cells off."""

    corner: Cell
    cells: NDArray[np.uint8]
    shift: tuple[float, float] = (0.0, 0.0)


class Mapper:
    """Makes the pictures of one mission of what its robots have seen."""

    def __init__(self, distortion: Distortion) -> None:
        self._distortion = distortion
        self._past: deque[tuple[int, NDArray[np.uint8]]] = deque(maxlen=distortion.late + 1)
        self._count = 0
        self._shift = (0.0, 0.0)

    def picture(self, known: NDArray[np.uint8], t_ms: int, stood: NDArray[np.bool_]) -> ReportedPicture:
        """Return the next report of the known cells; it contains those that robots `stood` near."""
        drawn, self._count = self._distortion, self._count + 1
        rng = random.Random(f"{drawn.seed}/{self._count}")
        self._past.append((t_ms, known.copy()))
        cells = next(one for then_ms, one in self._past if then_ms >= t_ms - MOST_LATE_MS).copy()
        cells[drawn.hidden] = UNKNOWN
        self._make_wrong(rng, cells)
        if rng.random() < drawn.shrinks:
            _cut(rng, cells)
        if rng.random() < drawn.shifts:
            self._shift = rng.uniform(-0.45, 0.45), rng.uniform(-0.45, 0.45)
        cells = _thickened(cells, self._shift)
        if drawn.frame == "whole":
            return ReportedPicture((0, 0), cells, self._shift)
        rows, columns = np.nonzero(stood | (cells == OBSTACLE if drawn.frame == "hits" else cells != UNKNOWN))
        x, y = int(columns.min()), int(rows.min())
        return ReportedPicture((x, y), cells[y : rows.max() + 1, x : columns.max() + 1].copy(), self._shift)

    def _make_wrong(self, rng: random.Random, cells: NDArray[np.uint8]) -> None:
        drawn = self._distortion
        if not drawn.wrong:
            return
        for y, x in np.argwhere(drawn.flickers & (cells != UNKNOWN)).tolist():
            if rng.random() < drawn.wrong:
                cells[y, x] = UNKNOWN if rng.random() < 0.5 else FLOOR if cells[y, x] == OBSTACLE else OBSTACLE


def _cut(rng: random.Random, cells: NDArray[np.uint8]) -> None:
    """Leave one side of a map."""
    height, width = cells.shape
    x, y = rng.randrange(1, width), rng.randrange(1, height)
    side = rng.choice((np.s_[:, :x], np.s_[:, x:], np.s_[:y], np.s_[y:]))
    cells[side] = UNKNOWN


def _thickened(cells: NDArray[np.uint8], shift: tuple[float, float]) -> NDArray[np.uint8]:
    """Return a map on a lattice that is moved: a cell that a wall fills in part is an obstacle."""
    walls = np.pad(cells == OBSTACLE, 1)
    found, (height, width) = cells.copy(), cells.shape
    sides = [(0, 1 if along > 0 else -1) if abs(along) >= THICKER else (0,) for along in shift]
    for u in sides[0]:
        for v in sides[1]:
            found[walls[1 + v : 1 + v + height, 1 + u : 1 + u + width] & (cells != UNKNOWN)] = OBSTACLE
    return found
