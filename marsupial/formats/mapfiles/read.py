"""Any map file, by its suffix.

``.yaml`` or ``.yml`` is a nav2 map, ``.map`` a MovingAI map, ``.mcap`` or ``.db3`` a recording of ROS 2; so is a folder
with a ``metadata.yaml``. Files that come with maps and are none, images and MovingAI's lists of path problems, are
refused with the map to give.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path

from marsupial.errors import MapError
from marsupial.formats.files import file_fault
from marsupial.formats.mapfiles.movingai import scenario_map, understand_movingai
from marsupial.formats.mapfiles.nav2 import understand_nav2
from marsupial.formats.mapfiles.rosbag import SUFFIXES, is_recording, split_topic, understand_rosbag
from marsupial.model.mapreading import MapReading

READERS: dict[str, Callable[[Path], MapReading]] = {
    ".yaml": understand_nav2,
    ".yml": understand_nav2,
    ".map": understand_movingai,
    **dict.fromkeys(SUFFIXES, understand_rosbag),
}

_SCALELESS = (".map",)
"""Formats that don't say how large a cell is."""

_IMAGES = (".pgm", ".png", ".bmp", ".jpg", ".jpeg", ".ppm")


def has_scale(path: Path) -> bool:
    """Say whether a map file says how large its cells are."""
    return path.suffix.lower() not in _SCALELESS


def read_map(path: Path | str, resolution_m: float | None = None) -> MapReading:
    """Read a map file and say how it was understood.

    Parameters
    ----------
    resolution_m
        Metres a cell of a map without a scale (`has_scale`); of others it is their own.

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
        raise MapError(_kind_fault(path), source=str(path))
    return reader(path) if has_scale(path) else understand_movingai(path, resolution_m)


def names_recording(path: Path) -> bool:
    """Say whether a path is a folder that holds a recording of ROS 2, or a topic is named behind a recording."""
    return (os.path.isdir(path) and is_recording(path)) or split_topic(path)[1] is not None


def _kind_fault(path: Path) -> str:
    """Say why a file of no known kind is no map, and which file to give instead."""
    suffix = path.suffix.lower()
    if suffix == ".scen":
        return f"holds MovingAI path problems for single agents, not a map: give the map they are for, {_map_of(path)}"
    if suffix == ".jsonl":
        return "is a mission log, not a map: `marsupial replay` and `marsupial export` take it"
    kinds = (
        "must be a nav2 map (.yaml, .yml), a MovingAI map (.map) or a recording of ROS 2 (.mcap, .db3, or its folder)"
    )
    if suffix not in _IMAGES:
        return f"unknown kind of map {suffix!r}: {kinds}"
    beside = next((one for one in (path.with_suffix(".yaml"), path.with_suffix(".yml")) if one.is_file()), None)
    give = "give that" if beside is None else f"give {beside}"
    return f"unknown kind of map {suffix!r}: {kinds} (an image needs its map.yaml: {give})"


def _map_of(path: Path) -> Path | str:
    """Return the map that a MovingAI scenario file is for, where one of that name stands beside it, else the name."""
    name = scenario_map(path)
    beside = [path.with_suffix(""), *([path.parent / Path(name).name] if name else [])]
    return next((one for one in beside if one.suffix == ".map" and one.is_file()), name or "a .map file")
