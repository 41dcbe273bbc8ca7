"""Draws the map of the tutorial as a laser would have left it: `python docs/tutorial/workshop.py`.

A workshop of 24 x 16 m at 5 cm: a hall with machines, rooms behind doors of 0.9 m, a store behind one of 1.4 m, and
what laser maps have: walls of uneven thickness, specks, a pane of glass that was not seen, ground scanned through it.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from PIL import Image

HERE = Path(__file__).parent
FREE, OCCUPIED, UNKNOWN = 254, 0, 205
CELLS_A_METRE = 20

WALLS = (
    (1, 1, 23, 1), (1, 15, 23, 15), (1, 1, 1, 15), (23, 1, 23, 15),  # outside
    (1, 10, 23, 10), (6, 10, 6, 15), (11, 10, 11, 15), (17, 10, 17, 15),  # rooms in the north
    (16, 1, 16, 7), (16, 7, 23, 7), (16, 4, 23, 4),  # offices in the east
)  # fmt: skip
"""From x, y to x, y in metres, y to the north."""

DOORS = ((3, 10, 0.9), (8, 10, 1.4), (13.5, 10, 0.9), (20, 10, 0.9), (16, 2.5, 0.9), (16, 5.5, 0.9))
"""Middle in metres, and width."""

MACHINES = ((3.5, 3, 2.2, 1.2), (8, 3, 2.2, 1.2), (12.5, 3, 2.2, 1.2), (3.5, 7, 1.2, 2), (9, 6.8, 3, 1))
"""Middle, width and depth in metres."""

GLASS = (1, 5.2, 6.2)
"""x, and from y to y in metres: a pane in the west wall that the laser went through."""


def workshop() -> np.ndarray:
    """Return the map as nav2 reads it: uint8 (height, width), the first row the northernmost."""
    random = np.random.default_rng(7)
    height, width = 17 * CELLS_A_METRE, 26 * CELLS_A_METRE
    image = np.full((height, width), UNKNOWN, dtype=np.uint8)
    _fill(image, 1, 1, 23, 15, FREE)
    for x, y, x2, y2 in WALLS:
        _fill(image, x - 0.075, y - 0.075, x2 + 0.075, y2 + 0.075, OCCUPIED)
    for x, y, wide in DOORS:
        along = (wide / 2, 0.15) if y == 10 else (0.15, wide / 2)
        _fill(image, x - along[0], y - along[1], x + along[0], y + along[1], FREE)
    for x, y, wide, deep in MACHINES:
        _fill(image, x - wide / 2, y - deep / 2, x + wide / 2, y + deep / 2, OCCUPIED)
    x, low, high = GLASS
    _fill(image, x - 0.1, low, x + 0.1, high, FREE)
    _scan_outside(image, x, (low + high) / 2)
    walls = np.argwhere(image == OCCUPIED)
    for row, column in walls[random.random(len(walls)) < 0.03]:  # a cell beside a wall, as noise leaves it
        row, column = row + random.integers(-1, 2), column + random.integers(-1, 2)
        image[row, column] = OCCUPIED if image[row, column] == FREE else image[row, column]
    for row, column in zip(random.integers(0, height, 60), random.integers(0, width, 60), strict=True):
        if image[row, column] == UNKNOWN:
            image[row, column] = FREE
    return image


def _fill(image: np.ndarray, x: float, y: float, x2: float, y2: float, grey: int) -> None:
    """Paint a rectangle given in metres."""
    rows = (image.shape[0] - round(y2 * CELLS_A_METRE), image.shape[0] - round(y * CELLS_A_METRE))
    image[max(rows[0], 0) : rows[1], max(round(x * CELLS_A_METRE), 0) : round(x2 * CELLS_A_METRE)] = grey


def _scan_outside(image: np.ndarray, x: float, y: float) -> None:
    """Free what a laser sees through the pane: a fan to the west, with gaps between far beams."""
    for angle in np.linspace(-0.5, 0.5, 60):
        for metres in np.arange(0, 1.0, 0.03):
            _fill(image, x - metres, y + angle * metres, x - metres + 0.05, y + angle * metres + 0.05, FREE)


if __name__ == "__main__":
    Image.fromarray(workshop()).save(HERE / "workshop.png", optimize=True)
    (HERE / "workshop.yaml").write_text(
        "image: workshop.png\nmode: trinary\nresolution: 0.05\norigin: [0.0, 0.0, 0.0]\nnegate: 0\n"
        "occupied_thresh: 0.65\nfree_thresh: 0.196\n",
        encoding="utf-8",
    )
