"""A world in which robots are lost, dockings and undockings fail, and known floor becomes an obstacle.

A seed draws the faults, so a mission can be repeated.
"""

from __future__ import annotations

import random
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from marsupial.model.grid import FLOOR, OBSTACLE, Cell
from marsupial.model.world import News
from marsupial.sim.world import SimulatedWorld

FAR = 8
"""Least distance in cells from every robot at which the map changes: no robot stands there or is about to."""


@dataclass(frozen=True)
class Faults:
    """The number of robots lost, the share of dockings and undockings that fail, and how often the map changes."""

    seed: int
    lost: int = 0
    failing: float = 0.0
    changes: int = 0

    def world(self, truth: Any, kinds: Any, robots: Any, **options: Any) -> FaultyWorld:
        """Return the world; arguments are those of `SimulatedWorld`."""
        rng = random.Random(self.seed)
        names = rng.sample([robot.name for robot in robots], min(self.lost, len(robots)))
        failures = {name: int(10 ** rng.uniform(0, 5.5)) for name in names}
        world = FaultyWorld(truth, kinds, robots, failures, **options)
        world.begin(rng, self)
        return world


class FaultyWorld(SimulatedWorld):
    """The simulator with faults; `begin` is called before anything happens."""

    def begin(self, rng: random.Random, faults: Faults) -> None:
        """Set the faults to come."""
        self._rng, self._faults = rng, faults
        self._real = self._truth.cells.copy()
        self._truth = replace(self._truth, cells=self._real)
        self._changes_ms = sorted(int(10 ** rng.uniform(3, 5.5)) for _ in range(faults.changes))
        self._doomed: dict[str, Callable[[], None]] = {}

    def dock(self, rover: str, carrier: str) -> None:
        """Dock, or pretend to."""
        cell = self._robots[rover].cell
        self._doom((rover, carrier), lambda: self._put(rover, cell, None))
        super().dock(rover, carrier)

    def undock(self, rover: str, carrier: str, cell: Cell) -> None:
        """Undock, or pretend to."""
        self._doom((rover, carrier), lambda: self._put(rover, None, carrier))
        super().undock(rover, carrier, cell)

    def advance(self, until_ms: int) -> News:
        """Advance time until something happens or fails."""
        news = super().advance(min(until_ms, *self._changes_ms[:1]) if self._changes_ms else until_ms)
        for name, _ in news.lost:
            self._doomed.pop(name, None)
        failed = tuple(name for name in news.finished if name in self._doomed)
        for name in failed:
            self._doomed.pop(name)()
        news = replace(
            news,
            finished=tuple(name for name in news.finished if name not in failed),
            failed=tuple((name, "it did not hold") for name in failed),
        )
        if self._changes_ms and news.t_ms >= self._changes_ms[0]:
            del self._changes_ms[0]
            news = replace(news, changed=self._change())
        return news

    def _doom(self, robots: tuple[str, ...], undo: Callable[[], None]) -> None:
        if self._rng.random() < self._faults.failing:
            self._doomed |= dict.fromkeys(robots, undo)

    def _put(self, robot: str, cell: Cell | None, carrier: str | None) -> None:
        self._robots[robot].cell, self._robots[robot].carrier = cell, carrier

    def _change(self) -> tuple[tuple[str, Any], ...]:
        """Turn some known floor far from all robots into obstacles, reported as found by a robot that acts."""
        at = [robot for robot in self.robots() if robot.cell is not None and not robot.lost]
        far = self.grid.cells == FLOOR
        for robot in self._robots.values():
            for cell in [robot.cell, *robot.route]:
                if cell is not None:
                    low, left = max(0, cell.y - FAR), max(0, cell.x - FAR)
                    far[low : cell.y + FAR + 1, left : cell.x + FAR + 1] = False
        indices = np.flatnonzero(far)
        if not at or not len(indices):
            return ()
        indices = np.sort(self._rng.sample(indices.tolist(), min(len(indices), self._rng.choice((1, 4, 30)))))
        for cells in (self._real, self._known):
            cells.ravel()[indices] = OBSTACLE
        self._sensed.clear()
        return ((at[0].name, indices.astype(np.int64)),)
