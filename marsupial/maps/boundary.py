"""Close a map whose outside is free, so that robots do not explore beyond its walls.

The inside is the convex hull of all obstacles: cells outside it become unknown, and free cells along the hull become
obstacles. A yard between two wings of a building lies in the hull and stays free.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from marsupial.errors import MapError
from marsupial.maps.specks import TOUCHING
from marsupial.model.grid import OBSTACLE, UNKNOWN, Grid


def closed(grid: Grid) -> Grid:
    """Return the map closed along the convex hull of its obstacles; raise MapError if they enclose nothing."""
    from scipy import ndimage
    from skimage.morphology import convex_hull_image

    ys, xs = np.nonzero(grid.cells == OBSTACLE)
    if not len(xs) or np.linalg.matrix_rank(np.column_stack((xs - xs[0], ys - ys[0]))) < 2:
        raise MapError("the obstacles of the map enclose no area, so there is no boundary to draw")
    # half-cell offsets would widen the hull beyond the outermost walls
    outside = ~convex_hull_image(grid.cells == OBSTACLE, offset_coordinates=False)
    inside_rim = ~outside & ndimage.binary_dilation(outside, structure=TOUCHING, border_value=1)
    cells = np.where(outside, UNKNOWN, np.where(inside_rim, OBSTACLE, grid.cells)).astype(np.uint8)
    return replace(grid, cells=cells)
