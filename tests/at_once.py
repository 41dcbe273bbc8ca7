"""What growing maps find little by little, found at once: what tests hold it to."""

from collections.abc import Iterable, Sequence

import numpy as np

from marsupial.arrays import Floats, Ints
from marsupial.maps.reach import parts
from marsupial.maps.territory import Docking, Reach, Territory, dock_range_cells
from marsupial.model import SQRT2, Cell, Mask, PlacedRobot, RobotType, Role
from marsupial.paths.nearest import Nearest


def flood(mask: Mask, seeds: Iterable[Cell]) -> Mask:
    """Return the mask of all cells connected to a seed within `mask`; seeds outside it count for nothing."""
    height, width = mask.shape
    labels, _ = parts(mask)
    inside = [c for c in seeds if 0 <= c.x < width and 0 <= c.y < height]
    return mask & np.isin(labels, [labels[c.y, c.x] for c in inside])


def grow(passable: Mask, sources: Mask | Sequence[Cell], limit: float) -> tuple[Floats, Ints]:
    """Return each cell's distance (inf) from its nearest source within the limit, and that source's index (-1)."""
    height, width = passable.shape
    if isinstance(sources, np.ndarray):
        indices = np.flatnonzero(sources)
    else:
        inside = [c for c in sources if 0 <= c.x < width and 0 <= c.y < height]
        indices = np.array([c.y * width + c.x for c in inside], dtype=np.int64)
    nearest = Nearest(passable, limit)
    nearest.add(indices)
    origins = nearest.origins(np.arange(passable.size)).reshape(passable.shape)
    steps = nearest._state.steps.reshape(passable.shape)
    half = 4 * steps.itemsize
    distances = SQRT2 * (steps >> half) + (steps & (1 << half) - 1)
    return np.where(origins < 0, np.inf, distances), origins


def reach_at_once(territory: Territory, robots: Sequence[PlacedRobot]) -> Reach:
    """Return what the team can reach from where it is."""
    by_type = {
        kind.name: _connected(territory, kind, [r.cell for r in robots if r.type == kind.name and r.cell is not None])
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
        by_type[rover.name] = _connected(territory, rover, cells + [r.cell for r in mine if r.cell is not None])
    fresh = {name: np.flatnonzero(mask) for name, mask in by_type.items()}
    return Reach(by_type=by_type, fresh=fresh, docking=docking)


def _connected(territory: Territory, kind: RobotType, cells: Iterable[Cell]) -> Mask:
    return flood(territory.footprints[kind.name].standable, cells)


def _docking(territory: Territory, carrier: RobotType, rover: RobotType, reach: Mask) -> Docking:
    limit = dock_range_cells(carrier, rover, territory.grid.resolution_m)
    distance, origin = grow(territory.see_through, reach, limit)
    cells = np.isfinite(distance) & territory.footprints[rover.name].standable
    return Docking(cells=cells, carrier_at=lambda indices: origin.ravel()[indices])
