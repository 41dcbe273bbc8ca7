"""How robots leave no-go zones: by the shortest way over known ground to a cell outside.

No-go zones are obstacles in the map for planning, so a robot that a zone catches could go nowhere. Planning has it
begin where it leaves the zone, as soon as it is there; on its first drive the robot drives the way out before all else.

Where a zone divides the ground, robots leave towards their home if they have one, and else to the larger part.
"""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from marsupial.arrays import Ints
from marsupial.maps.discs import fits
from marsupial.maps.footprint import footprint_of
from marsupial.maps.reach import parts
from marsupial.maps.targets import cell_at
from marsupial.maps.territory import Territory
from marsupial.maps.window import Window
from marsupial.model import OBSTACLE, UNKNOWN, Cell, Mask, RobotReport, RobotType
from marsupial.model.grid import Zoning
from marsupial.model.zones import covered
from marsupial.paths.fields import PathSearch
from marsupial.paths.routes import Route, heading_of, passing_times_ms


class Exits:
    """Finds ways out of the no-go zones of one growing map; `homes` are the cells that robots return to, by name."""

    def __init__(self, territory: Territory, homes: Mapping[str, Cell]) -> None:
        self._territory, self._homes = territory, homes
        self._zoning = territory.grid.zoning
        self._now = (-1, -1)  # revision of the territory, and number of known cells, of the ways found
        self._ways: dict[tuple[str, Cell, Cell | None], Route | None] = {}

    def outside(self, robot: RobotReport) -> RobotReport:
        """Return the report of a robot once it has left the no-go zone that it stands in, if it can."""
        way = None if robot.cell is None else self.way(robot.type, robot.cell, self._homes.get(robot.name))
        if way is None:
            return robot
        kind, metres = self._territory.kinds[robot.type], self._territory.grid.resolution_m
        takes_ms = int(passing_times_ms(way, metres, kind.speed_mps * robot.speed, kind.diagonal)[-1])
        charge = robot.charge
        if kind.battery is not None:
            used_j = kind.power_w(driving=True, speed=robot.speed) * takes_ms / 1000
            charge = max(0.0, (1.0 if charge is None else charge) - used_j / kind.battery.capacity_j)
        return replace(
            robot,
            cell=way[-1],
            free_at_ms=robot.free_at_ms + takes_ms,
            heading=heading_of(way[-2], way[-1]),
            charge=charge,
        )

    def way(self, name: str, cell: Cell, goal: Cell | None = None) -> Route | None:
        """Return the way out of a no-go zone for a robot type, its last cell outside; None if it is in none.

        It leads to the part of the ground where the goal is, if it can.
        """
        if self._zoning is None or self._territory.footprints[name].standable[cell.y, cell.x]:
            return None
        now = self._territory.revision, int(np.count_nonzero(self._zoning.ground != UNKNOWN))
        if now != self._now:  # ground in zones becomes known too
            self._now = now
            self._ways.clear()
        if (name, cell, goal) not in self._ways:
            self._ways[name, cell, goal] = self._found(self._zoning, name, cell, goal)
        return self._ways[name, cell, goal]

    def _found(self, zoning: Zoning, name: str, cell: Cell, goal: Cell | None) -> Route | None:
        """Search the way out, through no zones but those that the robot is in."""
        kind, grid = self._territory.kinds[name], replace(self._territory.grid, cells=zoning.ground)
        if not fits(grid, kind, cell):
            return None
        x, y = (np.array(cell) + self._territory.footprints[name].offsets).T
        closed = np.zeros_like(zoning.barred)
        for polygon_m in zoning.polygons_m:
            mask = covered(grid, polygon_m)
            if not mask[y, x].any():
                closed |= mask
        grid = replace(grid, cells=np.where(closed, np.uint8(OBSTACLE), grid.cells), zoning=None)
        window = self._around(zoning, kind)
        outside = self._territory.footprints[name].standable[window.cut]
        ground = footprint_of(replace(grid, cells=grid.cells[window.cut]), kind).standable
        within = PathSearch(ground & ~outside, kind.diagonal)
        here = Cell(cell.x - window.left, cell.y - window.bottom)
        lengths = np.pad(within.field(here), 1, constant_values=np.inf)
        # the last step is straight, so that no corner is cut
        steps = np.stack([lengths[1:-1, :-2], lengths[1:-1, 2:], lengths[:-2, 1:-1], lengths[2:, 1:-1]])
        nearest = np.where(outside, steps.min(axis=0), np.inf)
        if not np.isfinite(nearest).any():
            return None
        part = self._best_part(name, np.flatnonzero(np.isfinite(nearest)), window, goal)
        column, row = cell_at(int(np.argmin(np.where(part[window.cut], nearest, np.inf))), outside.shape[1])
        dx, dy = ((-1, 0), (1, 0), (0, -1), (0, 1))[int(np.argmin(steps[:, row, column]))]
        route = within.route(here, Cell(column + dx, row + dy))
        assert route is not None, "the field ends where routes end"
        return tuple(Cell(c.x + window.left, c.y + window.bottom) for c in (*route, Cell(column, row)))

    def _best_part(self, name: str, exits: Ints, window: Window, goal: Cell | None) -> Mask:
        """Return the part of the ground (height, width) to leave to: the goal's, or the largest that exits lead to."""
        labels, _ = parts(self._territory.footprints[name].standable)
        able = np.unique(labels[window.cut].ravel()[exits])
        if goal is not None and labels[goal.y, goal.x] in able:
            return labels == labels[goal.y, goal.x]
        sizes = np.bincount(labels.ravel())
        return np.asarray(labels == able[np.argmax(sizes[able])])

    def _around(self, zoning: Zoning, kind: RobotType) -> Window:
        """Return the window of all no-go zones, with a margin in which robots stand outside."""
        y, x = np.nonzero(zoning.barred)
        low, high = Cell(int(x.min()), int(y.min())), Cell(int(x.max()), int(y.max()))
        margin = 2 * int(kind.radius_m / self._territory.grid.resolution_m + 2)
        return Window.around(low, high, margin, zoning.barred.shape)
