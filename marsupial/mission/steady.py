"""A world whose map is the one that plans are made from: as it is told, but still where it flickers."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace

import numpy as np

from marsupial.arrays import Ints
from marsupial.maps.footprint import disc
from marsupial.mission.flicker import Flicker
from marsupial.model.grid import UNKNOWN, Cell, Grid
from marsupial.model.mission import Remaining
from marsupial.model.robots import RobotType
from marsupial.model.world import Manoeuvres, News, RobotReport, World

MOST_RELEASES = 3
"""How often a mission that would end takes what flickers between ground and obstacle for what it is told to be."""

BESIDE_CELLS = 4.0
"""How far from a robot's body it is beside a cell: it explores what is next to where it could stand, or a little on."""

_NONE: Ints = np.empty(0, dtype=np.int64)


class SteadyWorld:
    """Passes everything on to another world; what flickers there is no news here.

    Attributes
    ----------
    told
        The last news of the other world.
    """

    def __init__(self, world: World, kinds: Mapping[str, RobotType]) -> None:
        self._world = world
        bodies = {kind.name: kind.radius_m / world.grid.resolution_m for kind in kinds.values()}
        self._bodies = {name: disc(cells) for name, cells in bodies.items()}
        self._beside = {name: disc(cells + BESIDE_CELLS) for name, cells in bodies.items()}
        self._last = world.grid.cells.copy()
        self._flicker: Flicker | None = None  # made when known cells change for the first time
        self._grid = world.grid
        self._releases = 0
        self.told = News(t_ms=world.now_ms)

    @property
    def grid(self) -> Grid:
        """The map that plans are made from."""
        return self._world.grid if self._flicker is None else self._grid

    @property
    def now_ms(self) -> int:
        """Mission time."""
        return self._world.now_ms

    def robots(self) -> tuple[RobotReport, ...]:
        """Return every robot of the team."""
        return self._world.robots()

    def drive(self, robot: str, route: Sequence[Cell]) -> None:
        """Send a free robot along `route`."""
        self._world.drive(robot, route)

    def stop(self, robot: str) -> None:
        """Let a driving robot stop."""
        self._world.stop(robot)

    def dock(self, rover: str, carrier: str) -> None:
        """Let a free rover dock on a free carrier."""
        self._world.dock(rover, carrier)

    def undock(self, rover: str, carrier: str, cell: Cell) -> None:
        """Let a free carrier set a rover down."""
        self._world.undock(rover, carrier, cell)

    def distance_m(self, robot: str) -> float:
        """Return how far a robot has driven."""
        return self._world.distance_m(robot)

    def driving_ms(self, robot: str) -> int:
        """Return how long a robot has been driving."""
        return self._world.driving_ms(robot)

    def manoeuvres(self, robot: str) -> Manoeuvres:
        """Return how often a robot has stopped and turned."""
        return self._world.manoeuvres(robot)

    def advance(self, until_ms: int) -> News:
        """Let time pass until something happens; return what is news."""
        self.told = news = self._world.advance(until_ms)
        cells = self._world.grid.cells
        begins = self._flicker is None and bool(news.changed)
        if news.moved is not None and self._flicker is None:
            self._last = news.moved.laid_out(self._last, UNKNOWN)
        elif news.moved is not None and self._flicker is not None:
            self._flicker.move(news.moved, cells)
        if begins:
            self._flicker = Flicker(cells, self._last)
        if self._flicker is None:
            for _, indices in news.revealed:
                self._last.ravel()[indices] = cells.ravel()[indices]
            return news
        if begins or news.moved is not None:
            self._grid = replace(self._world.grid, cells=self._flicker.cells)
        if not begins and news.finished:
            self._flicker.looked_at(self._around(self._beside, news.finished))
        seen = _joined((*news.revealed, *news.changed))
        found = self._flicker.take_in(seen, news.t_ms, self._around(self._bodies))
        return self._news(news, found) if self._flicker.any else news

    def release(self) -> News | None:
        """Take what flickers for what it is told to be, if that makes a difference; return what is news then."""
        if self._flicker is None or not self._flicker.any or self._releases == MOST_RELEASES:
            return None
        news = self._news(News(t_ms=self.now_ms), self._flicker.release(self.now_ms, self._around(self._bodies)))
        if not news.revealed and not news.changed:
            return None
        self._releases += 1
        return news

    def remaining(self) -> tuple[Remaining, ...]:
        """Return the cells that flicker and count as something else than they are told to be."""
        return () if self._flicker is None else self._flicker.remaining(self.now_ms)

    def _news(self, news: News, cells: tuple[Ints, Ints]) -> News:
        """Return news with these cells as those that are known now, and those that have changed."""
        teller = next((name for name, _ in (*news.revealed, *news.changed)), self.robots()[0].name)
        revealed, changed = (((teller, some),) if len(some) else () for some in cells)
        return replace(news, revealed=revealed, changed=changed)

    def _around(self, discs: Mapping[str, Ints], names: Collection[str] | None = None) -> Ints:
        """Return the cells of the discs, by type, round the robots on the ground, or those of these names."""
        found = [_NONE]
        height, width = self._world.grid.cells.shape
        for robot in self._world.robots():
            if robot.cell is None or robot.lost or (names is not None and robot.name not in names):
                continue
            x, y = (np.array(robot.cell) + discs[robot.type]).T
            inside = (x >= 0) & (y >= 0) & (x < width) & (y < height)
            found.append((y * width + x)[inside])
        return np.concatenate(found)


def _joined(seen: Sequence[tuple[str, Ints]]) -> Ints:
    """Return all cells that were seen, ascending, each once."""
    return np.unique(np.concatenate([_NONE, *(cells for _, cells in seen)]))
