"""Office buildings and a lobby: rooms in bands along corridors, about half of them for rovers only.

A *band* is a row of rooms of random widths between two walls. Each room gets a door into the corridor on one side, one
on either side, or two into the same corridor. At the end half of the rooms with one door and half of the others become
rough, so that both kinds occur. An office building, after the paper's figure 5 (left):

::

    ┌────┬──┬───┬─────┬───┐
    │    │  │   │     │   │  band
    ├─ ──┴ ─┴─ ─┴── ──┴─ ─┤
    │      corridor       │
    ├ ──┬─ ─┐   ┌── ─┬─ ──┤
    │   │   │   │    ├────┤  some rooms are one room deep with a door to either corridor,
    │   ├───┤ c │    │    │  the others stand back to back; c is the cross passage
    ├ ──┴─ ─┘   └── ─┴─ ──┤
    │      corridor       │
    ├─ ──┬ ──┬── ──┬─ ────┤
    │    │   │     │      │  band
    └────┴───┴─────┴──────┘

A lobby has one corridor, its hall, between two bands.

References: Wurm et al. 2010, section IV-C (see `marsupial.papers.wurm2010`).
"""

from dataclasses import dataclass

import numpy as np

from marsupial.generators.canvas import CORRIDOR_M, WALL_M, Box, CanvasSize, carve, cells_of, door_cells
from marsupial.model.grid import FLOOR, ROUGH, CellArray

HALL_M = 3.0
MEAN_ROOM_M = 5.5
SECOND_DOOR_SHARE = 0.25

WallRows = tuple[int, int]  # rows y0 <= y < y1 of a wall


@dataclass(frozen=True, slots=True, kw_only=True)
class Room:
    """A room's inside and its doors: boxes in the wall."""

    inside: Box
    doors: tuple[Box, ...]


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

    rooms = _band(rng, Box(left, right, wall, low_top), (low_top, south[0]), resolution_m)
    rooms += _band(rng, Box(left, right, high_bottom, height - wall), (north[1], high_bottom), resolution_m)
    link = left + round((right - left) * rng.uniform(0.35, 0.65)) - corridor // 2
    middle = (south[1] + wall, north[0] - wall)
    for x0, x1 in ((left, link - wall), (link + corridor + wall, right)):
        rooms += _middle(rng, Box(x0, x1, *middle), resolution_m)

    _furnish(rng, cells, rooms)
    for box in (Box(left, right, *south), Box(left, right, *north), Box(link, link + corridor, south[1], north[0])):
        carve(cells, box, FLOOR)


def lobby(cells: CellArray, rng: np.random.Generator, size: CanvasSize) -> None:
    """Carve a hall with rooms below and above it."""
    resolution_m = size.resolution_m
    wall, hall = cells_of(WALL_M, resolution_m), cells_of(HALL_M, resolution_m)
    height, width = cells.shape
    low_top = (height - 4 * wall - hall) // 2 + wall
    bottom, top = low_top + wall, low_top + wall + hall
    rooms = _band(rng, Box(wall, width - wall, wall, low_top), (low_top, bottom), resolution_m)
    rooms += _band(rng, Box(wall, width - wall, top + wall, height - wall), (top, top + wall), resolution_m)
    _furnish(rng, cells, rooms)
    carve(cells, Box(wall, width - wall, bottom, top), FLOOR)


def _middle(rng: np.random.Generator, inside: Box, resolution_m: float) -> list[Room]:
    """Fill a block between the corridors: about a third of its columns with one deep room, the others back to back."""
    wall = cells_of(WALL_M, resolution_m)
    half = (inside.y0 + inside.y1 - wall) // 2
    below, above = (inside.y0 - wall, inside.y0), (inside.y1, inside.y1 + wall)
    spans = _columns(rng, inside.x0, inside.x1, resolution_m)
    deep = set(rng.permutation(len(spans))[: (len(spans) + 2) // 3].tolist())
    rooms = []
    for i, (x0, x1) in enumerate(spans):
        if i in deep:
            rooms.append(_room(rng, Box(x0, x1, inside.y0, inside.y1), (below, above), resolution_m))
        else:
            rooms.append(_room(rng, Box(x0, x1, inside.y0, half), (below,), resolution_m))
            rooms.append(_room(rng, Box(x0, x1, half + wall, inside.y1), (above,), resolution_m))
    return rooms


def _columns(rng: np.random.Generator, start: int, stop: int, resolution_m: float) -> list[tuple[int, int]]:
    """Cut ``start..stop`` into random spans of about `MEAN_ROOM_M`, at least half of it, with walls between."""
    wall, mean = cells_of(WALL_M, resolution_m), cells_of(MEAN_ROOM_M, resolution_m)
    count = max(1, round((stop - start + wall) / (mean + wall)))
    weights = rng.uniform(0.75, 1.25, count)
    ends = np.round(np.cumsum(weights) / weights.sum() * (stop - start - wall * (count - 1))).astype(int).tolist()
    starts = [0, *ends[:-1]]
    return [(start + starts[i] + i * wall, start + ends[i] + i * wall) for i in range(count)]


def _room(rng: np.random.Generator, inside: Box, walls: tuple[WallRows, ...], resolution_m: float) -> Room:
    """Return a room with a door in each of `walls`; a wide room may get two in a wall by chance."""
    width = door_cells(resolution_m)
    doors = []
    for rows in walls:
        halves = [(inside.x0, inside.x1)]
        if inside.x1 - inside.x0 >= 5 * width and rng.random() < SECOND_DOOR_SHARE:
            middle = (inside.x0 + inside.x1) // 2
            halves = [(inside.x0, middle), (middle, inside.x1)]
        for x0, x1 in halves:
            left = int(rng.integers(x0 + 1, x1 - width))
            doors.append(Box(left, left + width, *rows))
    return Room(inside=inside, doors=tuple(doors))


def _band(rng: np.random.Generator, inside: Box, wall: WallRows, resolution_m: float) -> list[Room]:
    """Fill `inside` with a row of rooms, each with its door in `wall`."""
    return [
        _room(rng, Box(x0, x1, inside.y0, inside.y1), (wall,), resolution_m)
        for x0, x1 in _columns(rng, inside.x0, inside.x1, resolution_m)
    ]


def _furnish(rng: np.random.Generator, cells: CellArray, rooms: list[Room]) -> None:
    """Carve the rooms and their doors; half of those with one door and half of the others become rough."""
    rough: set[Room] = set()
    for many in (False, True):
        kind = [room for room in rooms if (len(room.doors) > 1) is many]
        rough.update(kind[i] for i in rng.permutation(len(kind))[: (len(kind) + 1) // 2])
    for room in rooms:
        for box in (room.inside, *room.doors):
            carve(cells, box, ROUGH if room in rough else FLOOR)
