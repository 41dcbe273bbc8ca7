"""Draws the zones that hold in the map of which plans are made (`marsupial.model.zones`).

No-go zones are obstacles in it, known or not. Without zones it is the map of the ground itself. Zones come from the
order of the mission, each at its time, and from operators, by `News`, who decide about a zone of the same name from
then on.
"""

from collections import deque
from collections.abc import Iterable
from dataclasses import replace

import numpy as np

from marsupial.maps.reach import groups, middle
from marsupial.maps.targets import cell_at
from marsupial.model import DatedZone, Grid, News, Remaining, RobotType
from marsupial.model.grid import beside_unknown, code_table
from marsupial.model.zones import ZoneKind, Zones, changed, changes_of, zoned

BARRED = "a no-go zone covers it, or the unknown cells beside it"  # the reason for a frontier that is left


class ZoneFilter:
    """Keeps `grid`, a map of the `ground` with the zones that hold, and news of it."""

    def __init__(self, ground: Grid, zones: Iterable[DatedZone]) -> None:
        self._coming = deque(changes_of(zones))
        self._zones: Zones = {}  # that hold
        self._ground = self.grid = ground
        self._cells = np.empty((0, 0), dtype=np.uint8)  # the owner's view of the cells of `grid`, with zones

    @property
    def no_go(self) -> str:
        """The no-go zones that hold, in words."""
        names = [name for name, zone in self._zones.items() if zone.kind is ZoneKind.NO_GO]
        return f"no-go zones: {', '.join(names)}" if names else ""

    def until(self, until_ms: int, now_ms: int) -> int:
        """Return until when time may pass at most."""
        return min(until_ms, max(now_ms, self._coming[0][0])) if self._coming else until_ms

    def news(self, news: News, ground: Grid) -> News:
        """Return news of the `ground` with the zones that change, and without what no-go zones cover."""
        if news.zones:
            operated = {change.name for change in news.zones}
            self._coming = deque(one for one in self._coming if one[1].name not in operated)
        due = []
        while self._coming and self._coming[0][0] <= news.t_ms:
            due.append(self._coming.popleft()[1])
        return self._drawn(replace(news, zones=(*due, *news.zones)) if due else news, ground)

    def _drawn(self, news: News, ground: Grid) -> News:
        """Draw what is new, and leave out what no-go zones cover."""
        self._zones = changed(self._zones, news.zones) if news.zones else self._zones
        if news.zones or ground is not self._ground:
            self._ground, self.grid = ground, zoned(ground, self._zones)
            if self._zones:  # a grid holds its cells read-only
                self._cells = self.grid.cells.copy()
                self.grid = replace(self.grid, cells=self._cells)
        zoning = self.grid.zoning
        if zoning is None:
            return news
        barred = zoning.barred.ravel()

        free = [(name, cells[~barred[cells]]) for name, cells in (*news.revealed, *news.changed)]
        for _, cells in free:
            self._cells.ravel()[cells] = ground.cells.ravel()[cells]
        revealed = free[: len(news.revealed)]
        # cells that change in zones stay: they may block robots that leave
        return replace(news, revealed=tuple((name, cells) for name, cells in revealed if len(cells)))

    def remaining(self, kinds: Iterable[RobotType]) -> tuple[Remaining, ...]:
        """Return the frontiers in no-go zones."""
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
