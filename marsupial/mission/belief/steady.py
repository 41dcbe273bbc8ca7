"""Filters the map of a world: flickering cells keep their value (`marsupial.mission.belief.flicker`).

The mission loop plans with the filtered map and logs the raw one. In the simulator known cells never change, so the
filter is created with the first change: until then, both maps are the same.
"""

from collections.abc import Callable, Collection, Mapping
from dataclasses import replace

import numpy as np

from marsupial.arrays import Ints
from marsupial.maps.discs import disc
from marsupial.mission.belief.flicker import Flicker
from marsupial.model import UNKNOWN, Grid, News, Remaining, RobotReport, RobotType, World

MOST_RELEASES = 3  # how often an ending mission takes cells that flicker between ground and obstacle as reported

BESIDE_CELLS = 4.0  # a robot is beside cells this near to its body: exploring leads it next to a cell, or near it

_NONE: Ints = np.empty(0, dtype=np.int64)


class SteadyFilter:
    """Keeps a map and news without flickering and given-up cells; `robots` returns the robots as they are believed."""

    def __init__(
        self, world: World, kinds: Mapping[str, RobotType], robots: Callable[[], tuple[RobotReport, ...]]
    ) -> None:
        self._world, self._robots = world, robots
        bodies = {kind.name: kind.radius_m / world.grid.resolution_m for kind in kinds.values()}
        self._bodies = {name: disc(cells) for name, cells in bodies.items()}
        self._beside = {name: disc(cells + BESIDE_CELLS) for name, cells in bodies.items()}
        self._last = world.grid.cells.copy()
        self._flicker: Flicker | None = None  # created when a known cell changes or one is given up
        self._grid = world.grid
        self._releases = 0

    @property
    def grid(self) -> Grid:
        """The map without flickering."""
        return self._world.grid if self._flicker is None else self._grid

    def news(self, news: News) -> News:
        """Return news of the filtered map, in place of those of the map as it is reported."""
        cells = self._world.grid.cells
        begins = self._flicker is None and bool(news.changed)
        # without a filter yet, only note what is known, as the filter's starting point
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
        if not begins and news.finished:  # robots that arrived have seen what is beside them
            self._flicker.visited(self._around(self._beside, news.finished))
        seen = np.unique(np.concatenate([_NONE, *(indices for _, indices in (*news.revealed, *news.changed))]))
        found = self._flicker.update(seen, news.t_ms, self._around(self._bodies))
        return self._news(news, found) if self._flicker.any else news

    def release(self) -> News | None:
        """Accept flickering cells as reported; return the resulting news, or None."""
        if self._flicker is None or not self._flicker.any or self._releases == MOST_RELEASES:
            return None
        now_ms = self._world.now_ms
        news = self._news(News(t_ms=now_ms), self._flicker.release(now_ms, self._around(self._bodies)))
        if not news.revealed and not news.changed:
            return None
        self._releases += 1
        return news

    def give_up(self, cells: Mapping[str, Ints]) -> News:
        """Count these unknown cells (row-major, by reason) as obstacles, and no others; return the resulting news."""
        if self._flicker is None:
            self._flicker = Flicker(self._world.grid.cells, self._last)
            self._grid = replace(self._world.grid, cells=self._flicker.cells)
        found = self._flicker.give_up(cells, self._world.now_ms, self._around(self._bodies))
        # as changed cells, since these make everything be analysed anew, in what may be another grid
        return self._news(News(t_ms=self._world.now_ms), (_NONE, np.concatenate(found)))

    def remaining(self) -> tuple[Remaining, ...]:
        """Return the flickering and given-up cells, which differ from the reported map."""
        return () if self._flicker is None else self._flicker.remaining(self._world.now_ms)

    def _news(self, news: News, cells: tuple[Ints, Ints]) -> News:
        """Return `news` with these cells in place of its own: the cells that became known, and those that changed."""
        # any robot will do: which robot saw a cell matters only in the log, and the log holds the raw news
        reporter = next((name for name, _ in (*news.revealed, *news.changed)), self._robots()[0].name)
        revealed, changed = (((reporter, some),) if len(some) else () for some in cells)
        return replace(news, revealed=revealed, changed=changed)

    def _around(self, discs: Mapping[str, Ints], names: Collection[str] | None = None) -> Ints:
        """Return the cells of each type's disc around the robots on the ground, or around `names` only."""
        found = [_NONE]
        height, width = self._world.grid.cells.shape
        for robot in self._robots():
            if robot.cell is None or robot.lost or (names is not None and robot.name not in names):
                continue
            x, y = (np.array(robot.cell) + discs[robot.type]).T
            inside = (x >= 0) & (y >= 0) & (x < width) & (y < height)
            found.append((y * width + x)[inside])
        return np.concatenate(found)
