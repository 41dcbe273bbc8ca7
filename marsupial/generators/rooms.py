"""A building of rooms without corridors, some of them behind doors that only small robots pass.

Walls halve the map until no room is larger than `MOST_ROOM_M`. A random tree of doors joins all rooms; about half of
its leaves get narrow doors (`NARROW_DOOR_M`), which a rover passes and a carrier does not. More doors make loops.
Everything is floor: the footprint, not the terrain, keeps carriers out.
"""

import numpy as np

from marsupial.generators.canvas import NARROW_DOOR_M, WALL_M, Box, CanvasSize, carve, cells_of, door_cells
from marsupial.model.grid import FLOOR, CellArray

LEAST_ROOM_M, MOST_ROOM_M = 4.0, 8.0
NARROW_SHARE = 0.5
EXTRA_DOOR_SHARE = 0.25


def rooms(cells: CellArray, rng: np.random.Generator, size: CanvasSize) -> None:
    """Carve a building of rooms without corridors; about half of the dead ends have a narrow door."""
    building(
        cells, rng, size, least=cells_of(LEAST_ROOM_M, size.resolution_m), most=cells_of(MOST_ROOM_M, size.resolution_m)
    )


def building(cells: CellArray, rng: np.random.Generator, size: CanvasSize, *, least: int, most: int) -> list[Box]:
    """Carve rooms with sides of about `least` to `most` cells and their doors; return the rooms."""
    resolution_m = size.resolution_m
    wall = cells_of(WALL_M, resolution_m)
    height, width = cells.shape
    insides = _split(rng, Box(wall, width - wall, wall, height - wall), wall=wall, least=least, most=most)
    shared = _shared_walls(insides, wall=wall, least=door_cells(resolution_m) + 2)
    tree = _tree(rng, len(insides), sorted(shared))
    narrow = _narrow_rooms(rng, len(insides), tree)
    for inside in insides:
        carve(cells, inside, FLOOR)
    for pair in sorted(shared):
        if pair in tree or rng.random() < EXTRA_DOOR_SHARE:
            small = not narrow.isdisjoint(pair)
            length = cells_of(NARROW_DOOR_M, resolution_m) if small else door_cells(resolution_m)
            carve(cells, _door(rng, shared[pair], wall=wall, length=length), FLOOR)
    return insides


def _split(rng: np.random.Generator, box: Box, *, wall: int, least: int, most: int) -> list[Box]:
    """Halve `box` across its longer side until no side is over `most`; return the rooms."""
    width, height = box.x1 - box.x0, box.y1 - box.y0
    if max(width, height) <= max(most, 2 * least + wall):
        return [box]
    if width >= height:
        at = int(rng.integers(box.x0 + least, box.x1 - least - wall + 1))
        halves = (box._replace(x1=at), box._replace(x0=at + wall))
    else:
        at = int(rng.integers(box.y0 + least, box.y1 - least - wall + 1))
        halves = (box._replace(y1=at), box._replace(y0=at + wall))
    return [room for half in halves for room in _split(rng, half, wall=wall, least=least, most=most)]


def _shared_walls(insides: list[Box], *, wall: int, least: int) -> dict[tuple[int, int], Box]:
    """Return the wall between each pair of rooms that share at least `least` cells of one."""
    found = {}
    for i, a in enumerate(insides):
        for j, b in enumerate(insides):
            y0, y1 = max(a.y0, b.y0), min(a.y1, b.y1)
            x0, x1 = max(a.x0, b.x0), min(a.x1, b.x1)
            if a.x1 + wall == b.x0 and y1 - y0 >= least:
                found[min(i, j), max(i, j)] = Box(a.x1, b.x0, y0, y1)
            elif a.y1 + wall == b.y0 and x1 - x0 >= least:
                found[min(i, j), max(i, j)] = Box(x0, x1, a.y1, b.y0)
    return found


def _tree(rng: np.random.Generator, count: int, pairs: list[tuple[int, int]]) -> set[tuple[int, int]]:
    """Return a random spanning tree of rooms 0..count-1 over `pairs`."""
    # Kruskal's algorithm over pairs in random order: join two groups of rooms that are not connected yet.
    group = list(range(count))
    tree = set()
    for k in rng.permutation(len(pairs)).tolist():
        a, b = pairs[k]
        if group[a] != group[b]:
            tree.add((a, b))
            old, new = group[b], group[a]
            group = [new if g == old else g for g in group]
    return tree


def _narrow_rooms(rng: np.random.Generator, count: int, tree: set[tuple[int, int]]) -> set[int]:
    """Return the rooms to get narrow doors: some of the tree's leaves, so that carriers reach all other rooms."""
    degree = [sum(room in pair for pair in tree) for room in range(count)]
    leaves = [room for room in range(count) if degree[room] == 1]
    if len(leaves) == count:  # two rooms: carriers must be able to start in one
        leaves = leaves[1:]
    chosen = rng.permutation(len(leaves))[: round(len(leaves) * NARROW_SHARE)]
    return {leaves[i] for i in chosen.tolist()}


def _door(rng: np.random.Generator, shared: Box, *, wall: int, length: int) -> Box:
    """Return a door of `length` cells somewhere in a wall, a cell away from its ends."""
    if shared.x1 - shared.x0 == wall and shared.y1 - shared.y0 > wall:
        y0 = int(rng.integers(shared.y0 + 1, shared.y1 - length))
        return shared._replace(y0=y0, y1=y0 + length)
    x0 = int(rng.integers(shared.x0 + 1, shared.x1 - length))
    return shared._replace(x0=x0, x1=x0 + length)
