"""Write a map as nav2's map saver does: a `map.yaml` beside a PGM image, mode trinary.

Greys and thresholds are the saver's: 254 free, 0 occupied, 205 unknown, read back as such by every release of nav2.
The format knows no terrain, so ground of any class is free.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import yaml

from marsupial.model.grid import OBSTACLE, UNKNOWN, Grid

_FREE, _OCCUPIED, _UNKNOWN = 254, 0, 205
_HEADER = {"mode": "trinary", "negate": 0, "occupied_thresh": 0.65, "free_thresh": 0.196}


def nav2_files(grid: Grid, path: Path) -> dict[Path, bytes]:
    """Return the yaml at `path` and the image beside it, by where they belong."""
    image = path.with_suffix(".pgm")
    grey = np.full(grid.cells.shape, _FREE, dtype=np.uint8)
    grey[grid.cells == OBSTACLE] = _OCCUPIED
    grey[grid.cells == UNKNOWN] = _UNKNOWN
    header = {"image": image.name, "resolution": grid.resolution_m, "origin": list(grid.origin_m), **_HEADER}
    pixels = f"P5\n{grid.width} {grid.height}\n255\n".encode() + np.flipud(grey).tobytes()
    return {image: pixels, path: yaml.safe_dump(header, sort_keys=False).encode()}
