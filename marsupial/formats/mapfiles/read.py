"""Any map file, by its suffix.

``.yaml`` or ``.yml`` is a nav2 map, ``.map`` a MovingAI map, ``.mcap`` or ``.db3`` a recording of ROS 2; so is a folder
with a ``metadata.yaml``.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path

from marsupial.errors import MapError
from marsupial.formats.files import file_fault
from marsupial.formats.mapfiles.movingai import understand_movingai
from marsupial.formats.mapfiles.nav2 import understand_nav2
from marsupial.formats.mapfiles.rosbag import SUFFIXES, is_recording, split_topic, understand_rosbag
from marsupial.model.mapreading import MapReading

READERS: dict[str, Callable[[Path], MapReading]] = {
    ".yaml": understand_nav2,
    ".yml": understand_nav2,
    ".map": understand_movingai,
    **dict.fromkeys(SUFFIXES, understand_rosbag),
}

_IMAGES = (".pgm", ".png", ".bmp", ".jpg", ".jpeg", ".ppm")


def read_map(path: Path | str) -> MapReading:
    """Read a map file and say how it was understood.

    Raises
    ------
    MapError
        Where the file is missing, of no known kind, or wrong inside.
    """
    path = Path(path)
    if names_recording(path):
        return understand_rosbag(path)
    fault = file_fault(path)
    if fault is not None:
        raise MapError(fault, source=str(path))
    reader = READERS.get(path.suffix.lower())
    if reader is None:
        hint = " (an image needs its map.yaml: give that)" if path.suffix.lower() in _IMAGES else ""
        raise MapError(
            f"unknown kind of map {path.suffix!r}: must be a nav2 map (.yaml, .yml), a MovingAI map (.map) or a "
            f"recording of ROS 2 (.mcap, .db3, or its folder){hint}",
            source=str(path),
        )
    return reader(path)


def names_recording(path: Path) -> bool:
    """Say whether a path is a folder that holds a recording of ROS 2, or a topic is named behind a recording."""
    return (os.path.isdir(path) and is_recording(path)) or split_topic(path)[1] is not None
