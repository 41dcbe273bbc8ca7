"""Read any map file, by its suffix.

``.yaml`` or ``.yml`` is a nav2 map, ``.map`` a MovingAI map; ``.mcap``, ``.db3`` or a folder is a recording of ROS 2
(`recordings.py`). An image is a map once the size of its cells is given; its greys are those of nav2's map saver.
MovingAI's lists of path problems are not maps: the error names the map to give instead.
"""

import math
import os
from collections.abc import Callable
from pathlib import Path

import yaml

from marsupial.errors import MapError, UsageError
from marsupial.formats.files import NO_SUCH_FILE, at_home, file_fault, nearby
from marsupial.formats.mapfiles.images import SUFFIXES as IMAGES
from marsupial.formats.mapfiles.images import check_size, read_grey
from marsupial.formats.mapfiles.movingai import read_movingai, scenario_map
from marsupial.formats.mapfiles.nav2 import SAVED_HEADER, header_of, known_in, read_nav2, understand_image
from marsupial.formats.mapfiles.recordings import SUFFIXES, is_recording, split_topic
from marsupial.formats.mapfiles.rosbag import read_rosbag
from marsupial.model.grid import MapReading

READERS: dict[str, Callable[[Path], MapReading]] = {
    **dict.fromkeys((".yaml", ".yml"), read_nav2),
    ".map": read_movingai,
    **dict.fromkeys(SUFFIXES, read_rosbag),
}

_SCALELESS = (".map", *IMAGES)  # formats without the size of a cell


def has_scale(path: Path) -> bool:
    """Return whether a map file has the size of its cells."""
    return path.suffix.lower() not in _SCALELESS


def check_scaleless(source: Path | str, resolution_m: float | None) -> None:
    """Raise a `UsageError` if a resolution is given for a map that has one."""
    if resolution_m is not None:
        raise UsageError(f"{source}: has cells of its own size: a resolution is for images, MovingAI maps and arrays")


def read_map(path: Path | str, resolution_m: float | None = None) -> MapReading:
    """Read a map file and how it was interpreted; cells have `resolution_m`, which is for files that do not say.

    Raise a `MapError` if it can't be read, a `UsageError` if it has cells of its own size.
    """
    path = at_home(path)
    if names_recording(path):
        check_scaleless(path, resolution_m)
        return read_rosbag(path)
    if (fault := file_fault(path)) is not None:
        raise MapError(fault, source=str(path))
    if resolution_m is not None and path.suffix.lower() in IMAGES:
        return _read_image(path, resolution_m)
    if has_scale(path):
        check_scaleless(path, resolution_m)
    reader = READERS.get(path.suffix.lower())
    if reader is None:
        raise MapError(_kind_fault(path), source=str(path))
    return reader(path) if has_scale(path) else read_movingai(path, resolution_m)


def _read_image(path: Path, resolution_m: float) -> MapReading:
    header = header_of(_header_text(path, resolution_m).encode())
    image = read_grey(path, source=str(path), known=known_in(header))
    check_size(image, source=str(path))
    return understand_image(header, image)


def _header_text(image: Path, resolution_m: float) -> str:
    """Return a yaml file, in a line, for an image beside it with the greys of nav2's map saver."""
    fields = {"image": image.name, "resolution": resolution_m, "origin": [0.0, 0.0, 0.0], **SAVED_HEADER}
    return yaml.safe_dump(fields, sort_keys=False, default_flow_style=True, width=math.inf).strip()


def kind_of(path: Path) -> str | None:
    """Return what kind of map a file is by its name, such as ``a nav2 map``; None if it is none."""
    if names_recording(path):
        return "a recording of ROS 2"
    kinds = {".map": "a MovingAI map", ".yaml": "a nav2 map", ".yml": "a nav2 map", **dict.fromkeys(IMAGES, "an image")}
    return kinds.get(path.suffix.lower())


def in_folder(folder: Path, written: str) -> Path:
    """Return the path of a map or mask that is written relative to a folder.

    Raises MapError if there is none, but another file that is probably meant.
    """
    path = folder / at_home(written)
    if not names_recording(path) and file_fault(path) == NO_SUCH_FILE and (meant := nearby(folder, written)):
        raise MapError(f"{NO_SUCH_FILE}, did you mean {meant}?", source=str(path))
    return path


def names_recording(path: Path) -> bool:
    """Return whether a path is a folder, which can only be a recording, a file of one, or one followed by a topic."""
    return os.path.isdir(path) or split_topic(path)[1] is not None or (os.path.exists(path) and is_recording(path))


def _kind_fault(path: Path) -> str:
    """Return why a file of another kind is not a map, and which file to give instead."""
    suffix = path.suffix.lower()
    if suffix == ".scen":
        name = scenario_map(path)
        beside = [path.with_suffix(""), *([path.parent / Path(name).name] if name else [])]
        found = next((one for one in beside if one.suffix == ".map" and one.is_file()), name or "a .map file")
        return f"holds MovingAI path problems for single agents, not a map: give the map they are for, {found}"
    if ".bag" in path.suffixes[-2:]:  # or .bag.active
        convert = f"rosbags-convert --src {path} --dst {path.with_name(path.name.partition('.bag')[0])}"
        return f"is a recording of ROS 1: convert it (pip install rosbags; {convert}), then give the new folder"
    if suffix == ".jsonl":
        return "is a mission log, not a map: `marsupial replay` and `marsupial export` take it"
    kinds = "a nav2 map (.yaml, .yml), a MovingAI map (.map) or a recording of ROS 2 (.mcap, .db3, or its folder)"
    fault = f"unknown kind of map {suffix!r}: must be {kinds}"
    if suffix not in IMAGES:
        return fault
    header = next((one for one in (path.with_suffix(".yaml"), path.with_suffix(".yml")) if one.is_file()), None)
    if header is not None:
        return f"is the image of a map: give its yaml file, {header}"
    return (
        "is an image without the size of its cells: give it in metres (--resolution 0.05, in Python resolution_m=0.05),"
        f" or write {path.with_suffix('.yaml').name} beside it and give that: {_header_text(path, 0.05)}"
    )
