"""Finds stops from which a team sees everything, by a randomised greedy set cover, and meeting points for them.

The meeting points are those that missions use, and others spread over all ground where docking is possible.

References
----------
D. S. Johnson, Approximation algorithms for combinatorial problems, Journal of Computer and System Sciences 9, 1974.
"""

import heapq
from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from marsupial.maps.meetings import find_meetings
from marsupial.maps.targets import Target
from marsupial.model import Cell, MapMeeting
from marsupial.strategies.clairvoyant.ground import NOTHING, CellSet, Ground

NEAR = 60  # number of nearby sites searched for one from which another robot type sees the same cells
APART_M, MOST = 8.0, 40  # least distance between additional meeting points, and their greatest number per pair of types


def cover(ground: Ground, worth: Mapping[str, float], noise: float, rng: np.random.Generator) -> Iterator[Target]:
    """Yield stops from which all wanted cells are seen; sites' values are `worth` per cell, with some `noise`."""
    sites = [(kind, int(index)) for kind in ground.kinds for index in ground.sites[kind]]
    views = [view for kind in ground.kinds for view in ground.site_views(kind)]
    factors = [
        worth[kind] * (1 + noise * share) for (kind, _), share in zip(sites, rng.random(len(sites)), strict=True)
    ]
    heap = [(-factors[i] * view.bit_count(), i) for i, view in enumerate(views) if view]
    heapq.heapify(heap)
    left, count = ground.wanted, 0
    while left and heap:
        _, i = heapq.heappop(heap)
        gain = -factors[i] * (views[i] & left).bit_count()
        # gains only shrink as cells are covered: a stale entry is pushed back with its present gain
        if heap and gain > heap[0][0]:
            if gain:
                heapq.heappush(heap, (gain, i))
            continue
        kind, index = sites[i]
        yield stop_at(ground, f"c_{count}", kind, ground.cell(index), views[i] & left)
        left &= ~views[i]
        count += 1


def stop_at(ground: Ground, name: str, kind: str, cell: Cell, cells: CellSet) -> Target:
    """Return a stop at a site of one type; other types stop at their nearest site that sees the same cells."""
    viewpoints = {kind: cell}
    for other in ground.kinds:
        found = None if other == kind else _nearest_seeing(ground, other, cell, cells)
        if found is not None:
            viewpoints[other] = found
    return Target(name=name, cell=cell, viewpoints=viewpoints, cells=NOTHING, reveal_m2=0.0)


def _nearest_seeing(ground: Ground, kind: str, cell: Cell, cells: CellSet) -> Cell | None:
    sites, views = ground.sites[kind], ground.site_views(kind)
    apart = np.hypot(sites % ground.width - cell.x, sites // ground.width - cell.y)
    near = np.argsort(apart, kind="stable")[:NEAR].tolist()
    return next((ground.cell(sites[n]) for n in near if cells & views[n] == cells), None)


def doors(ground: Ground, stops: Sequence[Target]) -> tuple[MapMeeting, ...]:
    """Return meeting points for robots that go to these stops, and add their cells to the sites."""
    points = list(find_meetings(ground.territory, ground.reach, stops, ground.robots).points)
    for number, (carrier, rover) in enumerate(sorted(ground.reach.docking)):
        if carrier in ground.kinds and rover in ground.kinds:
            points += _spread(ground, carrier, rover, points, number)
    for kind in ground.kinds:
        cells = [p.carrier_cell for p in points if p.carrier_type == kind]
        cells += [p.rover_cell for p in points if p.rover_type == kind]
        cells += [r.cell for r in ground.robots if r.type == kind and r.cell is not None]
        ground.add_sites(kind, cells)
    return tuple(points)


def _spread(ground: Ground, carrier: str, rover: str, points: Sequence[MapMeeting], number: int) -> list[MapMeeting]:
    docking = ground.reach.docking[carrier, rover]
    cells = np.flatnonzero(docking.cells & ground.reach.by_type[rover])
    x, y = cells % ground.width, cells // ground.width
    apart = np.full(len(cells), np.inf)
    for point in points:
        apart = np.minimum(apart, np.hypot(x - point.rover_cell.x, y - point.rover_cell.y))
    found: list[MapMeeting] = []
    # farthest-point sampling: repeatedly the cell that is farthest from all meeting points so far
    while len(found) < MOST and len(cells):
        n = int(np.argmax(apart))
        if apart[n] * ground.territory.grid.resolution_m < APART_M:
            break
        here, there = ground.cell(cells[n]), ground.cell(int(docking.carrier_at(cells[n : n + 1])[0]))
        apart = np.minimum(apart, np.hypot(x - here.x, y - here.y))
        found.append(
            MapMeeting(
                name=f"w_{here.x}_{here.y}_{number + 1}",
                carrier_cell=there,
                rover_cell=here,
                carrier_type=carrier,
                rover_type=rover,
            )
        )
    return found
