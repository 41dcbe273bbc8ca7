"""Rooms in bands along corridors, the stuff that office buildings are made of.

A band is a row of rooms of random widths between two walls; each room gets a door into the corridor on one side, on
both sides, or two doors into the same corridor. Afterwards some of the rooms become rough, for rovers only: half of
those with one door and half of those with two, so that both kinds occur.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from marsupial.generators.canvas import WALL_M, Box, carve, cells_of, door_cells
from marsupial.model.grid import FLOOR, ROUGH, CellArray

MEAN_ROOM_M = 5.5
SECOND_DOOR_SHARE = 0.25


Rows = tuple[int, int]
"""Rows y0 <= y < y1 of a wall."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Room:
    """A room's inside and its doors: boxes in the wall."""

    inside: Box
    doors: tuple[Box, ...]


def columns(rng: np.random.Generator, start: int, stop: int, resolution_m: float) -> list[tuple[int, int]]:
    """Cut ``start..stop`` into random spans of about `MEAN_ROOM_M` with walls between, none under half of that."""
    wall, mean = cells_of(WALL_M, resolution_m), cells_of(MEAN_ROOM_M, resolution_m)
    count = max(1, round((stop - start + wall) / (mean + wall)))
    weights = rng.uniform(0.75, 1.25, count)
    ends = np.round(np.cumsum(weights) / weights.sum() * (stop - start - wall * (count - 1))).astype(int).tolist()
    starts = [0, *ends[:-1]]
    return [(start + starts[i] + i * wall, start + ends[i] + i * wall) for i in range(count)]


def room(rng: np.random.Generator, inside: Box, walls: tuple[Rows, ...], resolution_m: float) -> Room:
    """Return a room with a door in each of `walls`, or two in one where the room is wide and chance wants it."""
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


def band(rng: np.random.Generator, inside: Box, wall: Rows, resolution_m: float) -> list[Room]:
    """Fill `inside` with a row of rooms, each with its door in `wall`."""
    return [
        room(rng, Box(x0, x1, inside.y0, inside.y1), (wall,), resolution_m)
        for x0, x1 in columns(rng, inside.x0, inside.x1, resolution_m)
    ]


def furnish(rng: np.random.Generator, cells: CellArray, rooms: list[Room]) -> None:
    """Carve the rooms and their doors; half of those with one door and half of the others become rough."""
    rough: set[Room] = set()
    for many in (False, True):
        kind = [room for room in rooms if (len(room.doors) > 1) is many]
        rough.update(kind[i] for i in rng.permutation(len(kind))[: (len(kind) + 1) // 2])
    for room in rooms:
        for box in (room.inside, *room.doors):
            carve(cells, box, ROUGH if room in rough else FLOOR)
