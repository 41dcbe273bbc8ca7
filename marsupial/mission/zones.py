"""A `World` around another one, in whose map the zones that hold are drawn (`marsupial.model.zones`).

The mission loop plans with this map: no-go zones are obstacles in it, known or not. Without zones it is the other
world's map itself. Zones come from the order of the mission, each at its time, and from operators, by `News`, who
decide about a zone of the same name from then on.
"""

from collections import deque
from collections.abc import Iterable, Mapping
from dataclasses import replace

import numpy as np

from marsupial.arrays import Ints
from marsupial.maps.reach import groups, middle
from marsupial.maps.targets import cell_at
from marsupial.mission.around import WorldAround
from marsupial.mission.steady import SteadyWorld
from marsupial.model import DatedZone, Grid, News, Remaining, RobotType
from marsupial.model.grid import beside_unknown, code_table
from marsupial.model.zones import ZoneKind, Zones, changed, changes_of, zoned

BARRED = "a no-go zone covers it, or the unknown cells beside it"  # the reason for a frontier that is left


class ZonedWorld(WorldAround):
    """Forwards commands to another world, and draws zones in its map."""

    _world: SteadyWorld

    def __init__(self, world: SteadyWorld, zones: Iterable[DatedZone]) -> None:
        super().__init__(world)
        self._coming = deque(changes_of(zones))
        self.zones: Zones = {}  # that hold
        self._ground = world.grid  # the other world's map, of which `grid` is drawn
        self._grid = world.grid
        self._cells = np.empty((0, 0), dtype=np.uint8)  # the owner's view of its cells, with zones
        self.robots, self.drive = world.robots, world.drive

    @property
    def grid(self) -> Grid:
        return self._grid

    @property
    def no_go(self) -> str:
        """The no-go zones that hold, in words."""
        names = [name for name, zone in self.zones.items() if zone.kind is ZoneKind.NO_GO]
        return f"no-go zones: {', '.join(names)}" if names else ""

    @property
    def raw_news(self) -> News:
        """The last news of the innermost world."""
        return self._world.raw_news

    def advance(self, until_ms: int) -> News:
        if self._coming:
            until_ms = min(until_ms, max(self.now_ms, self._coming[0][0]))
        news = self._world.advance(until_ms)
        if news.zones:
            operated = {change.name for change in news.zones}
            self._coming = deque(one for one in self._coming if one[1].name not in operated)
        due = []
        while self._coming and self._coming[0][0] <= news.t_ms:
            due.append(self._coming.popleft()[1])
        return self._seen(replace(news, zones=(*due, *news.zones)) if due else news)

    def release(self) -> News | None:
        """See `SteadyWorld.release`."""
        news = self._world.release()
        return None if news is None else self._seen(news)

    def give_up(self, cells: Mapping[str, Ints]) -> News:
        """See `SteadyWorld.give_up`."""
        return self._seen(self._world.give_up(cells))

    def remaining(self, kinds: Iterable[RobotType]) -> tuple[Remaining, ...]:
        """Return the flickering and given-up cells, and the frontiers in no-go zones."""
        return self._world.remaining() + self._barred(kinds)

    def _seen(self, news: News) -> News:
        """Draw what is new, and leave out what no-go zones cover."""
        self.zones = changed(self.zones, news.zones) if news.zones else self.zones
        ground = self._world.grid
        if news.zones or ground is not self._ground:
            self._ground, self._grid = ground, zoned(ground, self.zones)
            if self.zones:  # a grid holds its cells read-only
                self._cells = self._grid.cells.copy()
                self._grid = replace(self._grid, cells=self._cells)
        zoning = self._grid.zoning
        if zoning is None:
            return news
        barred = zoning.barred.ravel()

        free = [(name, cells[~barred[cells]]) for name, cells in (*news.revealed, *news.changed)]
        for _, cells in free:
            self._cells.ravel()[cells] = ground.cells.ravel()[cells]
        revealed = free[: len(news.revealed)]
        # cells that change in zones stay: they may block robots that leave
        return replace(news, revealed=tuple((name, cells) for name, cells in revealed if len(cells)))

    def _barred(self, kinds: Iterable[RobotType]) -> tuple[Remaining, ...]:
        zoning, width = self.grid.zoning, self.grid.width
        if zoning is None:
            return ()
        drivable = code_table(frozenset[int]().union(*(kind.terrains for kind in kinds)))
        found, without = (drivable[cells] & beside_unknown(cells) for cells in (self._cells, zoning.ground))
        left = np.flatnonzero(without & ~found)
        return tuple(
            Remaining(cell=cell_at(int(middle(group, width)), width), frontier_cells=len(group), reason=BARRED)
            for group in groups(left, self._cells.shape)
        )
