"""The outline of a set of cells, as rings of cell corners: what GeoJSON calls a multipolygon."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from marsupial.model.grid import Mask

Corner = tuple[int, int]
Ring = list[Corner]

_TURNS = ((1, 0), (0, 1), (-1, 0), (0, -1))


def polygons(mask: Mask) -> list[list[Ring]]:
    """Return the polygons that cover the cells of `mask`: each an outer ring, then its holes.

    Corners are (x, y) with (0, 0) the lower left corner of cell (0, 0). Outer rings run counterclockwise, holes
    clockwise, the first corner is repeated at the end, and only corners where the outline turns are given. Cells that
    touch at a corner only belong to different polygons.
    """
    outer: list[Ring] = []
    holes: list[Ring] = []
    for ring in _rings(_edges(mask)):
        (outer if _area2(ring) > 0 else holes).append(ring)
    found = [[ring] for ring in outer]
    for hole in holes:
        around = [polygon for polygon in found if _is_inside(hole, polygon[0])]
        min(around, key=lambda polygon: _area2(polygon[0])).append(hole)
    return found


def _edges(mask: Mask) -> dict[Corner, list[int]]:
    """Return, for each corner, in which directions the outline goes on, cells to its left."""
    padded = np.pad(mask, 1)
    inner = padded[1:-1, 1:-1]
    edges: dict[Corner, list[int]] = {}
    sides = (
        (padded[:-2, 1:-1], 0, 0, 0),  # below: eastwards along the lower edge
        (padded[1:-1, 2:], 1, 0, 1),  # to the east: northwards
        (padded[2:, 1:-1], 1, 1, 2),  # above: westwards
        (padded[1:-1, :-2], 0, 1, 3),  # to the west: southwards
    )
    for neighbour, dx, dy, direction in sides:
        for y, x in np.argwhere(inner & ~neighbour).tolist():
            edges.setdefault((x + dx, y + dy), []).append(direction)
    return edges


def _rings(edges: dict[Corner, list[int]]) -> list[Ring]:
    rings = []
    while edges:
        start = corner = next(iter(edges))
        heading, walk = edges[start][0], list[tuple[Corner, int]]()
        while not walk or corner != start:
            heading = _take(edges, corner, heading)
            walk.append((corner, heading))
            corner = (corner[0] + _TURNS[heading][0], corner[1] + _TURNS[heading][1])
        headings = [heading, *(one for _, one in walk)]
        ring = [corner for (corner, now), before in zip(walk, headings, strict=False) if now != before]
        rings.append([*ring, ring[0]])
    return rings


def _take(edges: dict[Corner, list[int]], corner: Corner, last: int) -> int:
    """Take the edge on which an outline goes on; where two rings touch it turns left, round the same cell."""
    left = (last + 1) % 4
    heading = left if left in edges[corner] else edges[corner][0]
    edges[corner].remove(heading)
    if not edges[corner]:
        del edges[corner]
    return heading


def _area2(ring: Ring) -> int:
    """Return twice the area, negative for a ring that runs clockwise."""
    return sum(x0 * y1 - x1 * y0 for (x0, y0), (x1, y1) in pairwise(ring))


def _is_inside(hole: Ring, ring: Ring) -> bool:
    """Return whether a hole's first corner, moved half a cell into its cells' side, lies in an outer ring."""
    (x, y), (x1, y1) = hole[0], hole[1]
    dx, dy = np.sign(x1 - x), np.sign(y1 - y)
    px, py = x + 0.5 * dx - 0.5 * dy, y + 0.5 * dy + 0.5 * dx
    crossings = 0
    for (ax, ay), (bx, by) in pairwise(ring):
        if ax == bx and (ay > py) != (by > py) and px < ax:
            crossings += 1
    return crossings % 2 == 1
