"""How robots leave no-go zones: by the shortest way over known ground to a cell outside.

No-go zones are obstacles in the map for planning, so a robot that a zone catches could go nowhere. Planning has it
begin where it leaves the zone, as soon as it is there; on its first drive the robot drives the way out before all else.

Where a zone divides the ground, robots leave towards their home if they have one, and else to the larger part.
"""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from marsupial.arrays import Ints32
from marsupial.maps.footprint import fits, footprint_of
from marsupial.maps.reach import parts
from marsupial.maps.territory import Territory
from marsupial.maps.window import Window
from marsupial.model import Cell, Grid, RobotReport
from marsupial.paths.fields import PathSearch
from marsupial.paths.routes import Route, heading_of, passing_times_ms


class Exits:
    """Finds ways out of the no-go zones of one growing map; `homes` are the cells that robots return to, by name."""

    def __init__(self, territory: Territory, homes: Mapping[str, Cell]) -> None:
        self._territory, self._homes = territory, homes
        self._zoning = territory.grid.zoning
        self._labels: dict[str, tuple[int, Ints32]] = {}

    def outside(self, robot: RobotReport) -> RobotReport:
        """Return the report of a robot once it has left the no-go zone that it stands in, if it can."""
        way = None if robot.cell is None else self.way(robot.type, robot.cell, self._homes.get(robot.name))
        if way is None:
            return robot
        kind, metres = self._territory.kinds[robot.type], self._territory.grid.resolution_m
        takes_ms = int(passing_times_ms(way, metres, kind.speed_mps * robot.speed, kind.diagonal)[-1])
        free_at_ms = robot.free_at_ms + takes_ms
        return replace(robot, cell=way[-1], free_at_ms=free_at_ms, heading=heading_of(way[-2], way[-1]))

    def way(self, name: str, cell: Cell, goal: Cell | None = None) -> Route | None:
        """Return the way out of a no-go zone for a robot type, its last cell outside; None if it is in none.

        It leads to the part of the ground where the goal is, if it can.
        """
        if self._zoning is None or self._territory.footprints[name].standable[cell.y, cell.x]:
            return None
        kind, ground = self._territory.kinds[name], replace(self._territory.grid, cells=self._zoning.ground)
        if not fits(ground, kind, cell):
            return None
        window = self._around(ground, kind.radius_m)
        outside = self._territory.footprints[name].standable[window.cut]
        cut = replace(ground, cells=ground.cells[window.cut], zoning=None)
        within = PathSearch(footprint_of(cut, kind).standable & ~outside, kind.diagonal)
        here = Cell(cell.x - window.left, cell.y - window.bottom)
        lengths = np.pad(within.field(here), 1, constant_values=np.inf)
        # the last step is straight, so that no corner is cut
        steps = np.stack([lengths[1:-1, :-2], lengths[1:-1, 2:], lengths[:-2, 1:-1], lengths[2:, 1:-1]])
        nearest = np.where(outside, steps.min(axis=0), np.inf)
        if not np.isfinite(nearest).any():
            return None
        labels = self._parts(name)
        sizes = np.bincount(labels.ravel())
        if goal is not None:
            sizes[labels[goal.y, goal.x]] += labels.size
        sizes[0] = 0
        able = labels[window.cut][np.isfinite(nearest)]
        best = int(able[np.argmax(sizes[able])])
        y, x = divmod(int(np.argmin(np.where(labels[window.cut] == best, nearest, np.inf))), outside.shape[1])
        dx, dy = ((-1, 0), (1, 0), (0, -1), (0, 1))[int(np.argmin(steps[:, y, x]))]
        route = within.route(here, Cell(x + dx, y + dy))
        assert route is not None, "the field ends where routes end"
        return tuple(Cell(c.x + window.left, c.y + window.bottom) for c in (*route, Cell(x, y)))

    def _around(self, grid: Grid, radius_m: float) -> Window:
        """Return the window of all no-go zones, with a margin in which robots stand outside."""
        assert self._zoning is not None
        y, x = np.nonzero(self._zoning.barred)
        low, high = Cell(int(x.min()), int(y.min())), Cell(int(x.max()), int(y.max()))
        return Window.around(low, high, 2 * int(radius_m / grid.resolution_m + 2), grid.cells.shape)

    def _parts(self, name: str) -> Ints32:
        """Return the labels of the connected parts of the ground where a type can stand outside of zones."""
        revision = self._territory.revision
        if self._labels.get(name, (-1,))[0] != revision:
            self._labels[name] = revision, parts(self._territory.footprints[name].standable)[0]
        return self._labels[name][1]
