"""What the team can reach, updated while the map grows.

Known cells never change, so areas only grow, from newly passable cells, and the cost of an update depends on the new
cells only. A lost robot resets everything. When a rover goes aboard, the area that only it could reach is removed.
"""

from collections.abc import Sequence

import numpy as np

from marsupial.arrays import Ints, Ints32
from marsupial.maps.reach import spread
from marsupial.maps.territory import Docking, Reach, Territory, dock_range_cells
from marsupial.model import Mask, PlacedRobot, RobotType, Role
from marsupial.model.seats import most_aboard
from marsupial.native import native
from marsupial.paths.nearest import Nearest

_NONE: Ints = np.empty(0, dtype=np.int64)


def reach_of(territory: Territory, robots: Sequence[PlacedRobot]) -> Reach:
    """Return what the team can reach on the present map."""
    return GrowingReach(territory).reach(robots)


class GrowingReach:
    """The reach of one team that drives and docks on one growing map; the owner of the territory updates it."""

    def __init__(self, territory: Territory) -> None:
        self._territory = territory
        self._names: frozenset[str] | None = None  # of the team; the first call of `reach` begins

    def _begin(self, names: frozenset[str]) -> None:
        territory = self._territory
        self._names = names
        self._standing: dict[str, int] = {}
        self._opened = {name: footprint.opened.reader() for name, footprint in territory.footprints.items()}
        self._cleared = territory.cleared.reader()
        kinds = (*territory.of_role(Role.CARRIER), *territory.of_role(Role.ROVER))
        self._areas = {kind.name: _Area(territory.footprints[kind.name].standable) for kind in kinds}
        self._docks = {
            (carrier.name, rover.name): _Dock(territory, carrier, rover)
            for carrier in territory.of_role(Role.CARRIER)
            for rover in territory.of_role(Role.ROVER)
            if most_aboard(carrier, rover.name)
        }

    def reach(self, robots: Sequence[PlacedRobot]) -> Reach:
        """Return what the team can reach: live masks, which change with the next call, and their new cells."""
        names = frozenset(robot.name for robot in robots)
        if names != self._names:
            self._begin(names)
        width = self._territory.grid.width
        standing = {robot.name: robot.cell.y * width + robot.cell.x for robot in robots if robot.cell is not None}
        left = {name: cell for name, cell in self._standing.items() if name not in standing}
        self._standing = standing
        opened = {name: reader.cells() for name, reader in self._opened.items()}
        cleared = self._cleared.cells()
        territory = self._territory
        fresh = {}
        for carrier in territory.of_role(Role.CARRIER):
            starts = self._starts(carrier, robots)
            fresh[carrier.name] = self._areas[carrier.name].grow(starts, opened[carrier.name])
        for rover in territory.of_role(Role.ROVER):
            area = self._areas[rover.name]
            docks = [dock for (_, name), dock in self._docks.items() if name == rover.name]
            for robot in robots:
                if robot.type == rover.name and robot.name in left:
                    area.give_up(left[robot.name], [dock.docking.cells for dock in docks])
            landings = [dock.grow(fresh[dock.carrier], cleared, opened[rover.name]) for dock in docks]
            starts = np.concatenate([self._starts(rover, robots), *landings])
            fresh[rover.name] = _NONE
            if any(robot.type == rover.name for robot in robots):
                fresh[rover.name] = area.grow(starts, opened[rover.name])
        return Reach(
            by_type={name: area.cells for name, area in self._areas.items()},
            fresh=fresh,
            docking={pair: dock.docking for pair, dock in self._docks.items()},
        )

    def _starts(self, kind: RobotType, robots: Sequence[PlacedRobot]) -> Ints:
        cells = [self._standing[r.name] for r in robots if r.type == kind.name and r.name in self._standing]
        return np.array(cells, dtype=np.int64)


class _Area:
    """The cells where a type may stand that are connected to some starts."""

    def __init__(self, allowed: Mask) -> None:
        self._allowed = allowed
        self._queue = np.empty(allowed.size, dtype=np.int32)
        self.cells: Mask = np.zeros_like(allowed)

    def give_up(self, start: int, landings: Sequence[Mask]) -> None:
        """Remove the part around a former start from the area, unless a landing is in it."""
        if self.cells.flat[start] and not any(cells.flat[start] for cells in landings):
            self._queue[0] = start
            marks = np.zeros_like(self.cells)
            marks.flat[start] = True
            part = self._queue[: spread(self.cells, marks, True, self._queue, 1)]
            if not any(cells.ravel()[part].any() for cells in landings):
                self.cells.ravel()[part] = False

    def grow(self, starts: Ints, opened: Ints) -> Ints:
        """Add starts and newly allowed cells; return the cells new to the area."""
        count = _grow(self._allowed, starts, opened, self.cells, self._queue)
        return self._queue[:count].astype(np.int64)


class _Dock:
    """Where one rover type may stand to dock with one carrier type."""

    def __init__(self, territory: Territory, carrier: RobotType, rover: RobotType) -> None:
        self.carrier = carrier.name
        limit = dock_range_cells(carrier, rover, territory.grid.resolution_m)
        # carriers and rovers may stand on cells that the other role can't drive on
        self._nearest = Nearest(territory.see_through, limit)
        self._standable = territory.footprints[rover.name].standable
        self.docking = Docking(cells=np.zeros_like(self._standable), carrier_at=self._nearest.origins)

    def grow(self, carrier_cells: Ints, seen: Ints, opened: Ints) -> Ints:
        """Add newly reached carrier cells, see-through cells and standable cells; return new docking cells."""
        changed = np.concatenate([self._nearest.add(carrier_cells, seen), opened])
        cells = self.docking.cells.ravel()
        fresh = changed[(self._nearest.origins(changed) >= 0) & self._standable.ravel()[changed] & ~cells[changed]]
        cells[fresh] = True
        return fresh


@native
def _grow(allowed: Mask, starts: Ints, opened: Ints, out: Mask, queue: Ints32) -> int:
    """Grow the area `out` (height, width), see `_Area.grow`; write the new cells to `queue` and return their number."""
    height, width = allowed.shape
    tail = 0
    for start in starts:
        y, x = start // width, start % width
        if allowed[y, x] and not out[y, x]:
            out[y, x] = True
            queue[tail] = start
            tail += 1
    for index in opened:
        y, x = index // width, index % width
        beside = (
            (x > 0 and out[y, x - 1])
            or (x + 1 < width and out[y, x + 1])
            or (y > 0 and out[y - 1, x])
            or (y + 1 < height and out[y + 1, x])
        )
        if beside and not out[y, x]:
            out[y, x] = True
            queue[tail] = index
            tail += 1
    return int(spread(allowed, out, True, queue, tail))
