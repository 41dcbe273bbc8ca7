"""A world of cells: open ground with obstacles of a single cell each, scattered at random.

References
----------
Al-Khawaldah, Livatino, Lee: Frontier-based Exploration with Two Cooperating Mobile Robots, section II; Mei, Lu, Lee and
Hu: Energy-Efficient Mobile Robot Exploration, ICRA 2006, section V-A.
"""

from __future__ import annotations

import numpy as np

from marsupial.model.grid import FLOOR, OBSTACLE, Grid


def scattered(columns: int, rows: int, obstacles: int, seed: int) -> Grid:
    """Return a map of so many cells of 1 m, that many of them obstacles; what lies outside counts as one anyway."""
    cells = np.full((rows, columns), FLOOR, dtype=np.uint8)
    cells.ravel()[np.random.default_rng(seed).choice(cells.size, obstacles, replace=False)] = OBSTACLE
    return Grid(cells=cells, resolution_m=1.0)
