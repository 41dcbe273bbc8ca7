"""An office building: two corridors with rooms on both sides, after the paper's figure 5 (left).

Two corridors run the length of the building, joined by one cross passage. Rooms lie below, between and above them;
between them some are one room deep with a door to either corridor, the others stand back to back. About half of the
rooms are rough from the door on: rovers only, and some of these have two doors.

References
----------
Wurm et al., Coordinated Exploration with Marsupial Teams of Robots using Temporal Symbolic Planning, section IV-C.
"""

from __future__ import annotations

import numpy as np

from marsupial.generators.canvas import CORRIDOR_M, WALL_M, Box, CanvasSize, carve, cells_of
from marsupial.generators.floorplan import Room, band, columns, furnish, room
from marsupial.model.grid import FLOOR, CellArray


def office(cells: CellArray, rng: np.random.Generator, size: CanvasSize) -> None:
    """Carve an office building with corridors along the map."""
    resolution_m = size.resolution_m
    wall, corridor = cells_of(WALL_M, resolution_m), cells_of(CORRIDOR_M, resolution_m)
    height, width = cells.shape
    left, right = wall, width - wall
    for_rooms = height - 6 * wall - 2 * corridor
    low_top = wall + round(for_rooms * rng.uniform(0.22, 0.28))
    high_bottom = height - wall - round(for_rooms * rng.uniform(0.22, 0.28))
    south = (low_top + wall, low_top + wall + corridor)
    north = (high_bottom - wall - corridor, high_bottom - wall)

    rooms = band(rng, Box(left, right, wall, low_top), (low_top, south[0]), resolution_m)
    rooms += band(rng, Box(left, right, high_bottom, height - wall), (north[1], high_bottom), resolution_m)
    link = left + round((right - left) * rng.uniform(0.35, 0.65)) - corridor // 2
    middle = (south[1] + wall, north[0] - wall)
    for x0, x1 in ((left, link - wall), (link + corridor + wall, right)):
        rooms += _middle(rng, Box(x0, x1, *middle), resolution_m)

    furnish(rng, cells, rooms)
    for box in (Box(left, right, *south), Box(left, right, *north), Box(link, link + corridor, south[1], north[0])):
        carve(cells, box, FLOOR)


def _middle(rng: np.random.Generator, inside: Box, resolution_m: float) -> list[Room]:
    """Fill a block between the corridors: every third column or so one deep room, the others back to back."""
    wall = cells_of(WALL_M, resolution_m)
    half = (inside.y0 + inside.y1 - wall) // 2
    below, above = (inside.y0 - wall, inside.y0), (inside.y1, inside.y1 + wall)
    spans = columns(rng, inside.x0, inside.x1, resolution_m)
    deep = set(rng.permutation(len(spans))[: (len(spans) + 2) // 3].tolist())
    rooms = []
    for i, (x0, x1) in enumerate(spans):
        if i in deep:
            rooms.append(room(rng, Box(x0, x1, inside.y0, inside.y1), (below, above), resolution_m))
        else:
            rooms.append(room(rng, Box(x0, x1, inside.y0, half), (below,), resolution_m))
            rooms.append(room(rng, Box(x0, x1, half + wall, inside.y1), (above,), resolution_m))
    return rooms
