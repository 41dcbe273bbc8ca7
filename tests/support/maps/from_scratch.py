"""Map analysis from scratch, the reference for incremental analysis."""

from collections.abc import Iterable, Sequence

import numpy as np

from marsupial.arrays import Ints
from marsupial.maps.reach import parts
from marsupial.maps.territory import Docking, Reach, Territory, dock_range_cells
from marsupial.model import Cell, Mask, PlacedRobot, RobotType, Role
from marsupial.paths.nearest import Nearest


def flood(mask: Mask, seeds: Iterable[Cell]) -> Mask:
    """Return the mask of all cells connected to a seed within `mask`; seeds outside it are ignored."""
    labels, _ = parts(mask)
    return mask & np.isin(labels, [labels[c.y, c.x] for c in seeds])


def nearest_sources(passable: Mask, sources: Mask, limit: float) -> Ints:
    """Return the index of each cell's nearest source within the limit (height, width), -1 for none."""
    nearest = Nearest(passable, limit)
    nearest.add(np.flatnonzero(sources))
    return nearest.origins(np.arange(passable.size)).reshape(passable.shape)


def reach_from_scratch(territory: Territory, robots: Sequence[PlacedRobot]) -> Reach:
    """Return the reach of the team from its current places."""
    standable = {name: footprint.standable for name, footprint in territory.footprints.items()}
    by_type = {
        kind.name: flood(standable[kind.name], [r.cell for r in robots if r.type == kind.name and r.cell is not None])
        for kind in territory.of_role(Role.CARRIER)
    }
    docking = {
        (carrier.name, rover.name): _docking(territory, carrier, rover, by_type[carrier.name])
        for carrier in territory.of_role(Role.CARRIER)
        for rover in territory.of_role(Role.ROVER)
        if carrier.capacity > 0
    }
    for rover in territory.of_role(Role.ROVER):
        mine = [r for r in robots if r.type == rover.name]
        docks = [d.cells for (_, name), d in docking.items() if name == rover.name] if mine else []
        cells = [Cell(int(x), int(y)) for mask in docks for y, x in np.argwhere(mask)]
        by_type[rover.name] = flood(standable[rover.name], cells + [r.cell for r in mine if r.cell is not None])
    fresh = {name: np.flatnonzero(mask) for name, mask in by_type.items()}
    return Reach(by_type=by_type, fresh=fresh, docking=docking)


def _docking(territory: Territory, carrier: RobotType, rover: RobotType, reach: Mask) -> Docking:
    limit = dock_range_cells(carrier, rover, territory.grid.resolution_m)
    origin = nearest_sources(territory.see_through, reach, limit)
    cells = (origin >= 0) & territory.footprints[rover.name].standable
    return Docking(cells=cells, carrier_at=lambda indices: origin.ravel()[indices])
