"""The state of one robot by the log so far."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from itertools import pairwise

from benchmarks.storm.ground import Document
from benchmarks.storm.logs import Cell


@dataclass
class Robot:
    """A robot; its `drive` is the route that it is on, and `passed_ms` when it passes each cell of it."""

    kind: Document
    cell: Cell | None
    carrier: str | None
    home: Cell | None
    drive: list[Cell] = field(default_factory=list)
    passed_ms: list[int] = field(default_factory=list)
    docks_since: int | None = None  # when its docking or undocking began
    distance_cells: float = 0.0
    driving_ms: int = 0
    visits: list[tuple[int, Cell]] = field(default_factory=list)
    lost: bool = False
    lost_once: bool = False
    lost_ms: int = 0  # how long it was lost
    speed: float = 1.0  # share of its type's speed
    stuck_until: int = 0

    @property
    def passed(self) -> list[tuple[int, Cell]]:
        """When it passes which cell of its drive."""
        return list(zip(self.passed_ms, self.drive, strict=True)) if self.drive else []

    def length(self, before: Cell, after: Cell) -> float:
        """Return the length of a step in cells."""
        straight = before[0] == after[0] or before[1] == after[1]
        return 1.0 if straight else float(self.kind.get("diagonal", math.sqrt(2)))

    def set_off(self, t_ms: int, way: list[Cell], metre: float) -> None:
        """Begin a drive along a way; a metre has `metre` cells."""
        self.cell, self.drive, self.passed_ms = way[0], way, [t_ms]
        length, speed_mps = 0.0, self.kind["speed_mps"] * self.speed
        for before, after in pairwise(way):
            length += self.length(before, after)
            self.passed_ms.append(t_ms + round(1000 * length / metre / speed_mps))

    def arrive(self, t_ms: int, cell: Cell, steps: int) -> None:
        """Stand at a cell, after so many steps of a drive."""
        if self.drive:
            way = self.drive[: steps + 1]
            self.distance_cells += sum(self.length(before, after) for before, after in pairwise(way))
            self.driving_ms += self.passed_ms[steps] - self.passed_ms[0]
            self.visits += self.passed[1 : steps + 1]
        self.stand(t_ms, cell)

    def stand(self, t_ms: int, cell: Cell) -> None:
        """Stand at a cell."""
        self.cell, self.drive = cell, []
        self.visits.append((t_ms, cell))
