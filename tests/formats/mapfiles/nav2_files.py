"""Write maps of nav2, and read them."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np
import numpy.typing as npt
import yaml
from PIL import Image

from marsupial.formats.mapfiles.nav2 import read_nav2
from marsupial.model import FLOOR, OBSTACLE, UNKNOWN, Grid

HEADER = {
    "image": "map.pgm", "resolution": 0.5, "origin": [1.0, 2.0, 0.25], "negate": 0, "occupied_thresh": 0.65,
    "free_thresh": 0.196,
}  # fmt: skip

F, O, U = FLOOR, OBSTACLE, UNKNOWN  # noqa: E741


def grid_of(path: Path) -> Grid:
    return read_nav2(path).grid


def write_map(folder: Path, pixels: npt.ArrayLike, *, drop: tuple[str, ...] = (), **changes: object) -> Path:
    """Write image and yaml (fields changed or dropped); return the yaml's path."""
    header = {key: value for key, value in (HEADER | changes).items() if key not in drop}
    Image.fromarray(np.asarray(pixels, dtype=np.uint8)).save(folder / Path(str(header.get("image", "map.pgm"))).name)
    return write_yaml(folder, header)


def write_yaml(folder: Path, header: Mapping[str, object]) -> Path:
    path = folder / "map.yaml"
    path.write_text(yaml.safe_dump(dict(header)))
    return path
