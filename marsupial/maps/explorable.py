"""The ground that a team can eventually explore, given what it sees on its way.

A robot senses cells up to one cell beyond its footprint, so it explores all ground connected to its position. Only
landing ground for rovers may have to be seen from afar: a carrier whose sensor range is below its docking range never
sees that ground. Such ground counts if a robot that searches for it sees it (`marsupial.maps.landings`). On most maps,
carriers can set rovers down where they drive, and no search is needed.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from marsupial.arrays import Ints, Ints32
from marsupial.maps.footprint import Contact, covered
from marsupial.maps.growth import GrowingReach, reach_of
from marsupial.maps.landings import Landings, Looks, roomy
from marsupial.maps.reach import parts
from marsupial.maps.sight import Sight
from marsupial.maps.targets import cell_at
from marsupial.maps.territory import Reach, Territory
from marsupial.model import UNKNOWN, Grid, Mask, PlacedRobot, RobotType, Role


def explorable_area(grid: Grid, kinds: Sequence[RobotType], robots: Sequence[PlacedRobot]) -> Mask:
    """Return the cells (height, width) of the whole map that a team, given at its start, can eventually stand on."""
    truth = grid.solid()
    territory = Territory(truth, kinds)
    whole = reach_of(territory, robots)
    regions = {kind.name: parts(whole.by_type[kind.name])[0] for kind in territory.of_role(Role.ROVER)}
    reached = dict(whole.by_type)
    for name, labels in regions.items():
        reached[name] = _entered(labels, _entrances(territory, whole, robots, name))
        # robots do not search for ground hardly larger than a rover: they find it by chance only
        labels[~(reached[name] | roomy(whole.by_type[name], territory.footprints[name]))] = 0
    if any(np.count_nonzero(reached[name]) < np.count_nonzero(labels) for name, labels in regions.items()):
        explored = _Explored(truth, kinds)
        news = True
        while news:
            explored.enter(reached)
            news = explored.look(reached, _left(whole, reached, regions))
            for name, cells in explored.reach(robots).items():
                if name in regions and (regions[name][cells & ~reached[name]] > 0).any():
                    reached[name] = _entered(regions[name], reached[name] | cells)
                    news = True
    return np.logical_or.reduce(list(reached.values()))


def _left(whole: Reach, reached: Mapping[str, Mask], regions: Mapping[str, Ints32]) -> dict[str, Mask]:
    """Return where rovers could be set down on ground that is not reached yet, by type."""
    left: dict[str, Mask] = {}
    for (_, rover), docking in whole.docking.items():
        left[rover] = left.get(rover, False) | (docking.cells & (regions[rover] > 0) & ~reached[rover])
    return left


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


def _entered(labels: Ints32, cells: Mask) -> Mask:
    """Return the connected parts, by their labels (height, width), that hold some of the cells."""
    numbers = np.unique(labels[cells])
    return np.isin(labels, numbers[numbers > 0])


class _Explored:
    """The known map of a team that drives to all ground it can reach, and looks for ground to set rovers down on."""

    def __init__(self, truth: Grid, kinds: Sequence[RobotType]) -> None:
        self._truth, self._cells = truth, np.full_like(truth.cells, UNKNOWN)
        self._known = Territory(replace(truth, cells=self._cells), kinds)
        self._growing = GrowingReach(self._known)
        self._landings = Landings(self._known, Looks())
        self._sight = Sight(truth.cells, truth.opaque_codes())
        self._contact = {kind.name: Contact(kind, truth.resolution_m) for kind in kinds}
        self._entered = {kind.name: np.zeros(truth.cells.shape, dtype=np.bool_) for kind in kinds}

    def enter(self, reached: Mapping[str, Mask]) -> None:
        for name, cells in reached.items():
            stands = np.flatnonzero(cells & ~self._entered[name])
            self._entered[name].ravel()[stands] = True
            body = self._known.kinds[name].radius_m / self._truth.resolution_m
            self._reveal(np.flatnonzero(covered(stands, body, cells.shape)))

    def look(self, reached: Mapping[str, Mask], landings: Mapping[str, Mask]) -> bool:
        """Look for ground to set rovers down on; return whether there was a cell to look from."""
        looks = [
            (self._known.kinds[name], cell_at(stand, self._truth.width))
            for name, frontier in self._landings.towards(landings, reached).items()
            for stand in frontier.viewpoints.tolist()
        ]
        for kind, cell in looks:
            self._reveal(self._sight.visible(cell, kind.sensor_range_m / self._truth.resolution_m))
            self._reveal(self._contact[kind.name].touched(self._truth.cells, cell))
        return bool(looks)

    def reach(self, robots: Sequence[PlacedRobot]) -> Mapping[str, Mask]:
        """Return what robots of each type can reach on the known map, by name."""
        return self._growing.reach(robots).by_type

    def _reveal(self, cells: Ints) -> None:
        known = self._cells.reshape(-1)
        fresh = cells[known[cells] == UNKNOWN]
        known[fresh] = self._truth.cells.ravel()[fresh]
        self._known.reveal(fresh)
