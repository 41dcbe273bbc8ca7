"""Read a map from a recording of ROS 2 (rosbag2): the last `nav_msgs/OccupancyGrid` of a topic, and its updates.

Without a topic behind the recording (`recordings.py`), the topic is the only one with maps, or ``/map``. Costmaps are
published whole once, then as `map_msgs/OccupancyGridUpdate` on ``<topic>_updates``: these are applied in order of time,
as rviz does. Of all messages, only one map and one update are in memory at a time.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from marsupial.errors import MapError
from marsupial.formats.mapfiles import occupancy as occupancies
from marsupial.formats.mapfiles.cropping import known_part
from marsupial.formats.mapfiles.images import MAX_CELLS, size_fault
from marsupial.formats.mapfiles.occupancy import Occupancy, OccupancyUpdate, apply_update, terrain_codes, yaw_and_tilt
from marsupial.formats.mapfiles.recordings import opened, size_of, split_topic
from marsupial.model import Grid, LegendEntry, MapReading
from marsupial.wording import counted

if TYPE_CHECKING:
    from rosbags.interfaces import Connection
    from rosbags.rosbag2 import Reader
    from rosbags.typesys.store import Typestore

MAP_TYPE = "nav_msgs/msg/OccupancyGrid"
UPDATE_TYPE = "map_msgs/msg/OccupancyGridUpdate"
UPDATES = "_updates"
USUAL_TOPIC = "/map"

_UPDATE_FIELDS = "std_msgs/Header header\nint32 x\nint32 y\nuint32 width\nuint32 height\nint8[] data"

# a map message of fewer bytes may have no cells; larger ones are decoded only if they count
_SMALL_BYTES = 4096
# the most topics to list in a message
_MOST_LISTED = 10


@dataclass(slots=True)
class _LastMap:
    """The last map of a topic with cells, as its messages build it up; and how many of them did."""

    message: Any = b""  # the map: as it was recorded, or decoded as soon as there is an update for it
    maps: int = 0
    empty: int = 0  # maps without cells after it
    applied: int = 0  # updates of it
    early: int = 0  # updates before the first map
    unfit: int = 0  # updates that lie outside of their map, or have too few cells

    def take(self, raw: bytes) -> None:
        """Take a whole map."""
        self.maps += 1
        if len(raw) < _SMALL_BYTES and not len(_decoded(raw, MAP_TYPE).data):
            self.empty += 1
            return
        self.message, self.applied, self.empty = raw, 0, 0

    def update(self, raw: bytes, source: str) -> None:
        """Take a part of the map."""
        if not self.message:
            self.early += 1
            return
        self.message = self.occupancy(source)
        try:
            apply_update(self.message.values, _update_of(_decoded(raw, UPDATE_TYPE)))
            self.applied += 1
        except MapError:
            self.unfit += 1

    def occupancy(self, source: str) -> Occupancy:
        """Return the map. Raises MapError."""
        if isinstance(self.message, Occupancy):
            return self.message
        return occupancy_of(_decoded(self.message, MAP_TYPE), source)

    def warnings(self, topic: str) -> list[str]:
        """Return what of the topic is not in the map."""
        texts = (
            (self.empty, f"left out the last {counted(self.empty, 'map')} on {topic}, without cells"),
            (self.early, f"left out {counted(self.early, 'update')} on {topic}{UPDATES} from before the first map"),
            (self.unfit, f"left out {counted(self.unfit, 'update')} on {topic}{UPDATES} beyond the edges of the map"),
        )
        return [text for count, text in texts if count]


def read_rosbag(path: Path | str) -> MapReading:
    """Read the last map of a recording; return the map and how it was interpreted."""
    recording, asked = split_topic(Path(path))
    with opened(recording) as reader:
        topic, others = _topic(reader.connections, asked, str(recording))
        source = f"{recording}#{topic}"
        last = _last(reader, topic, source)
        occupancy = last.occupancy(source)
    warnings = [] if not others else [f"took {topic}; there are maps on {', '.join(others)} too"]
    warnings += [*last.warnings(topic), *occupancy.warnings()]
    updated = f" with {counted(last.applied, 'update')}" if last.applied else ""
    form = f"rosbag2, last of {counted(last.maps, 'map')} on {topic}{updated}"
    reading = known_part(_reading(occupancy, form, warnings))
    advice = " (`resolution` of the node that publishes it)"
    if fault := size_fault(reading.grid.width, reading.grid.height, size_of(recording), advice):
        raise MapError(fault, source=source)
    return reading


def occupancy_of(message: Any, source: str = "") -> Occupancy:
    """Convert a `nav_msgs/OccupancyGrid` of `rosbags`; raise a `MapError` if it is no map, or too large."""
    info, data = message.info, np.asarray(message.data, dtype=np.int8)
    size = info.width * info.height
    if size > MAX_CELLS:
        raise MapError(f"has {size} cells, more than the limit of {MAX_CELLS}", source=source)
    if len(data) != size:
        raise MapError(f"has {len(data)} cells, but is {info.width} x {info.height}", source=source)
    q, p = info.origin.orientation, info.origin.position
    try:
        yaw, tilt = yaw_and_tilt(q.x, q.y, q.z, q.w)
        return Occupancy(
            values=data.reshape(info.height, info.width).copy(),  # updates are written into it
            resolution_m=occupancies.shortest_resolution(info.resolution),
            origin_m=(float(p.x), float(p.y), yaw),
            tilt=tilt,
        )
    except MapError as error:
        raise MapError(error.problems, source=source) from error
    except ValueError as error:
        raise MapError(f"origin: {error}", source=source) from error


def _update_of(message: Any) -> OccupancyUpdate:
    """Convert a `map_msgs/OccupancyGridUpdate` of `rosbags`; raise a `MapError` if its sizes disagree."""
    data = np.asarray(message.data, dtype=np.int8)
    if len(data) != message.width * message.height:
        raise MapError(f"has {len(data)} cells, but is {message.width} x {message.height}")
    return OccupancyUpdate(message.x, message.y, data.reshape(message.height, message.width))


def _topic(connections: Sequence[Connection], asked: str | None, source: str) -> tuple[str, list[str]]:
    """Return the topic to read; also the other topics with maps, if it was chosen among several by default."""
    maps = [connection for connection in connections if connection.msgtype == MAP_TYPE]
    # A file that was cut short has no counts of messages.
    topics = sorted({c.topic for c in maps if c.msgcount} or {c.topic for c in maps})
    if not topics or (asked is not None and asked not in topics):
        raise MapError(_no_map(connections, asked, topics), source=source)
    if asked is not None:
        return asked, []
    if len(topics) == 1:
        return topics[0], []
    if USUAL_TOPIC not in topics:
        raise MapError(f"has maps on {', '.join(topics)}: name one, as {source}#{topics[0]}", source=source)
    return USUAL_TOPIC, [topic for topic in topics if topic != USUAL_TOPIC]


def _no_map(connections: Sequence[Connection], asked: str | None, topics: Sequence[str]) -> str:
    """Return why there is no map on the topic asked for, or on any, and what there is instead."""
    kinds = {connection.topic: connection.msgtype for connection in connections}
    partial = [topic for topic in sorted(kinds) if kinds[topic] == UPDATE_TYPE]
    if asked is not None:
        partial = [topic for topic in partial if topic in (asked, asked + UPDATES)]
    if partial and (not topics or f"{asked}{UPDATES}" in partial):
        whole = partial[0].removesuffix(UPDATES)
        fault = f"holds only updates of a map, on {partial[0]}, not the whole map that they belong to"
        return f"{fault}: record {whole} too, which may be published only once"
    if asked is None or not topics:
        listed = [f"{topic} ({kinds[topic]})" for topic in sorted(kinds)[:_MOST_LISTED]]
        rest = len(kinds) - len(listed)
        more = [f"and {rest} more"] if rest else []
        return f"holds no {MAP_TYPE}" + (f", but {', '.join(listed + more)}" if listed else "")
    of_type = f" ({asked} is {kinds[asked]})" if asked in kinds else ""
    return f"has no map on {asked}, but on {', '.join(topics)}{of_type}"


def _last(reader: Reader, topic: str, source: str) -> _LastMap:
    """Return the last map of a topic, with its updates."""
    kinds = {topic: MAP_TYPE, topic + UPDATES: UPDATE_TYPE}
    found = _LastMap()
    for connection, _, raw in reader.messages([c for c in reader.connections if kinds.get(c.topic) == c.msgtype]):
        if connection.msgtype == UPDATE_TYPE:
            found.update(raw, source)
        else:
            found.take(raw)
    if not found.message:
        none = f"has only maps without cells on {topic}" if found.maps else f"has no map on {topic}"
        raise MapError(none, source=source.rpartition("#")[0])
    return found


def _decoded(raw: bytes, kind: str) -> Any:
    """Return a recorded message."""
    return _types().deserialize_cdr(raw, kind)


@cache
def _types() -> Typestore:
    """Return the message types of ROS 2, which compile a reader of each type that they read."""
    from rosbags.typesys import Stores, get_types_from_msg, get_typestore

    store = get_typestore(Stores.ROS2_HUMBLE)
    store.register(get_types_from_msg(_UPDATE_FIELDS, UPDATE_TYPE))
    return store


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
