"""Transforms and messages of ROS, and the map that is tracked from them."""

import math
from typing import Any

import pytest

pytest.importorskip("websockets")

import numpy as np
from ros_parts import grid_message, moved, tracker_of
from ros_rooms import CARRIER

from marsupial.errors import MapError
from marsupial.formats.mapfiles.masks import FilterMasks
from marsupial.formats.mapfiles.occupancy import Occupancy
from marsupial.model.grid import FLOOR, OBSTACLE, TERRAINS, UNKNOWN
from marsupial_ros.map_tracker import MapTracker
from marsupial_ros.messages import link_in, occupancy_in, path_of, update_in
from marsupial_ros.transforms import Frames


def test_a_robot_is_found_through_a_chain_of_frames() -> None:
    frames = Frames()
    frames.add("map", "odom", moved(1, 2, math.pi / 2), None)
    frames.add("odom", "base", moved(3, 0, math.pi / 2), 7.0)
    found = frames.find("base", "map")
    assert found is not None
    assert (*found[0].point, abs(found[0].yaw), found[1]) == pytest.approx((1, 5, math.pi, 7.0))
    assert frames.find("base", "elsewhere") is None


def test_a_cycle_of_frames_is_detected() -> None:
    frames = Frames()
    frames.add("a", "b", moved(0, 0), 1.0)
    frames.add("b", "a", moved(0, 0), 1.0)
    assert frames.find("a", "map") is None


def test_a_rotation_of_no_length_is_refused() -> None:
    zero = {"translation": {"x": 0, "y": 0, "z": 0}, "rotation": {"x": 0, "y": 0, "z": 0, "w": 0}}
    link = {"header": {"frame_id": "/map"}, "child_frame_id": "odom", "transform": zero}
    with pytest.raises(ValueError, match="rotation"):
        link_in(link)


def test_a_path_is_turned_towards_its_next_point() -> None:
    poses = path_of([(0, 0), (0, 1), (-1, 1)], 0.0, "map")["poses"]
    yaws = [2 * math.atan2(p["pose"]["orientation"]["z"], p["pose"]["orientation"]["w"]) for p in poses]
    assert yaws == pytest.approx([math.pi / 2, math.pi, math.pi])
    assert poses[0]["header"] == {"stamp": {"sec": 0, "nanosec": 0}, "frame_id": "map"}


def test_a_resolution_in_single_precision_is_rounded() -> None:
    assert occupancy_in(grid_message([[0]], resolution=0.05000000074505806)).resolution_m == 0.05
    with pytest.raises(MapError, match="resolution must be finite"):
        occupancy_in(grid_message([[0]], resolution=1e300))


def test_a_map_with_too_few_cells_is_refused() -> None:
    message = grid_message([[0, 0]])
    message["info"]["height"] = 2
    with pytest.raises(ValueError, match="data must have 2 x 2 cells, got 2"):
        occupancy_in(message)


def test_changed_cells_are_reported_once_and_by_the_nearest_robot() -> None:
    tracker = tracker_of([0, -1, -1, 0])
    frame, revealed = tracker.changes({"a": (0.0, 0.5), "b": (4.0, 0.5)})
    assert frame == {"width": 4, "height": 1, "origin_m": [0.0, 0.0, 0.0]}
    assert revealed == [{"robot": "a", "runs": [0, 1, FLOOR]}, {"robot": "b", "runs": [3, 1, FLOOR]}]
    assert not tracker.fresh
    tracker.update(update_in({"x": 3, "y": 0, "width": 1, "height": 1, "data": [-1]}))
    assert tracker.changes({"a": (0.0, 0.5)})[1] == [{"robot": "a", "runs": [3, 1, UNKNOWN]}]
    assert tracker.changes({"a": (0.0, 0.5)}) == (None, [])


def test_a_map_that_grows_on_all_sides_reports_only_new_cells() -> None:
    tracker = tracker_of([0, 100])
    tracker.changes({"a": (0.0, 0.0)})
    grown = grid_message([[100, -1, -1, -1], [-1, 0, 100, 0], [-1, -1, -1, 0]], x=-1, y=-1)
    tracker.take(occupancy_in(grown))
    frame, revealed = tracker.changes({"a": (0.0, 0.0)})
    assert frame == {"width": 4, "height": 3, "origin_m": [-1.0, -1.0, 0.0]}
    assert revealed == [{"robot": "a", "runs": [0, 1, OBSTACLE, 7, 1, FLOOR, 11, 1, FLOOR]}]


def test_a_map_with_another_lattice_is_refused_and_the_previous_one_stays() -> None:
    tracker = tracker_of([0])
    with pytest.raises(MapError, match=r"resolution of the map has changed: it was 1 m, now 0\.5 m"):
        tracker.take(occupancy_in(grid_message([[0]], resolution=0.5)))
    turned = Occupancy(values=np.zeros((1, 1), np.int8), resolution_m=1.0, origin_m=(0, 0, 1.0))
    with pytest.raises(MapError, match="rotated"):
        tracker.take(turned)
    assert tracker.grid.resolution_m == 1.0


def test_cells_beyond_a_map_that_shrinks_are_unknown_again() -> None:
    tracker = tracker_of(*[[0] * 12] * 6)
    tracker.changes({"a": (0.5, 0.5)})
    tracker.take(occupancy_in(grid_message([[0] * 6] * 6)))
    frame, revealed = tracker.changes({"a": (0.5, 0.5)})
    assert frame == {"width": 12, "height": 6, "origin_m": [0.0, 0.0, 0.0]}
    runs = [number for row in range(6) for number in (12 * row + 6, 6, UNKNOWN)]
    assert revealed == [{"robot": "a", "runs": runs}]
    assert tracker.changes({"a": (0.5, 0.5)}) == (None, [])
    tracker.take(occupancy_in(grid_message([[0] * 12] * 6)))
    frame, revealed = tracker.changes({"a": (0.5, 0.5)})
    assert [one["runs"] for one in revealed] == [[*runs[:2], FLOOR, *(FLOOR if n == UNKNOWN else n for n in runs[3:])]]


def test_cells_left_behind_by_an_origin_that_moves_are_unknown_again() -> None:
    tracker = tracker_of([0, 100, 0, 0])
    tracker.changes({"a": (2.5, 0.5)})
    tracker.take(occupancy_in(grid_message([[0, 0, 0]], x=2.0)))
    frame, revealed = tracker.changes({"a": (2.5, 0.5)})
    assert frame == {"width": 5, "height": 1, "origin_m": [0.0, 0.0, 0.0]}
    assert revealed == [{"robot": "a", "runs": [0, 2, UNKNOWN, 4, 1, FLOOR]}]
    tracker.take(occupancy_in(grid_message([[100, 0, 0, 0]], x=-1.0)))
    frame, revealed = tracker.changes({"a": (0.5, 0.5)})
    assert frame == {"width": 6, "height": 1, "origin_m": [-1.0, 0.0, 0.0]}
    assert revealed == [{"robot": "a", "runs": [0, 1, OBSTACLE, 1, 2, FLOOR, 4, 2, UNKNOWN]}]


def test_an_update_outside_the_map_is_refused() -> None:
    with pytest.raises(MapError, match="lies outside the map"):
        tracker_of([0]).update(update_in({"x": 1, "y": 0, "width": 1, "height": 1, "data": [0]}))


def test_a_resumed_mission_reports_only_unknown_cells() -> None:
    tracker = MapTracker(TERRAINS, FilterMasks(), 0.25, 0.65)
    first = {"width": 2, "height": 1, "resolution_m": 1.0, "origin_m": [0, 0, 0]}
    known: Any = {"width": 3, "height": 1, "resolution_m": 1.0, "origin_m": [-1, 0, 0], "runs": [0, 2, FLOOR]}
    tracker.expect(first)
    tracker.resume(known)
    tracker.take(occupancy_in(grid_message([[0, 0, 100]], x=-1)))
    assert tracker.changes({"a": (0.0, 0.0)})[1] == [{"robot": "a", "runs": [2, 1, OBSTACLE]}]


def test_a_robot_beside_free_ground_is_placed_on_it() -> None:
    tracker = tracker_of(*[[100, 100, 0, 0, 0, 0, 0]] * 7)
    assert tracker.standing(CARRIER, (4.3, 3.2), 1.0) == (4.3, 3.2)
    assert tracker.standing(CARRIER, (1.8, 3.5), 1.0) == pytest.approx((2.5, 3.5))
    assert tracker.standing(CARRIER, (0.5, 3.5), 1.0) is None
    assert tracker.standing(CARRIER, (99.0, 99.0), 1.0) is None
