"""Meeting points on the whole map: those that missions use, and more, spread over all ground where docking works."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from marsupial.maps.meetings import find_meetings
from marsupial.model.mission import MapMeeting
from marsupial.strategies.clairvoyant.ground import Ground
from marsupial.strategies.clairvoyant.outline import Stop

APART_M, MOST = 8.0, 40
"""Least distance between additional meeting points, and their greatest number per pair of types."""


def doors(ground: Ground, stops: Sequence[Stop]) -> tuple[MapMeeting, ...]:
    """Return meeting points for robots that go to these stops, and add their cells to the sites."""
    targets = [stop.target for stop in stops]
    points = list(find_meetings(ground.territory, ground.reach, targets, ground.robots).points)
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
