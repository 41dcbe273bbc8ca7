"""Unusual input from ROS: unsuitable maps, repeated transforms, unreadable messages."""

import json
import math
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("websockets")

from ros_parts import FleetBench, grid_message, settings_of, tracker_of

from marsupial.errors import MapError
from marsupial.formats.mapfiles.masks import FilterMasks
from marsupial.model.grid import FLOOR, TERRAINS
from marsupial_ros.map_tracker import MapTracker
from marsupial_ros.messages import occupancy_in, update_in
from marsupial_ros.ros_listener import Clock, RosListener
from marsupial_ros.settings import read_settings

FIRST = {"width": 2, "height": 1, "resolution_m": 0.05, "origin_m": [0.0, 0.0, 0.0]}
FITTING = grid_message([[0, 0]], resolution=0.05000000074505806)


def changed(message: dict[str, Any], **more: Any) -> dict[str, Any]:
    """Return a map with changed values in its `info`."""
    return {**message, "info": {**message["info"], **more}}


def origin(x: Any = 0.0, yaw: float = 0.0) -> dict[str, Any]:
    return {
        "position": {"x": x, "y": 0.0, "z": 0.0},
        "orientation": {"x": 0.0, "y": 0.0, "z": math.sin(yaw / 2), "w": math.cos(yaw / 2)},
    }


class ListenerBench:
    """A listener for the maps of a resumed mission and the transforms of a team."""

    def __init__(self, folder: Path, *, simulated: bool = True) -> None:
        self.bench = FleetBench(folder)
        self.tracker = MapTracker(TERRAINS, FilterMasks(), 0.25, 0.65)
        self.tracker.expect(FIRST)
        self.clock = Clock(simulated=simulated)
        self.said: list[str] = []
        given = settings_of(folder), self.bench.frames, self.tracker, self.clock
        self.listener = RosListener(*given, self.bench.fleet, self.said.append, "rosbridge")

    def tf(self, name: str, x: Any, stamp_s: float | None, topic: str = "/tf") -> dict[str, Any]:
        """Send a robot's position to the listener, and return the transform."""
        header: dict[str, Any] = {"frame_id": "map"}
        if stamp_s is not None:
            header["stamp"] = {"sec": int(stamp_s), "nanosec": 0}
        pose = origin(x)
        parts = {"translation": pose["position"], "rotation": pose["orientation"]}
        link = {"header": header, "child_frame_id": f"{name}/base_link", "transform": parts}
        self.listener.message(topic, {"transforms": [link]})
        return link

    def silence_s(self, now_s: float) -> float:
        return self.bench.fleet.robots["carrier1"].silence_s(now_s)


@pytest.mark.parametrize(
    ("odd", "why"),
    [
        (grid_message([[0, 0]], resolution=0.1), "resolution of the map has changed: it was 0.05 m, now 0.1 m"),
        (changed(FITTING, resolution=math.nan), "resolution"),
        (changed(FITTING, resolution="coarse"), "could not convert"),
        (changed(FITTING, origin=origin(yaw=0.5)), "rotated"),
        (changed(FITTING, origin=origin(x=math.nan)), "not finite"),
        (changed(FITTING, origin=origin(x=1e9)), "more than the limit"),
        (changed(FITTING, origin=origin(x=-1e300)), "origin must be"),
        (changed({**FITTING, "data": []}, width=0, height=0), "has no cells"),
        (changed(FITTING, origin={**origin(), "orientation": dict.fromkeys("xyzw", 0.0)}), "publish w = 1"),
        (changed(FITTING, origin={**origin(), "orientation": dict.fromkeys("xyzw", math.nan)}), "is not finite"),
        ({**FITTING, "header": {"frame_id": "odom"}}, "must be in the frame 'map', got 'odom'"),
        ({**FITTING, "data": [0, 300]}, "out of bounds"),
        ({**FITTING, "data": None}, ""),
        ({}, "info"),
    ],
)
def test_an_unsuitable_first_map_is_ignored_and_a_suitable_one_used(tmp_path: Path, odd: Any, why: str) -> None:
    listeners = ListenerBench(tmp_path)
    listeners.listener.message("/map", odd)
    assert listeners.tracker.grid is None
    (said,) = listeners.said
    assert said.startswith("/map: message ignored: ")
    assert why in said
    listeners.listener.message("/map", FITTING)
    assert listeners.tracker.grid is not None


def test_a_tilted_map_is_used_as_if_it_lay_flat(tmp_path: Path) -> None:
    listeners = ListenerBench(tmp_path)
    for _ in range(2):
        tilted = {**origin(), "orientation": {"x": 0.3, "y": 0.0, "z": 0.0, "w": 0.9}}
        listeners.listener.message("/map", changed(FITTING, origin=tilted))
    assert listeners.said == ["the map is tilted by 37 degrees: it is read as if it lay flat"]
    assert listeners.tracker.grid is not None


def test_updates_of_an_ignored_map_change_nothing() -> None:
    tracker = tracker_of([0, 0])
    with pytest.raises(MapError):
        tracker.take(occupancy_in(grid_message([[100]], resolution=2.0)))
    tracker.update(update_in({"x": 0, "y": 0, "width": 1, "height": 1, "data": [100]}))
    assert tracker.grid.cells.tolist() == [[FLOOR, FLOOR]]


@pytest.mark.parametrize(
    ("heard", "silent_s", "fresh_s"),
    [
        ({10.0: 9.0, 11.0: 9.0, 12.0: 9.0, 40.0: 9.0}, 31.0, 40.0),  # a repetition is not new
        ({100.0: 40.0, 101.0: 41.0}, 60.0, 5000.0),  # finally one with a stamp in the future
    ],
)
def test_a_transform_is_as_old_as_its_stamp_where_time_is_simulated(
    tmp_path: Path, heard: dict[float, float], silent_s: float, fresh_s: float
) -> None:
    listeners = ListenerBench(tmp_path)
    for now_s, stamp_s in heard.items():
        listeners.clock.set(now_s)
        listeners.tf("carrier1", 2.0, stamp_s)
    assert listeners.silence_s(now_s) == silent_s
    listeners.tf("carrier1", 2.0, fresh_s)
    assert listeners.silence_s(now_s) == 0.0


@pytest.mark.parametrize("offset_s", [-1e6, 0.0, 1e6])
def test_clocks_that_differ_make_no_transform_old(tmp_path: Path, offset_s: float) -> None:
    listeners = ListenerBench(tmp_path, simulated=False)
    for passed_s in (0.0, 1.0, -50.0, 2.0):  # a clock that is set back is still used
        before_s = listeners.clock.now_s
        listeners.tf("carrier1", 2.0, 1.5e9 + offset_s + passed_s)
        assert listeners.silence_s(before_s) <= 0.0


def test_transforms_without_stamps_and_static_ones_never_count_as_repeated(tmp_path: Path) -> None:
    listeners = ListenerBench(tmp_path)
    for stamp_s in (None, 0.0):
        for now_s in (10.0, 20.0):
            listeners.clock.set(now_s)
            listeners.tf("carrier1", 2.0, stamp_s)
        assert listeners.silence_s(20.0) == 0.0
    listeners.tf("carrier1", 2.0, 0.0, "/tf_static")
    assert listeners.silence_s(1e6) == 0.0


def test_a_robot_is_late_if_its_localisation_is(bench: FleetBench) -> None:
    frames = bench.frames["/tf"]
    identity = frames.find("map", "map")
    assert identity is not None
    frames.add("map", "carrier1/odom", identity[0], 3.0)
    frames.add("carrier1/odom", "carrier1/base_link", identity[0], 9.0)
    assert bench.fleet.robots["carrier1"].silence_s(10.0) == 7.0


def test_a_transform_that_cannot_be_read_hides_no_other_robot(tmp_path: Path) -> None:
    listeners = ListenerBench(tmp_path)
    listeners.clock.set(5.0)
    good = listeners.tf("carrier1", 2.0, 4.0)
    for bad in (
        {**good, "transform": None},
        {**good, "child_frame_id": 7},
        {**good, "header": {"frame_id": "map", "stamp": {"sec": math.nan, "nanosec": 0}}},
        {**good, "header": {"frame_id": "map", "stamp": "now"}},
    ):
        listeners.clock.set(listeners.clock.now_s + 1)
        stamp = {"sec": int(listeners.clock.now_s), "nanosec": 0}
        fresh = {**good, "header": {"frame_id": "map", "stamp": stamp}}
        listeners.listener.message("/tf", {"transforms": [bad, fresh]})
        assert listeners.silence_s(listeners.clock.now_s) == 0.0
    assert [text.startswith("/tf: message ignored") for text in listeners.said] == [True]


def test_a_clock_message_without_a_number_is_ignored(tmp_path: Path) -> None:
    path = tmp_path / "fleet.yaml"
    bench = FleetBench(tmp_path)
    path.write_text(path.read_text() + "clock: /clock\n")
    clock, said = Clock(simulated=True), []
    tracker = MapTracker(TERRAINS, FilterMasks(), 0.25, 0.65)
    listener = RosListener(read_settings(path), {}, tracker, clock, bench.fleet, said.append, "rosbridge")
    listener.message("/clock", json.loads('{"clock": {"sec": NaN, "nanosec": 0}}'))
    assert not clock.known
    assert said


def test_a_mission_waits_for_robots_whose_transforms_are_old(bench: FleetBench) -> None:
    assert bench.fleet.missing_poses(1.0) == []
    assert bench.fleet.missing_poses(61.0) == ["carrier1 (no new map -> carrier1/base_link on /tf)"]
