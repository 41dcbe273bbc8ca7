"""Read a map from a recording of ROS 2 (rosbag2): the last `nav_msgs/OccupancyGrid` of a topic.

A recording is a folder with a `metadata.yaml`, or one of its files (`.mcap`, `.db3`) alone. A topic may follow a ``#``
(``run7#/carrier1/map``); without it, the topic is the only one with maps, or ``/map``.
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from marsupial.errors import MapError
from marsupial.formats.files import file_fault
from marsupial.formats.mapfiles import occupancy as occupancies
from marsupial.formats.mapfiles.cropping import known_part
from marsupial.formats.mapfiles.images import MAX_CELLS, size_fault
from marsupial.formats.mapfiles.occupancy import Occupancy, terrain_codes
from marsupial.model import Grid, LegendEntry, MapReading
from marsupial.wording import counted

if TYPE_CHECKING:
    from rosbags.rosbag2 import Reader
    from rosbags.typesys.store import Typestore

SUFFIXES = (".mcap", ".db3")
METADATA = "metadata.yaml"
MAP_TYPE = "nav_msgs/msg/OccupancyGrid"
USUAL_TOPIC = "/map"


def is_recording(path: Path) -> bool:
    """Return whether a path is meant as a recording: a folder with metadata, or a file of one."""
    if os.path.isdir(path):  # False for impossible names, for which `Path.is_dir` raises
        return os.path.isfile(path / METADATA)
    return path.suffix.lower() in SUFFIXES


def split_topic(path: Path) -> tuple[Path, str | None]:
    """Return the recording that a path names, and the topic after it, if any."""
    recording, mark, topic = str(path).partition("#")
    if not mark or os.path.exists(path) or not is_recording(Path(recording)):
        return path, None
    return Path(recording), "/" + topic.lstrip("/")


def read_rosbag(path: Path | str) -> MapReading:
    """Read the last map of a recording; return the map and how it was interpreted."""
    recording, topic = split_topic(Path(path))
    if not recording.is_dir() and (fault := file_fault(recording)) is not None:
        raise MapError(fault, source=str(recording))
    with _opened(recording) as reader:
        found, others = _topic(reader, topic, str(recording))
        message, count = _last(reader, found)
    occupancy = occupancy_of(message, source=f"{recording}#{found}")
    warnings = [] if not others else [f"took {found}; there are maps on {', '.join(others)} too"]
    reading = known_part(_reading(occupancy, f"rosbag2, last of {count} maps on {found}", warnings))
    files = recording.iterdir() if recording.is_dir() else (recording,)
    size_bytes = sum(file.stat().st_size for file in files)
    advice = " (`resolution` of the node that publishes it)"
    if fault := size_fault(reading.grid.width, reading.grid.height, size_bytes, advice):
        raise MapError(fault, source=f"{recording}#{found}")
    return reading


def occupancy_of(message: Any, source: str = "") -> Occupancy:
    """Convert a `nav_msgs/OccupancyGrid` of `rosbags`; raise a `MapError` if its sizes disagree or are too large."""
    info, data = message.info, np.asarray(message.data, dtype=np.int8)
    size = info.width * info.height
    if size > MAX_CELLS:
        raise MapError(f"has {size} cells, more than the limit of {MAX_CELLS}", source=source)
    if len(data) != size:
        raise MapError(f"has {len(data)} cells, but is {info.width} x {info.height}", source=source)
    # The yaw of a rotation, as tf2 computes it: roll and pitch of a map are ignored.
    q, p = info.origin.orientation, info.origin.position
    yaw = float(np.arctan2(2 * (q.w * q.z + q.x * q.y), 1 - 2 * (q.y * q.y + q.z * q.z)))
    try:
        return Occupancy(
            values=data.reshape(info.height, info.width),
            resolution_m=occupancies.shortest_resolution(info.resolution),
            origin_m=(float(p.x), float(p.y), yaw),
        )
    except MapError as error:
        raise MapError(error.problems, source=source) from error


@contextmanager
def _opened(recording: Path) -> Iterator[Reader]:
    try:
        from rosbags.rosbag2 import Reader
    except ImportError as error:
        text = f"a recording of ROS 2 needs {error.name}: pip install 'marsupial[ros]'"
        raise MapError(text, source=str(recording)) from error
    try:
        with Reader(recording) as reader:
            yield reader
    except MapError:
        raise
    except Exception as error:  # a damaged file may raise from SQLite, YAML, MCAP, LZ4, Zstandard or CDR
        text = " ".join(str(error).split()) or type(error).__name__
        raise MapError(f"is no recording of ROS 2 that can be read ({text})", source=str(recording)) from error


def _topic(reader: Reader, asked: str | None, source: str) -> tuple[str, list[str]]:
    """Return the topic to read; also the other topics with maps, if it was chosen among several by default."""
    maps = [connection for connection in reader.connections if connection.msgtype == MAP_TYPE]
    # A file that was cut short has no counts of messages.
    topics = sorted({c.topic for c in maps if c.msgcount} or {c.topic for c in maps})
    if not topics:
        raise MapError(f"holds no {MAP_TYPE}", source=source)
    if asked is not None:
        if asked not in topics:
            raise MapError(f"has no map on {asked}, but on {', '.join(topics)}", source=source)
        return asked, []
    if len(topics) == 1:
        return topics[0], []
    if USUAL_TOPIC not in topics:
        raise MapError(f"has maps on {', '.join(topics)}: name one, as {source}#{topics[0]}", source=source)
    return USUAL_TOPIC, [topic for topic in topics if topic != USUAL_TOPIC]


def _last(reader: Reader, topic: str) -> tuple[Any, int]:
    """Return the last map of a topic, and the number of its maps; only the last is decoded."""
    raw, count = b"", 0
    for _, _, data in reader.messages([c for c in reader.connections if c.topic == topic]):
        raw, count = data, count + 1
    if not count:
        raise MapError(f"has no map on {topic}", source=str(reader.path))
    return _types().deserialize_cdr(raw, MAP_TYPE), count


@cache
def _types() -> Typestore:
    """Return the message types of ROS 2, which compile a reader of each type that they read."""
    from rosbags.typesys import Stores, get_typestore

    return get_typestore(Stores.ROS2_HUMBLE)


def _reading(occupancy: Occupancy, form: str, warnings: list[str]) -> MapReading:
    values = occupancy.values
    cells = terrain_codes(values)
    counts = np.bincount(values.ravel().view(np.uint8), minlength=256)
    table = terrain_codes(np.arange(256, dtype=np.uint8).view(np.int8))
    shown = sorted((int(np.int8(byte.astype(np.uint8).view(np.int8))), int(byte)) for byte in np.flatnonzero(counts))
    low, high = 100 * occupancies.FREE_THRESH, 100 * occupancies.OCCUPIED_THRESH
    between = int(counts[[byte for value, byte in shown if low < value < high]].sum())
    if between:
        warnings.append(f"{counted(between, 'cell')} with an occupancy between {low:g} and {high:g} became unknown")
    return MapReading(
        grid=Grid(cells=cells, resolution_m=occupancy.resolution_m, origin_m=occupancy.origin_m),
        format=form,
        legend=tuple(
            LegendEntry(symbol=f"occupancy {value}", code=int(table[byte]), cells=int(counts[byte]))
            for value, byte in shown
        ),
        warnings=tuple(warnings),
    )
