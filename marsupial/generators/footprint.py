"""Maps on which the footprint alone, not the terrain, keeps carriers out: rovers pass narrow doors and gaps.

Every kind has one size and is drawn by a seed. Rooms have a wide door (`canvas.DOOR_M`) or a narrow one
(`canvas.NARROW_DOOR_M`) by chance::

    partition   rooms by binary space partition          halls    a few halls full of pillars, near or far apart
    turned      the same, turned by `TURN` degrees       spiral   one winding corridor with narrow short cuts
    comb        deep rooms along one corridor            grid     equal rooms back to back between corridors
    cavern      a cave
"""

from collections.abc import Callable, Iterator, Mapping

import numpy as np

from marsupial.generators.canvas import (
    CORRIDOR_M,
    NARROW_DOOR_M,
    WALL_M,
    Box,
    CanvasSize,
    carve,
    cells_of,
    close_border,
    door_cells,
    fill_pockets,
    solid,
)
from marsupial.generators.natural import cave
from marsupial.generators.rooms import building, rooms
from marsupial.model.grid import FLOOR, OBSTACLE, CellArray, Grid

RESOLUTION_M = 0.25
TURN = 25.0

# A turned map is drawn in cells smaller by this: its walls are then two cells thick, and leave no gap as they turn.
TURNED_SCALE = 0.8

NARROW_SHARE = 0.5  # of rooms with narrow doors, and of halls with pillars too near to each other for carriers
TOOTH_M = (3.0, 6.0)  # least and most width of a comb's rooms
GRID_ROOM_M = 4.0
HALL_M = (7.0, 12.0)

# Edge of a pillar, and the gap between two of them where they stand near or far apart.
PILLAR_M, NEAR_M, FAR_M = 0.5, 0.75, 2.5

PASSAGE_M = 1.25  # width along a hall's walls that is left free of pillars
WINDING_M = (1.5, 2.25)  # least and most width of a spiral's corridor
SHORT_CUTS = 6


def turned(cells: CellArray, rng: np.random.Generator, size: CanvasSize) -> None:
    """Carve rooms without corridors whose walls are along no axis."""
    height, width = cells.shape
    side = int(np.hypot(height, width)) + 1
    drawn = np.full((side, side), OBSTACLE, dtype=np.uint8)
    rooms(drawn, rng, size._replace(resolution_m=size.resolution_m * TURNED_SCALE))
    angle = np.radians(TURN)
    y, x = np.indices(cells.shape) - np.array([height, width])[:, None, None] / 2
    at_x = np.round(x * np.cos(angle) + y * np.sin(angle) + side / 2).astype(np.int64)
    at_y = np.round(y * np.cos(angle) - x * np.sin(angle) + side / 2).astype(np.int64)
    cells[:] = drawn[at_y.clip(0, side - 1), at_x.clip(0, side - 1)]
    close_border(cells)
    fill_pockets(cells)


def comb(cells: CellArray, rng: np.random.Generator, size: CanvasSize) -> None:
    """Carve a corridor along the map, and rooms of random widths on both sides of it."""
    wall, corridor = (cells_of(length, size.resolution_m) for length in (WALL_M, CORRIDOR_M))
    height, width = cells.shape
    y0 = (height - corridor) // 2
    carve(cells, Box(wall, width - wall, y0, y0 + corridor), FLOOR)
    least, most = (cells_of(length, size.resolution_m) for length in TOOTH_M)
    for y, rows in (((wall, y0 - wall), (y0 - wall, y0)), ((y0 + corridor + wall, height - wall), None)):
        left = wall
        while left < width - wall:
            right = min(left + int(rng.integers(least, most + 1)), width - wall)
            right = width - wall if width - wall - right < least + wall else right
            door = rows or (y0 + corridor, y0 + corridor + wall)
            _room(cells, rng, Box(left, right, *y), door, size.resolution_m)
            left = right + wall


def cavern(cells: CellArray, rng: np.random.Generator, size: CanvasSize) -> None:
    """Carve a cave that is floor everywhere."""
    cave(cells, rng, size)
    cells[cells != OBSTACLE] = FLOOR


def halls(cells: CellArray, rng: np.random.Generator, size: CanvasSize) -> None:
    """Carve a few large halls with rows of pillars, near to each other or far apart."""
    least, most, pillar, near, far, margin = (
        cells_of(length, size.resolution_m) for length in (*HALL_M, PILLAR_M, NEAR_M, FAR_M, PASSAGE_M)
    )
    for inside in building(cells, rng, size, least=least, most=most):
        pitch = pillar + (near if rng.random() < NARROW_SHARE else far)
        for x in range(inside.x0 + margin, inside.x1 - margin - pillar + 1, pitch):
            for y in range(inside.y0 + margin, inside.y1 - margin - pillar + 1, pitch):
                carve(cells, Box(x, x + pillar, y, y + pillar), OBSTACLE)


def spiral(cells: CellArray, rng: np.random.Generator, size: CanvasSize) -> None:
    """Carve a corridor that winds to the middle; some narrow doors join its windings."""
    wall, least, most = (cells_of(length, size.resolution_m) for length in (WALL_M, *WINDING_M))
    width = int(rng.integers(least, most + 1))
    pitch = width + wall
    x0, x1, y0, y1 = wall, cells.shape[1] - wall, wall, cells.shape[0] - wall
    lead = 0
    while min(x1 - x0, y1 - y0) >= width:
        carve(cells, Box(x0 - lead, x1, y0, y0 + width), FLOOR)
        carve(cells, Box(x1 - width, x1, y0, y1), FLOOR)
        carve(cells, Box(x0, x1, y1 - width, y1), FLOOR)
        if y1 - y0 >= 2 * pitch:
            carve(cells, Box(x0, x0 + width, y0 + pitch, y1), FLOOR)
        x0, x1, y0, y1, lead = x0 + pitch, x1 - pitch, y0 + pitch, y1 - pitch, pitch
    between = list(_between_floor(cells, wall, cells_of(NARROW_DOOR_M, size.resolution_m)))
    for k in rng.permutation(len(between))[:SHORT_CUTS].tolist():
        carve(cells, between[k], FLOOR)
    if rng.random() < 0.5:
        cells[:] = cells[:, ::-1]


def grid(cells: CellArray, rng: np.random.Generator, size: CanvasSize) -> None:
    """Carve corridors along and across the map, and pairs of equal rooms back to back between them."""
    wall, corridor, room = (cells_of(length, size.resolution_m) for length in (WALL_M, CORRIDOR_M, GRID_ROOM_M))
    height, width = cells.shape
    # from below: corridor, room, room, corridor, room, room, corridor
    rows = [*range(wall, height - wall - corridor + 1, 2 * (room + wall) + wall + corridor)]
    for y0 in rows:
        carve(cells, Box(wall, width - wall, y0, y0 + corridor), FLOOR)
    for x0 in (wall, width - wall - corridor):
        carve(cells, Box(x0, x0 + corridor, wall, rows[-1] + corridor), FLOOR)
    left, right = 2 * wall + corridor, width - 2 * wall - corridor
    columns = range(left, right - room + 1, room + wall)
    for below in rows[:-1]:
        low, high = below + corridor + wall, below + corridor + 2 * wall + room
        for x0 in columns:
            x1 = right if x0 == columns[-1] else x0 + room
            _room(cells, rng, Box(x0, x1, low, low + room), (low - wall, low), size.resolution_m)
            _room(cells, rng, Box(x0, x1, high, high + room), (high + room, high + room + wall), size.resolution_m)


def _room(cells: CellArray, rng: np.random.Generator, inside: Box, door: tuple[int, int], resolution_m: float) -> None:
    """Carve a room and, in these rows of wall, its door, which is wide or narrow by chance."""
    length = cells_of(NARROW_DOOR_M, resolution_m) if rng.random() < NARROW_SHARE else door_cells(resolution_m)
    x0 = int(rng.integers(inside.x0 + 1, inside.x1 - length))
    carve(cells, inside, FLOOR)
    carve(cells, Box(x0, x0 + length, *door), FLOOR)


def _between_floor(cells: CellArray, wall: int, length: int) -> Iterator[Box]:
    """Yield the pieces of wall, that many cells long, with floor on both sides."""
    free = cells == FLOOR
    for upright in (False, True):
        lying = free.T if upright else free
        for y, x in np.argwhere(lying[: -wall - 1, :-length] & lying[wall + 1 :, :-length]).tolist():
            sides = lying[[y, y + wall + 1], x : x + length]
            if sides.all() and not lying[y + 1 : y + 1 + wall, x : x + length].any():
                box = (x, x + length, y + 1, y + 1 + wall)
                yield Box(*box[2:], *box[:2]) if upright else Box(*box)


Carve = Callable[[CellArray, np.random.Generator, CanvasSize], None]

FOOTPRINT_MAPS: Mapping[str, tuple[Carve, float, float]] = {
    "partition": (rooms, 36.0, 28.0),
    "turned": (turned, 36.0, 28.0),
    "comb": (comb, 40.0, 18.0),
    "cavern": (cavern, 32.0, 26.0),
    "halls": (halls, 36.0, 28.0),
    "spiral": (spiral, 28.0, 22.0),
    "grid": (grid, 35.5, 36.75),
}
"""Each kind of map: the function that carves it out of solid cells, its width and its height in metres."""


def footprint_map(kind: str, seed: int) -> Grid:
    carver, width_m, height_m = FOOTPRINT_MAPS[kind]
    size = CanvasSize(width_m, height_m, RESOLUTION_M)
    cells = solid(size, seed, (0.0, 0.0))
    carver(cells, np.random.default_rng(seed), size)
    return Grid(cells=cells, resolution_m=RESOLUTION_M)
