import math
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from marsupial.errors import MapError
from marsupial.formats.mapfiles.read import read_map
from marsupial.formats.mapfiles.rosbag import occupancy_of
from marsupial.library.scenarios import load_scenario
from marsupial.model.grid import FLOOR, OBSTACLE, UNKNOWN

rosbag2 = pytest.importorskip("rosbags.rosbag2")
typesys = pytest.importorskip("rosbags.typesys")

SQLITE, MCAP = rosbag2.StoragePlugin.SQLITE3, rosbag2.StoragePlugin.MCAP


Rows = list[list[int]]
Update = tuple[int, int, Rows]
"""Column and row of the lower left cell, and occupancies."""

GRID, UPDATE = "nav_msgs/msg/OccupancyGrid", "map_msgs/msg/OccupancyGridUpdate"
STORE = typesys.get_typestore(typesys.Stores.ROS2_HUMBLE)
FIELDS = "std_msgs/Header header\nint32 x\nint32 y\nuint32 width\nuint32 height\nint8[] data"
STORE.register(typesys.get_types_from_msg(FIELDS, UPDATE))


def recording(folder: Path, topics: dict[str, Sequence[Rows]], storage: object = MCAP) -> Path:
    """Write a recording with maps of these occupancies, the lowest row first."""
    return recorded(folder, [(topic, rows) for topic, maps in topics.items() for rows in maps], storage, list(topics))


def recorded(
    folder: Path, messages: Sequence[tuple[str, Any]], storage: object = MCAP, topics: Sequence[str] = ()
) -> Path:
    """Write a recording with maps, updates (`Update`) and clocks (int) on topics, in this order."""
    kinds = dict.fromkeys(topics, GRID)
    for topic, content in messages:
        kinds[topic] = GRID
        if isinstance(content, tuple | int):
            kinds[topic] = UPDATE if isinstance(content, tuple) else "rosgraph_msgs/msg/Clock"
    with rosbag2.Writer(folder, version=9, storage_plugin=storage) as writer:
        connections = {topic: writer.add_connection(topic, kind, typestore=STORE) for topic, kind in kinds.items()}
        for i, (topic, content) in enumerate(messages):
            raw = STORE.serialize_cdr(decoded(content), kinds[topic])
            writer.write(connections[topic], 1000 + i, raw)
    return folder


def decoded(content: Rows | Update | int) -> object:
    types = STORE.types
    if isinstance(content, list):
        return message(types, content)
    if isinstance(content, int):
        return types["rosgraph_msgs/msg/Clock"](clock=types["builtin_interfaces/msg/Time"](sec=content, nanosec=0))
    x, y, rows = content
    data = np.array(rows, dtype=np.int8)
    stamp = types["builtin_interfaces/msg/Time"](sec=0, nanosec=0)
    header = types["std_msgs/msg/Header"](stamp=stamp, frame_id="map")
    return types[UPDATE](header=header, x=x, y=y, width=data.shape[1], height=data.shape[0], data=data.ravel())


def message(types: dict[str, type], rows: Rows, rotation: Sequence[float] = (0.0, 0.0, 0.0, 1.0)) -> Any:
    data = np.array(rows, dtype=np.int8)
    stamp = types["builtin_interfaces/msg/Time"](sec=0, nanosec=0)
    x, y, z, w = rotation
    pose = types["geometry_msgs/msg/Pose"](
        position=types["geometry_msgs/msg/Point"](x=-1.5, y=2.0, z=0.0),
        orientation=types["geometry_msgs/msg/Quaternion"](x=x, y=y, z=z, w=w),
    )
    info = types["nav_msgs/msg/MapMetaData"](
        map_load_time=stamp, resolution=0.05, width=data.shape[1], height=data.shape[0], origin=pose
    )
    header = types["std_msgs/msg/Header"](stamp=stamp, frame_id="map")
    return types["nav_msgs/msg/OccupancyGrid"](header=header, info=info, data=data.ravel())


def error_of(path: Path | str) -> str:
    with pytest.raises(MapError) as caught:
        read_map(path)
    return str(caught.value)


@pytest.mark.parametrize("storage", [SQLITE, MCAP])
def test_the_last_map_of_a_recording_is_read(tmp_path: Path, storage: object) -> None:
    path = recording(tmp_path / "run", {"/map": [[[0, 0]], [[0, 100, -1], [25, 26, 65]]]}, storage)
    reading = read_map(path)
    assert reading.grid.cells.tolist() == [[FLOOR, OBSTACLE, UNKNOWN], [FLOOR, UNKNOWN, OBSTACLE]]
    assert (reading.grid.resolution_m, reading.grid.origin_m) == (0.05, (-1.5, 2.0, 0.0))
    assert reading.format == "rosbag2, last of 2 maps on /map"
    assert reading.warnings == ("1 cell with an occupancy between 25 and 65 became unknown",)
    assert {entry.symbol: entry.code for entry in reading.legend}["occupancy -1"] == UNKNOWN


@pytest.mark.parametrize(("storage", "suffix"), [(SQLITE, ".db3"), (MCAP, ".mcap")])
def test_a_file_of_a_recording_is_read_alone(tmp_path: Path, storage: object, suffix: str) -> None:
    folder = recording(tmp_path / "run", {"/map": [[[0, 100]]]}, storage)
    (file,) = folder.glob(f"*{suffix}")
    assert read_map(file).grid.cells.tolist() == [[FLOOR, OBSTACLE]]


@pytest.mark.parametrize(
    ("rotation", "yaw"),
    [
        ((0.0, 0.0, 0.7, 0.7), math.pi / 2),
        ((0.0, 0.0, 1.0, 1.0), math.pi / 2),
        ((0.0, 0.0, 0.0, 2.0), 0.0),
        ((0.0, 0.0, 0.0, -1e-200), 0.0),
        ((0.0, 0.0, 1e200, 1e200), math.pi / 2),
        ((0.0, 0.0, -0.1, 0.1), -math.pi / 2),
        ((0.01, 0.01, 0.7, 0.7), math.pi / 2),
    ],
)
def test_a_rotation_need_not_be_normalised(rotation: Sequence[float], yaw: float) -> None:
    found = occupancy_of(message(STORE.types, [[0]], rotation))
    assert found.origin_m[2] == pytest.approx(yaw, abs=0.03)
    assert found.warnings() == []


def test_a_tilted_map_is_read_as_if_it_lay_flat() -> None:
    found = occupancy_of(message(STORE.types, [[0]], (0.0, 1e200, 0.0, 1e200)))
    assert found.warnings() == ["the map is tilted by 90 degrees: it is read as if it lay flat"]


@pytest.mark.parametrize(
    ("rotation", "why"),
    [
        ((0.0, 0.0, 0.0, 0.0), r"origin: \(0, 0, 0, 0\) is not a rotation: publish w = 1 where nothing is rotated"),
        ((0.0, 0.0, 0.0, math.nan), "origin: the rotation .* is not finite"),
        ((math.inf, 0.0, 0.0, 1.0), "origin: the rotation .* is not finite"),
    ],
)
def test_what_is_no_rotation_is_refused(rotation: Sequence[float], why: str) -> None:
    with pytest.raises(MapError, match=why):
        occupancy_of(message(STORE.types, [[0]], rotation))


# updates


@pytest.mark.parametrize("storage", [SQLITE, MCAP])
def test_updates_after_the_last_map_are_applied_in_their_order(tmp_path: Path, storage: object) -> None:
    messages = [
        ("/map", [[100, 100, 100]]),
        ("/map_updates", (0, 0, [[0, 0, 0]])),
        ("/map", [[-1, -1, -1], [-1, -1, -1]]),
        ("/map_updates", (1, 0, [[100, 100], [0, 0]])),
        ("/map_updates", (2, 1, [[100]])),
        ("/map_updates", (0, 0, [[0]])),
        ("/other_updates", (0, 0, [[100]])),
    ]
    reading = read_map(recorded(tmp_path / "run", messages, storage))
    assert reading.grid.cells.tolist() == [[FLOOR, OBSTACLE, OBSTACLE], [UNKNOWN, FLOOR, OBSTACLE]]
    assert reading.format == "rosbag2, last of 2 maps on /map with 3 updates"
    assert reading.warnings == ()


def test_updates_that_belong_to_no_map_are_left_out_and_counted(tmp_path: Path) -> None:
    odd = [(-1, 0, [[0]]), (0, -1, [[0]]), (2, 0, [[0]]), (0, 1, [[0, 0]]), (2**31 - 1, 0, [[0]])]
    messages = [("/map_updates", (0, 0, [[0, 0]])), ("/map", [[-1, -1]])]
    messages += [("/map_updates", update) for update in (*odd, (1, 0, [[100]]))]
    reading = read_map(recorded(tmp_path / "run", messages))
    assert reading.grid.cells.tolist() == [[UNKNOWN, OBSTACLE]]
    assert reading.warnings == (
        "left out 1 update on /map_updates from before the first map",
        "left out 5 updates on /map_updates beyond the edges of the map",
    )


def test_a_topic_with_updates_only_is_refused_with_what_to_record(tmp_path: Path) -> None:
    path = recorded(tmp_path / "a", [("/costmap_updates", (0, 0, [[0]]))])
    only = "holds only updates of a map, on /costmap_updates, not the whole map that they belong to"
    for name in (path, f"{path}#/costmap", f"{path}#/costmap_updates"):
        assert error_of(name) == f"{path}: {only}: record /costmap too, which may be published only once"
    path = recorded(tmp_path / "b", [("/costmap_updates", (0, 0, [[0]])), ("/map", [[0]])])
    assert error_of(f"{path}#/costmap").startswith(f"{path}: {only}")
    assert read_map(path).grid.cells.tolist() == [[FLOOR]]


def test_the_last_map_with_cells_is_taken(tmp_path: Path) -> None:
    empty: Rows = np.zeros((0, 0), np.int8).tolist() or [[]]
    reading = read_map(recording(tmp_path / "a", {"/map": [[[100]], [[0]], empty, empty]}))
    assert (reading.grid.cells.tolist(), reading.format) == ([[FLOOR]], "rosbag2, last of 4 maps on /map")
    assert reading.warnings == ("left out the last 2 maps on /map, without cells",)
    assert read_map(recording(tmp_path / "b", {"/map": [empty, [[0]]]})).warnings == ()
    path = recording(tmp_path / "c", {"/map": [empty]})
    assert error_of(path) == f"{path}: has only maps without cells on /map"


# topics


def test_a_topic_is_named_behind_the_recording(tmp_path: Path) -> None:
    path = recording(tmp_path / "run", {"/a/map": [[[0]]], "/b/map": [[[100]]]})
    assert read_map(f"{path}#/b/map").grid.cells.tolist() == [[OBSTACLE]]
    assert read_map(f"{path}#a/map").grid.cells.tolist() == [[FLOOR]]
    assert error_of(f"{path}#/c") == f"{path}: has no map on /c, but on /a/map, /b/map"
    assert error_of(path) == f"{path}: has maps on /a/map, /b/map: name one, as {path}#/a/map"


def test_the_usual_topic_is_taken_and_the_others_are_named(tmp_path: Path) -> None:
    reading = read_map(recording(tmp_path / "run", {"/costmap": [[[0]]], "/map": [[[100]]]}))
    assert reading.grid.cells.tolist() == [[OBSTACLE]]
    assert reading.warnings == ("took /map; there are maps on /costmap too",)


def test_a_mission_may_be_in_a_recorded_map(tmp_path: Path) -> None:
    free = [[0] * 60 for _ in range(60)]
    path = recording(tmp_path / "run", {"/map": [free]})
    for name in (str(path), f"{path}#/map"):
        assert load_scenario(name, 1, 1).scenario.grid.width == 60


def test_a_recording_without_maps_is_refused(tmp_path: Path) -> None:
    assert error_of(recording(tmp_path / "run", {})).endswith("holds no nav_msgs/msg/OccupancyGrid")
    other = recorded(tmp_path / "other", [("/clock", 1), ("/time", 2)])
    held = "/clock (rosgraph_msgs/msg/Clock), /time (rosgraph_msgs/msg/Clock)"
    for name in (other, f"{other}#/map"):
        assert error_of(name) == f"{other}: holds no nav_msgs/msg/OccupancyGrid, but {held}"
    mixed = recorded(tmp_path / "mixed", [("/clock", 1), ("/map", [[0]])])
    assert error_of(f"{mixed}#/clock").endswith("has no map on /clock, but on /map (/clock is rosgraph_msgs/msg/Clock)")


# shapes


@pytest.mark.parametrize(("storage", "suffix"), [(SQLITE, ".db3"), (MCAP, ".mcap")])
def test_a_folder_without_metadata_is_read_if_it_has_one_file(tmp_path: Path, storage: object, suffix: str) -> None:
    folder = recording(tmp_path / "run", {"/a/map": [[[0, 100]]], "/b/map": [[[0]]]}, storage)
    (folder / "metadata.yaml").unlink()
    (folder / "notes.txt").touch()
    for name in (folder, f"{folder}/"):
        assert "name one, as" in error_of(name)
    assert read_map(f"{folder}#/a/map").grid.width == 2
    assert load_scenario_error(f"{folder}#/c").startswith("has no map on /c")
    (file,) = folder.glob(f"*{suffix}")
    second = file.with_name(f"x_1{suffix}")
    second.write_bytes(file.read_bytes())
    (told,) = {error_of(folder), error_of(f"{folder}#/a/map")}
    assert told.startswith(f"{folder}: has no metadata.yaml, but 2 files ({file.name}, {second.name})")
    assert told.endswith(f"`ros2 bag reindex {folder}`")


def load_scenario_error(name: str) -> str:
    with pytest.raises(MapError) as caught:
        load_scenario(name, 1, 1)
    return caught.value.problems[0].message


def test_the_metadata_of_a_recording_stands_for_its_folder(tmp_path: Path) -> None:
    folder = recording(tmp_path / "run", {"/map": [[[0, 100]]]})
    assert read_map(folder / "metadata.yaml").grid.cells.tolist() == [[FLOOR, OBSTACLE]]
    assert read_map(f"{folder / 'metadata.yaml'}#/map").grid.width == 2
    (tmp_path / "metadata.yaml").write_text("resolution: 1")
    assert "image: missing" in error_of(tmp_path / "metadata.yaml")


@pytest.mark.parametrize(("storage", "suffix"), [(SQLITE, ".db3"), (MCAP, ".mcap")])
def test_a_compressed_file_is_read_alone_and_in_its_folder(
    tmp_path: Path, storage: object, suffix: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder = recorded(tmp_path / "run", [("/map", [[0, 100]])], storage)
    (file,) = folder.glob(f"*{suffix}")
    packed = file.with_name(f"{file.name}.zstd")
    zstd = pytest.importorskip("backports.zstd" if sys.version_info < (3, 14) else "compression.zstd")
    packed.write_bytes(zstd.compress(file.read_bytes()))
    file.unlink()
    (folder / "metadata.yaml").unlink()
    for name in (packed, folder, f"{packed}#/map"):
        assert read_map(name).grid.cells.tolist() == [[FLOOR, OBSTACLE]]
    assert load_scenario_error(f"{packed}#/c").startswith("has no map on /c")
    monkeypatch.setattr("marsupial.formats.mapfiles.recordings.MOST_UNPACKED_BYTES", 100)
    assert error_of(packed) == f"{packed}: becomes more than 100 bytes: decompress it with `zstd -d`"
    packed.write_bytes(packed.read_bytes()[:50])
    assert "is no recording of ROS 2 that can be read" in error_of(packed)


def test_a_recording_of_ros_1_is_refused_with_how_to_convert_it(tmp_path: Path) -> None:
    for name in ("run.bag", "run.bag.active"):
        (tmp_path / name).write_bytes(b"#ROSBAG V2.0")
        assert f"rosbags-convert --src {tmp_path / name} --dst {tmp_path}/run)" in error_of(tmp_path / name)


def test_a_folder_without_a_recording_is_refused(tmp_path: Path) -> None:
    told = "is a directory, not a file, and holds no recording of ROS 2 (metadata.yaml, .mcap, .db3)"
    assert error_of(tmp_path) == f"{tmp_path}: {told}"
    assert load_scenario_error(str(tmp_path)) == told


def test_the_last_hash_in_a_name_parts_the_topic(tmp_path: Path) -> None:
    path = recording(tmp_path / "bag#1#", {"/map": [[[0]]]})
    plain = recording(tmp_path / "bag", {"/map": [[[100]]], "/1": [[[100, 100]]]})
    assert read_map(path).grid.cells.tolist() == [[FLOOR]]
    assert read_map(f"{path}#/map").grid.cells.tolist() == [[FLOOR]]
    assert read_map(f"{plain}#1").grid.width == 2
    assert error_of(f"{tmp_path}/x#y.mcap#/map") == f"{tmp_path}/x#y.mcap: no such file"


@pytest.mark.parametrize(("storage", "suffix"), [(SQLITE, ".db3"), (MCAP, ".mcap")])
def test_a_recording_cut_short_is_refused_or_read(tmp_path: Path, storage: object, suffix: str) -> None:
    (file,) = recording(tmp_path / "run", {"/map": [[[0, 100]] * 40]}, storage).glob(f"*{suffix}")
    whole = file.read_bytes()
    refused = 0
    for length in range(0, len(whole), max(1, len(whole) // 60)):
        file.write_bytes(whole[:length])
        try:
            read_map(file)
        except MapError:
            refused += 1
    assert refused > 20


@pytest.mark.parametrize("name", ["run.mcap", "run.db3"])
def test_a_file_that_is_no_recording_is_refused(tmp_path: Path, name: str) -> None:
    assert error_of(tmp_path / name).endswith("no such file")
    (tmp_path / name).write_bytes(b"no recording at all, " * 20)
    assert "is no recording of ROS 2 that can be read" in error_of(tmp_path / name)


def test_a_folder_with_broken_metadata_is_refused(tmp_path: Path) -> None:
    (tmp_path / "metadata.yaml").write_text("rosbag2_bagfile_information: {version: 9")
    assert "is no recording of ROS 2 that can be read" in error_of(tmp_path)


def test_a_frame_of_a_fixed_size_is_cropped_to_its_known_part(tmp_path: Path) -> None:
    frame = np.full((1500, 1500), -1)
    frame[700:703, 800:804] = 100
    frame[701, 801:803] = 0
    reading = read_map(recording(tmp_path / "run", {"/map": [frame.tolist()]}))
    assert reading.grid.cells.shape == (5, 6)
    assert reading.grid.origin_m == (-1.5 + 799 * 0.05, 2.0 + 699 * 0.05, 0.0)
    assert reading.format.endswith("on /map, the known part of 1500 x 1500 cells")
