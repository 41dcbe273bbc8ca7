import math
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


def recording(folder: Path, topics: dict[str, Sequence[list[list[int]]]], storage: object = MCAP) -> Path:
    """Write a recording with maps of these occupancies, the lowest row first."""
    store = typesys.get_typestore(typesys.Stores.ROS2_HUMBLE)
    with rosbag2.Writer(folder, version=9, storage_plugin=storage) as writer:
        for topic, maps in topics.items():
            connection = writer.add_connection(topic, "nav_msgs/msg/OccupancyGrid", typestore=store)
            for i, rows in enumerate(maps):
                raw = store.serialize_cdr(message(store.types, rows), "nav_msgs/msg/OccupancyGrid")
                writer.write(connection, 1000 + i, raw)
    return folder


def message(types: dict[str, type], rows: list[list[int]]) -> object:
    data = np.array(rows, dtype=np.int8)
    stamp = types["builtin_interfaces/msg/Time"](sec=0, nanosec=0)
    pose = types["geometry_msgs/msg/Pose"](
        position=types["geometry_msgs/msg/Point"](x=-1.5, y=2.0, z=0.0),
        orientation=types["geometry_msgs/msg/Quaternion"](x=0.0, y=0.0, z=0.0, w=1.0),
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


def test_a_rotation_of_enormous_numbers_is_no_crash() -> None:
    found = message(typesys.get_typestore(typesys.Stores.ROS2_HUMBLE).types, [[0]])
    rotation = found.info.origin.orientation  # type: ignore[attr-defined]
    rotation.y = 1e200
    assert occupancy_of(found).origin_m[2] == pytest.approx(math.pi)
    rotation.x, rotation.z = -1e200, 1e200
    rotation.w = 1e200
    with pytest.raises(MapError, match="origin must be finite, got nan"):
        occupancy_of(found)


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
    frame: Any = np.full((1500, 1500), -1)
    frame[700:703, 800:804] = 100
    frame[701, 801:803] = 0
    reading = read_map(recording(tmp_path / "run", {"/map": [frame]}))
    assert reading.grid.cells.shape == (5, 6)
    assert reading.grid.origin_m == (-1.5 + 799 * 0.05, 2.0 + 699 * 0.05, 0.0)
    assert reading.format.endswith("on /map, the known part of 1500 x 1500 cells")
