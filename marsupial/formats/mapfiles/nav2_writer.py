"""Write a map as nav2's map saver does: a `map.yaml` and a PGM image, in mode trinary.

Greys and thresholds are the saver's: 254 free, 0 occupied, 205 unknown, which every release of nav2 reads back. The
format has no terrain, so all ground is free.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import yaml

from marsupial.model.grid import OBSTACLE, UNKNOWN, Grid

_FREE, _OCCUPIED, _UNKNOWN = 254, 0, 205
_HEADER = {"mode": "trinary", "negate": 0, "occupied_thresh": 0.65, "free_thresh": 0.196}


def nav2_files(grid: Grid, path: Path) -> dict[Path, bytes]:
    """Return the contents of the yaml at `path` and the image beside it, by path."""
    image = path.with_suffix(".pgm")
    grey = np.full(grid.cells.shape, _FREE, dtype=np.uint8)
    grey[grid.cells == OBSTACLE] = _OCCUPIED
    grey[grid.cells == UNKNOWN] = _UNKNOWN
    header = {"image": image.name, "resolution": grid.resolution_m, "origin": list(grid.origin_m), **_HEADER}
    pixels = f"P5\n{grid.width} {grid.height}\n255\n".encode() + np.flipud(grey).tobytes()
    return {image: pixels, path: yaml.safe_dump(header, sort_keys=False).encode()}
