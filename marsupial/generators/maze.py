"""A maze of corridors around a large rough centre, after the paper's figure 5 (right).

The map is divided into squares. Those in the middle are rough, the ring around them is floor. In each part a random
spanning tree of passages connects all squares; then further walls are removed: few in the ring, which stays a maze with
some loops, many in the centre, which becomes open ground with inner walls. The openings on every side of the centre are
the places to set rovers down and pick them up.
"""

from collections.abc import Iterable
from itertools import product

import numpy as np

from marsupial.generators.canvas import WALL_M, Box, CanvasSize, carve, cells_of
from marsupial.model.grid import FLOOR, OBSTACLE, ROUGH, CellArray

PITCH_M = 3.1
OPENING_M = 1.5
OPENINGS_PER_SIDE = 2
RING_LOOPS, CENTRE_LOOPS = 0.12, 0.3

MazeSquare = tuple[int, int]
Passage = tuple[MazeSquare, MazeSquare]  # two neighbouring squares (column, row), the lower or left one first


def maze(cells: CellArray, rng: np.random.Generator, size: CanvasSize) -> None:
    """Carve a maze of corridors around a rough centre with openings on its four sides."""
    resolution_m = size.resolution_m
    columns, rows = round(size.width_m / PITCH_M), round(size.height_m / PITCH_M)
    squares = {(i, j) for i in range(columns) for j in range(rows)}
    centre = {(i, j) for i, j in squares if _is_middle(i, columns) and _is_middle(j, rows)}
    drawing = _MazeDrawing(cells.shape, columns=columns, rows=rows, wall=cells_of(WALL_M, resolution_m))
    for part, code, loops in ((squares - centre, FLOOR, RING_LOOPS), (centre, ROUGH, CENTRE_LOOPS)):
        for square in sorted(part):
            carve(cells, drawing.inside(square), code)
        for passage in _passages(rng, part, loops=loops):
            carve(cells, drawing.between(passage), code)
    drawing.remove_posts(cells)
    width = cells_of(OPENING_M, resolution_m, least=3)
    for passage in _openings(rng, squares, centre):
        carve(cells, _part_of(rng, drawing.between(passage), passage, width=width), ROUGH)


class _MazeDrawing:
    """The boxes of squares, and of the walls between them, on the grid."""

    def __init__(self, shape: tuple[int, ...], *, columns: int, rows: int, wall: int) -> None:
        self.wall = wall
        self.x: list[int] = np.round(np.linspace(0, shape[1] - wall, columns + 1)).astype(int).tolist()
        self.y: list[int] = np.round(np.linspace(0, shape[0] - wall, rows + 1)).astype(int).tolist()

    def inside(self, square: MazeSquare) -> Box:
        """Return the cells of a square without its walls."""
        i, j = square
        return Box(self.x[i] + self.wall, self.x[i + 1], self.y[j] + self.wall, self.y[j + 1])

    def between(self, passage: Passage) -> Box:
        """Return the wall between two neighbouring squares, without its ends."""
        first, second = (self.inside(square) for square in passage)
        if first.x0 == second.x0:
            return Box(first.x0, first.x1, first.y1, second.y0)
        return Box(first.x1, second.x0, first.y0, first.y1)

    def remove_posts(self, cells: CellArray) -> None:
        """Remove the crossings of walls at which no wall is left."""
        for x, y in product(self.x[1:-1], self.y[1:-1]):
            post = Box(x, x + self.wall, y, y + self.wall)
            around = cells[y - 1 : post.y1 + 1, x - 1 : post.x1 + 1]
            if np.count_nonzero(around == OBSTACLE) == post.area:
                carve(cells, post, int(around[0, 0]))


def _is_middle(i: int, count: int) -> bool:
    return count / 4 <= i + 0.5 <= count * 3 / 4


def _around(square: MazeSquare) -> tuple[MazeSquare, ...]:
    i, j = square
    return (i + 1, j), (i - 1, j), (i, j + 1), (i, j - 1)


def _neighbours(squares: Iterable[MazeSquare], others: set[MazeSquare]) -> list[Passage]:
    """Return the pairs of a square in `squares` and a neighbour in `others`, the lower or left one first."""
    pairs = ((square, other) for square in squares for other in _around(square) if other in others)
    return sorted({(min(pair), max(pair)) for pair in pairs})


def _passages(rng: np.random.Generator, squares: set[MazeSquare], *, loops: float) -> list[Passage]:
    """Return the passages of a random spanning tree of `squares`, and a share `loops` of the others."""
    # Depth-first search with random neighbours: it makes long corridors, where Kruskal's trees have short branches.
    tree: set[Passage] = set()
    start = min(squares)
    path, seen = [start], {start}
    while path:
        fresh = [other for other in _around(path[-1]) if other in squares and other not in seen]
        if not fresh:
            path.pop()
            continue
        chosen = fresh[int(rng.integers(len(fresh)))]
        tree.add((min(path[-1], chosen), max(path[-1], chosen)))
        seen.add(chosen)
        path.append(chosen)
    return [pair for pair in _neighbours(squares, squares) if pair in tree or rng.random() < loops]


def _openings(rng: np.random.Generator, squares: set[MazeSquare], centre: set[MazeSquare]) -> list[Passage]:
    """Return the openings in the centre's border: `OPENINGS_PER_SIDE` on each side."""
    sides: dict[tuple[bool, int], list[Passage]] = {}
    for first, second in _neighbours(centre, squares - centre):
        upright = first[1] == second[1]
        sides.setdefault((upright, first[0] if upright else first[1]), []).append((first, second))
    return [
        pairs[i]
        for _, pairs in sorted(sides.items())
        for i in sorted(rng.permutation(len(pairs))[:OPENINGS_PER_SIDE].tolist())
    ]


def _part_of(rng: np.random.Generator, wall: Box, passage: Passage, *, width: int) -> Box:
    if passage[0][0] == passage[1][0]:
        x0 = int(rng.integers(wall.x0, wall.x1 - width + 1))
        return wall._replace(x0=x0, x1=x0 + width)
    y0 = int(rng.integers(wall.y0, wall.y1 - width + 1))
    return wall._replace(y0=y0, y1=y0 + width)
