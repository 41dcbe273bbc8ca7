"""The ground that a team can come to explore, by what it sees on its way.

A robot touches what is one cell beyond its footprint, so it explores all the ground that is connected to where it
stands. Only a rover that is set down may have to be seen from afar: a carrier that sees less far than it docks never
knows the ground beside it. Such ground counts only where some robot that gets there sees it. On most maps rovers can be
set down where carriers drive, and nothing has to be looked at.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from marsupial.arrays import Flags, Ints32
from marsupial.maps.contact import Contact
from marsupial.maps.footprint import disc
from marsupial.maps.growth import GrowingReach, reach_of
from marsupial.maps.reach import parts
from marsupial.maps.sight import Sight
from marsupial.maps.targets import TargetFinder
from marsupial.maps.territory import Reach, Territory
from marsupial.model.grid import UNKNOWN, Cell, Grid, Mask
from marsupial.model.mission import PlacedRobot
from marsupial.model.robots import RobotType, Role


def explorable_area(grid: Grid, kinds: Sequence[RobotType], robots: Sequence[PlacedRobot]) -> Mask:
    """Return the cells (height, width) that some robot of the team can come to stand on in a mission.

    Parameters
    ----------
    grid
        The whole map.
    robots
        The team at its start.
    """
    truth = grid.solid()
    territory = Territory(truth, kinds)
    whole = reach_of(territory, robots)
    regions = {kind.name: parts(whole.by_type[kind.name])[0] for kind in territory.of_role(Role.ROVER)}
    sure = dict(whole.by_type)
    for name, labels in regions.items():
        entered = np.unique(labels[_entrances(territory, whole, robots, name)])
        sure[name] = np.isin(labels, entered[entered > 0])
    if any(np.count_nonzero(sure[name]) < np.count_nonzero(labels) for name, labels in regions.items()):
        sure = _Exploration(truth, territory, robots, whole, regions).explored(sure)
    return np.logical_or.reduce(list(sure.values()))


def _entrances(territory: Territory, reach: Reach, robots: Sequence[PlacedRobot], rover: str) -> Mask:
    """Return where rovers of a type start, and where a carrier that stands on the same cell can set them down."""
    found = np.zeros_like(territory.see_through)
    for robot in robots:
        if robot.type == rover and robot.cell is not None:
            found[robot.cell.y, robot.cell.x] = True
    cell_m, radius_m = territory.grid.resolution_m, territory.kinds[rover].radius_m
    for (carrier, name), docking in reach.docking.items():
        if name == rover and radius_m <= territory.kinds[carrier].radius_m + cell_m:
            found |= docking.cells & reach.by_type[carrier]
    return found


class _Exploration:
    """A team that goes wherever it can, on a map of which it knows nothing at first.

    Parameters
    ----------
    whole
        What it could reach if it knew the whole map.
    regions
        The labels (height, width) of the connected parts of that, by rover type.
    """

    def __init__(
        self,
        truth: Grid,
        territory: Territory,
        robots: Sequence[PlacedRobot],
        whole: Reach,
        regions: Mapping[str, Ints32],
    ) -> None:
        self._truth, self._robots, self._whole, self._regions = truth, robots, whole, regions
        self._kinds = territory.kinds
        self._cells = np.full_like(truth.cells, UNKNOWN)
        self._known = Territory(replace(truth, cells=self._cells), tuple(self._kinds.values()))
        self._growing = GrowingReach(self._known)
        self._finder = TargetFinder(self._known)
        self._farthest = max(kind.sensor_range_m for kind in self._kinds.values()) / truth.resolution_m
        self._sight = Sight(truth.cells, truth.opaque_codes())
        self._contact = {name: Contact(kind, truth.resolution_m) for name, kind in self._kinds.items()}
        self._entered = {name: np.zeros_like(territory.see_through) for name in self._kinds}
        self._looked = {name: np.zeros_like(territory.see_through) for name in self._kinds}

    def explored(self, sure: Mapping[str, Mask]) -> dict[str, Mask]:
        """Return what each type comes to reach, by name, that does reach `sure`."""
        reached, near = self._spread(sure), 1
        while True:
            # most ground is seen from close by; to look from everywhere takes long on a large map
            seen = self._look(reached, near)
            reached = self._spread(self._growing.reach(self._robots).by_type)
            if not seen and near > self._farthest:
                return reached
            near = near if seen else 2 * near

    def _spread(self, reached: Mapping[str, Mask]) -> dict[str, Mask]:
        """Return what a team reaches that has entered an area at all, and let it know that ground."""
        spread = dict(reached)
        for name, labels in self._regions.items():
            parts_in = np.unique(labels[reached[name]])
            spread[name] = np.isin(labels, parts_in[parts_in > 0])
        for name, cells in spread.items():
            entered = cells & ~self._entered[name]
            self._entered[name] |= cells
            self._reveal(_covered(entered, self._kinds[name], self._truth.resolution_m))
        return spread

    def _look(self, reached: Mapping[str, Mask], near: int) -> bool:
        """Look round from where robots go to explore, near places to set rovers down; say whether anything is new."""
        around, seen = np.zeros_like(self._cells, dtype=np.bool_), np.zeros(self._cells.size, dtype=np.bool_)
        for (_, rover), docking in self._whole.docking.items():
            for y, x in np.argwhere(docking.cells & self._whole.by_type[rover] & ~reached[rover]).tolist():
                around[max(0, y - near) : y + near + 1, max(0, x - near) : x + near + 1] = True
        for name, frontier in self._finder.frontiers(self._growing.reach(self._robots)).items():
            going = around & ~self._looked[name]
            fresh = frontier.viewpoints[going.ravel()[frontier.viewpoints]]
            self._looked[name].ravel()[fresh] = True
            range_cells = self._kinds[name].sensor_range_m / self._truth.resolution_m
            for index in fresh.tolist():
                cell = Cell(index % self._truth.width, index // self._truth.width)
                seen[self._sight.visible(cell, range_cells)] = True
                seen[self._contact[name].touched(self._truth.cells, cell)] = True
        return self._reveal(seen)

    def _reveal(self, cells: Flags) -> bool:
        """Let the team know of cells (row-major); say whether any of them is new to it."""
        known = self._cells.reshape(-1)
        fresh = np.flatnonzero(cells & (known == UNKNOWN))
        known[fresh] = self._truth.cells.ravel()[fresh]
        self._known.reveal(fresh)
        return len(fresh) > 0


def _covered(cells: Mask, kind: RobotType, resolution_m: float) -> Flags:
    """Return which cells (row-major) are under the footprints of robots of a type that stand on `cells`."""
    stands, width = np.flatnonzero(cells), cells.shape[1]
    covered = np.zeros(cells.size, dtype=np.bool_)
    for dx, dy in disc(kind.radius_m / resolution_m).tolist():
        covered[stands + dy * width + dx] = True
    return covered
