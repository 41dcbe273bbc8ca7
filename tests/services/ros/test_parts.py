"""The parts of the bridge, one by one."""

import asyncio
import json
import math
import re
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("websockets")

import numpy as np
from ros_parts import FleetBench, grid_message, moved, settings_of, tracker_of
from ros_rooms import CARRIER
from support.waiting import HANG_S
from websockets.asyncio.server import ServerConnection, serve

from marsupial.cli.main import main
from marsupial.errors import InputError, MapError, ScenarioError, UsageError
from marsupial.formats.mapfiles.masks import FilterMasks
from marsupial.formats.mapfiles.occupancy import Occupancy
from marsupial.model.grid import FLOOR, OBSTACLE, TERRAINS, UNKNOWN, Grid
from marsupial_client import AsyncClient
from marsupial_ros.bridge import Bridge, brief_of
from marsupial_ros.fleet import SETTLED_S, RobotFleet
from marsupial_ros.journal import Journal, Record
from marsupial_ros.map_tracker import MapTracker
from marsupial_ros.messages import link_in, occupancy_in, path_of, update_in
from marsupial_ros.ros_listener import Clock, RosListener, subscriptions
from marsupial_ros.rosbridge import Rosbridge
from marsupial_ros.settings import read_settings
from marsupial_ros.transforms import Frames
from marsupial_ros.transport import ActionResult, Subscription

FRAME = {"width": 1, "height": 1, "resolution_m": 1.0, "origin_m": [0.0, 0.0, 0.0]}


# transforms and messages


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


# the tracker


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


# the fleet


def test_commands_finished_before_a_robot_was_lost_are_reported_first(bench: FleetBench) -> None:
    bench.fleet.unreported.finished.append(1)
    bench.fleet.unreported.lost.append({"robot": "carrier1", "reason": "silent"})
    first, second = bench.fleet.report(), bench.fleet.report()
    assert (first["finished"], first.get("lost")) == ([1], None)
    assert (second.get("finished"), second["lost"]) == (None, [{"robot": "carrier1", "reason": "silent"}])
    assert not bench.fleet.unreported.any


def test_a_lost_robot_carries_out_no_command(bench: FleetBench) -> None:
    bench.fleet.robots["carrier1"].lost = True
    bench.command(1, "drive", route=[], route_m=[[2.5, 2.5]])
    assert "finished" not in bench.fleet.report()


def test_a_robot_whose_transforms_arrive_again_returns_with_the_rovers_aboard(bench: FleetBench) -> None:
    bench.fleet.watch(1000.0)
    assert bench.fleet.report()["lost"][0]["robot"] == "carrier1"
    bench.fleet.watch(1001.0)
    assert not bench.fleet.unreported.any
    bench.at("carrier1", 3.5, 2.5, 1002.0)
    bench.fleet.watch(1002.0)
    bench.fleet.watch(1002.1)
    bench.drive()  # sent before the service knew of the loss
    assert not bench.fleet.driving
    news = bench.fleet.report()
    assert (news["returned"], news["robots"]) == (["carrier1", "rover1"], [{"name": "carrier1", "pose_m": [3.5, 2.5]}])
    bench.drive()
    assert bench.fleet.driving


def test_a_robot_returns_after_its_loss_is_reported(bench: FleetBench) -> None:
    bench.fleet.watch(1000.0)
    bench.at("carrier1", 3.5, 2.5, 1002.0)
    bench.fleet.watch(1002.0)
    first, second = bench.fleet.report(), bench.fleet.report()
    assert (first["robots"], len(first["lost"]), "returned" in first) == ([], 1, False)
    assert (second["returned"], "lost" in second) == (["carrier1", "rover1"], False)


@pytest.fixture
def apart(bench: FleetBench) -> FleetBench:
    """A fleet whose rover is on the ground, and has a radio of limited range."""
    rover = bench.fleet.robots["rover1"]
    rover.settings = replace(rover.settings, kind=replace(rover.settings.kind, radio_range_m=4.0))
    rover.aboard = None
    bench.at("rover1", 2.5, 4.5)
    bench.fleet.place()
    return bench


def drive_rover(bench: FleetBench) -> None:
    bench.command(1, "drive", robot="rover1", route=[], route_m=[[x + 0.5, 4.5] for x in range(2, 9)])


def test_a_rover_out_of_contact_drives_on_and_its_result_is_reported_later(apart: FleetBench) -> None:
    drive_rover(apart)
    for x in range(3, 6):
        apart.at("rover1", x + 0.5, 4.5, float(x))
        apart.fleet.notes()
    for now_s in (100.0, 500.0):
        apart.at("carrier1", 2.5, 2.5, now_s)
        apart.fleet.watch(now_s)
    news = apart.fleet.report()
    assert (news["out_of_contact"], "in_contact" in news, "failed" in news) == ([{"robot": "rover1"}], False, False)
    assert (apart.fleet.driving, apart.actions.cancelled) == (False, [])
    apart.fleet.connected(501.0)  # without new transforms of the rover
    apart.fleet.watch(501.0)
    assert not apart.fleet.unreported.any
    apart.at("rover1", 8.5, 4.5, 502.0)
    apart.fleet.watch(502.0)  # sends the rest of the drive again, of which nothing is left
    news = apart.fleet.report()
    assert (news["in_contact"], news["finished"], "out_of_contact" in news) == (["rover1"], [1], False)
    assert {note["name"]: note["pose_m"] for note in news["robots"]}["rover1"] == [8.5, 4.5]


def test_the_end_of_a_drive_out_of_contact_is_reported_as_usual(apart: FleetBench) -> None:
    drive_rover(apart)
    apart.fleet.apply_feedback("m:1:0.1", {"distance_to_goal": 3.0}, 1.0)
    apart.fleet.watch(100.0)
    apart.fleet.ended(ActionResult("m:1:0.1", 4, {}))
    apart.at("rover1", 8.5, 4.5, 101.0)
    apart.fleet.watch(101.0)
    news = apart.fleet.report()
    assert (news["in_contact"], news["finished"], "out_of_contact" in news) == (["rover1"], [1], False)


def test_commands_that_do_not_reach_a_rover_are_declined(apart: FleetBench) -> None:
    drive_rover(apart)
    apart.fleet.watch(100.0)  # without a sign that the drive has begun
    news = apart.fleet.report()
    assert (news["out_of_contact"], news["declined"]) == (
        [{"robot": "rover1"}],
        [{"id": 1, "reason": "out of contact"}],
    )
    apart.command(2, "dock", robot="rover1", carrier="carrier1")
    assert apart.fleet.report()["declined"] == [{"id": 2, "reason": "rover1 is out of contact"}]


def test_a_resumed_bridge_does_not_wait_for_a_rover_out_of_contact(apart: FleetBench) -> None:
    apart.at("carrier1", 2.5, 2.5, 100.0)
    assert [text.split()[0] for text in apart.fleet.missing_poses(100.0)] == ["rover1"]
    assert apart.fleet.missing_poses(100.0, ["rover1"]) == []
    apart.fleet.part(["rover1"], 100.0)
    apart.fleet.watch(100.0)
    assert not apart.fleet.unreported.any
    apart.at("rover1", 2.5, 4.5, 101.0)
    apart.fleet.watch(101.0)
    assert apart.fleet.report()["in_contact"] == ["rover1"]


def test_a_drive_that_somebody_else_cancels_is_declined(bench: FleetBench) -> None:
    bench.drive()
    bench.fleet.ended(ActionResult("m:1:0.1", 5, {}))
    news = bench.fleet.report()
    assert news["declined"] == [{"id": 1, "reason": "/carrier1/follow_path: canceled"}]
    assert "failed" not in news


@pytest.mark.parametrize(
    ("limit", "share"),
    [((True, 50.0), 0.5), ((False, 0.25), 0.25), ((True, 0.0), 1.0), ((False, 99.0), 1.0), ((True, 0.01), 0.01)],
)
def test_a_speed_limit_is_reported_as_a_share_of_full_speed(
    tmp_path: Path, limit: tuple[bool, float], share: float
) -> None:
    bench = FleetBench(tmp_path)
    path = tmp_path / "fleet.yaml"
    path.write_text(path.read_text().replace("type: carrier}", "type: carrier, speed_limit: /slow}"))
    settings = read_settings(path)
    fleet = RobotFleet(settings, bench.frames, tracker_of([0]), bench.actions, bench.said.append)  # type: ignore[arg-type]
    listener = RosListener(
        settings, bench.frames, tracker_of([0]), Clock(simulated=False), fleet, bench.said.append, "rosbridge"
    )
    assert subscriptions(settings)[-1] == Subscription("/slow", "nav2_msgs/msg/SpeedLimit")
    listener.message("/slow", {"percentage": limit[0], "speed_limit": limit[1]})
    assert [note.get("speed_share") for note in fleet.report()["robots"]] == [share]
    listener.message("/slow", {"percentage": True, "speed_limit": -1})
    assert any("a speed limit of -1" in text for text in bench.said)


def test_a_battery_is_reported_once_for_each_message_also_aboard(tmp_path: Path) -> None:
    bench = FleetBench(tmp_path)
    path = tmp_path / "fleet.yaml"
    text = path.read_text().replace("rover, carrier", "rover, battery: /joey/battery, carrier")
    path.write_text(text)
    with pytest.raises(ScenarioError, match="a rover has no battery"):
        read_settings(path)
    path.write_text(text.replace("dock_s", "battery: {capacity_j: 900, charge_w: 30}, dock_s", 1))
    settings = read_settings(path)
    fleet = RobotFleet(settings, bench.frames, tracker_of([0]), bench.actions, bench.said.append)  # type: ignore[arg-type]
    listener = RosListener(
        settings, bench.frames, tracker_of([0]), Clock(simulated=False), fleet, bench.said.append, "rosbridge"
    )
    assert subscriptions(settings)[-1] == Subscription("/joey/battery", "sensor_msgs/msg/BatteryState")
    for percentage in (float("nan"), None, -0.00999999977648, -1.0, -1e-6, float("-inf")):
        listener.message("/joey/battery", {"percentage": percentage})
        assert "rover1" not in [note["name"] for note in fleet.report()["robots"]]
    unknown = "/joey/battery: the charge of rover1 is unknown: it is estimated"
    assert [text for text in bench.said if "battery" in text] == [unknown]
    for percentage, share in ((0.73000001, 0.73), (0.0, 0.0), (1.02, 1.0)):
        listener.message("/joey/battery", {"percentage": percentage})
        assert {"name": "rover1", "charge": share} in fleet.report()["robots"]
    assert "rover1" not in [note["name"] for note in fleet.report()["robots"]]
    listener.message("/joey/battery", {"percentage": 73})
    assert any("a percentage of 73, which must be from 0 to 1" in text for text in bench.said)


def test_charging_places_off_the_map_are_left_out(tmp_path: Path) -> None:
    bench = FleetBench(tmp_path)
    path = tmp_path / "fleet.yaml"
    path.write_text(path.read_text() + "chargers: [{at_m: [2.5, 1.5]}, {at_m: [500, 1.5]}]\n")
    settings, grid = read_settings(path), Grid(cells=np.ones((9, 9), dtype=np.uint8), resolution_m=1.0)
    assert brief_of(settings, grid, bench.fleet)["chargers"] == [{"cell": [2, 1]}]


def test_a_drive_ends_at_the_end_of_its_route(bench: FleetBench) -> None:
    bench.drive()
    ((goal, action, values),) = bench.actions.sent
    assert (goal, action, len(values["path"]["poses"])) == ("m:1:0.1", "/carrier1/follow_path", 7)
    bench.at("carrier1", 5.7, 2.6)
    assert bench.fleet.report()["robots"] == [{"name": "carrier1", "pose_m": [5.5, 2.5]}]
    bench.at("carrier1", 8.3, 2.4)
    bench.fleet.ended(ActionResult("m:1:0.1", 4, {}))
    news = bench.fleet.report()
    assert (news["finished"], news["robots"]) == ([1], [{"name": "carrier1", "pose_m": [8.5, 2.5]}])
    assert not bench.fleet.driving


def test_the_rest_of_a_drive_is_resent_over_a_new_connection(bench: FleetBench) -> None:
    bench.drive()
    bench.at("carrier1", 6.4, 2.5)
    bench.fleet.connected(1.0)
    goal, _, values = bench.actions.sent[-1]
    assert (goal, values["path"]["poses"][0]["pose"]["position"]["x"]) == ("m:1:0.2", 6.5)
    bench.fleet.ended(ActionResult("m:1:0.1", 6, {}))  # the first goal, which was replaced
    assert bench.fleet.driving
    bench.at("carrier1", 8.5, 2.5)
    bench.fleet.connected(2.0)
    assert bench.fleet.report()["finished"] == [1]


def test_a_drive_that_was_stopped_ends_where_the_robot_is(bench: FleetBench) -> None:
    bench.drive()
    bench.at("carrier1", 4.4, 2.5)
    bench.command(1, "stop")
    bench.fleet.ended(ActionResult("m:1:0.1", 5, {}))
    news = bench.fleet.report()
    assert (news["finished"], news["robots"]) == ([1], [{"name": "carrier1", "pose_m": [4.5, 2.5]}])


def test_a_stop_is_repeated_until_the_robot_stands(bench: FleetBench) -> None:
    bench.drive()
    bench.command(1, "stop")
    for now_s in range(1, 6):
        bench.at("carrier1", 2.5 + min(now_s, 2), 2.5, now_s)
        bench.fleet.watch(float(now_s))
    assert len(bench.actions.cancelled) > 1
    bench.fleet.watch(2.0 + SETTLED_S + 0.1)
    assert bench.fleet.report()["finished"] == [1]


def test_a_failed_drive_gives_the_reason_of_the_action(bench: FleetBench) -> None:
    bench.drive()
    bench.fleet.ended(ActionResult("m:1:0.1", 6, {"error_code": 104, "error_msg": "no valid path"}))
    (failed,) = bench.fleet.report()["failed"]
    assert failed == {"id": 1, "reason": "/carrier1/follow_path: aborted (no valid path, error 104)"}


def test_a_drive_without_progress_is_aborted(bench: FleetBench) -> None:
    bench.drive()
    bench.fleet.apply_feedback("m:1:0.1", {}, 0.0)
    for now_s in (1.0, 60.0, 122.0):
        bench.at("carrier1", 2.55, 2.5, now_s)
        bench.fleet.watch(now_s)
    assert bench.fleet.report()["failed"] == [{"id": 1, "reason": "no progress for 120 s"}]
    assert bench.actions.cancelled == ["m:1:0.1"]


def test_a_drive_of_one_point_is_over_at_once(bench: FleetBench) -> None:
    bench.command(1, "drive", route=[], route_m=[[2.5, 2.5]])
    assert (bench.fleet.report()["finished"], bench.actions.sent) == ([1], [])


def test_an_undocking_that_reports_no_success_has_failed(bench: FleetBench) -> None:
    bench.command(2, "undock", robot="rover1", carrier="carrier1", cell=[3, 2], point_m=[3.5, 2.5])
    _, action, values = bench.actions.sent[-1]
    assert (action, values["rover"], values["carrier"]) == ("/rover1/undock", "rover1", "carrier1")
    assert values["command"] == 2
    bench.fleet.ended(ActionResult("m:2:0.1", 4, {"success": False, "message": "ramp blocked"}))
    assert bench.fleet.report()["failed"] == [{"id": 2, "reason": "/rover1/undock: succeeded (ramp blocked)"}]
    assert bench.fleet.robots["rover1"].aboard == "carrier1"


def test_a_rover_is_on_the_ground_after_undocking_and_aboard_after_docking(bench: FleetBench) -> None:
    bench.command(2, "undock", robot="rover1", carrier="carrier1", cell=[3, 2], point_m=[3.5, 2.5])
    assert [note["name"] for note in bench.fleet.notes()] == ["carrier1"]
    bench.at("rover1", 3.6, 2.5)
    bench.fleet.ended(ActionResult("m:2:0.1", 4, {"success": True, "message": ""}))
    assert bench.fleet.report()["robots"][1] == {"name": "rover1", "pose_m": [3.5, 2.5]}
    bench.command(3, "dock", robot="rover1", carrier="carrier1")
    bench.fleet.ended(ActionResult("m:3:0.1", 4, {"success": True, "message": ""}))
    assert [note["name"] for note in bench.fleet.notes()] == ["carrier1"]


def test_a_handover_that_never_ends_is_aborted(bench: FleetBench) -> None:
    bench.command(2, "undock", robot="rover1", carrier="carrier1", cell=[3, 2], point_m=[3.5, 2.5])
    bench.at("carrier1", 2.5, 2.5, 121.0)
    bench.fleet.watch(121.0)
    assert bench.fleet.report()["failed"] == [{"id": 2, "reason": "not finished after 120 s"}]


def test_nav2_may_take_its_own_way_to_the_end(bench: FleetBench, tmp_path: Path) -> None:
    path = tmp_path / "fleet.yaml"
    path.write_text(path.read_text().replace("type: carrier}", "type: carrier, drive: navigate_to_pose}"))
    bench.fleet = RobotFleet(read_settings(path), bench.frames, tracker_of([0]), bench.actions, bench.said.append)
    bench.drive()
    _, action, values = bench.actions.sent[-1]
    assert (action, values["pose"]["pose"]["position"]["x"]) == ("/carrier1/navigate_to_pose", 8.5)


# rosbridge


@dataclass
class Listener:
    heard: list[tuple[str, Mapping[str, Any]]] = field(default_factory=list)
    told: list[str] = field(default_factory=list)
    ends: list[ActionResult] = field(default_factory=list)
    fed: list[tuple[str, Mapping[str, Any]]] = field(default_factory=list)
    connections: int = 0

    def connected(self) -> None:
        self.connections += 1

    def disconnected(self, reason: str) -> None:
        self.told.append(reason)

    def message(self, topic: str, message: Mapping[str, Any]) -> None:
        self.heard.append((topic, message))

    def feedback(self, goal: str, values: Mapping[str, Any]) -> None:
        self.fed.append((goal, values))

    def ended(self, end: ActionResult) -> None:
        self.ends.append(end)

    warning = disconnected


def exchange(*sent: str | bytes, times: int = 1) -> tuple[Listener, list[dict[str, Any]]]:
    """Send messages over `times` connections of a rosbridge; return the listener and the requests received."""
    listener, asked = Listener(), []

    async def client(line: ServerConnection) -> None:
        asked.append(json.loads(await line.recv()))
        for one in sent:
            await line.send(one)

    async def run() -> None:
        async with serve(client, "127.0.0.1", 0) as server:
            url = f"ws://127.0.0.1:{server.sockets[0].getsockname()[1]}"
            work = asyncio.ensure_future(Rosbridge(url, [Subscription("/a", "b")]).run(listener))
            while len([text for text in listener.told if text == "closed by rosbridge"]) < times:
                await asyncio.sleep(0.01)
            work.cancel()
            await asyncio.gather(work, return_exceptions=True)

    asyncio.run(asyncio.wait_for(run(), HANG_S))
    return listener, asked


def test_a_lost_connection_is_reopened_and_subscribes_again() -> None:
    listener, asked = exchange(times=2)
    assert listener.connections >= 2
    one = {"op": "subscribe", "id": "marsupial:/a", "topic": "a", "type": "b", "compression": "none"}
    assert asked[:2] == [one, one]


def test_fragments_are_put_together_in_their_order() -> None:
    text = json.dumps({"op": "publish", "topic": "/a", "msg": {"data": "x" * 50}})
    parts = [text[i : i + 20] for i in range(0, len(text), 20)]
    fragments = [
        json.dumps({"op": "fragment", "id": "1", "data": part, "num": i, "total": len(parts)})
        for i, part in enumerate(parts)
    ]
    assert exchange(*reversed(fragments))[0].heard == [("/a", {"data": "x" * 50})]


def test_invalid_messages_are_reported_and_ignored() -> None:
    listener, _ = exchange(
        "no json",
        b"\xff\xff",
        "[]",
        '{"op": "publish"}',
        '{"op": "other"}',
        '{"op": "action_result", "status": 1e999}',
        '{"op": "action_result", "id": "a", "status": Infinity}',
        '{"op": "fragment", "id": "a", "data": "", "num": 0, "total": Infinity}',
        '{"op": "action_feedback", "id": "a"}',
        "[" * 100_000,
        '{"op": "publish", "topic": "/a", "msg": {}}',
    )
    assert (listener.heard, listener.ends) == ([("/a", {})], [])
    assert len([text for text in listener.told if "an invalid message" in text]) == 9


def test_results_of_goals_and_errors_are_received() -> None:
    end = {"op": "action_result", "id": "m:1:0.1", "action": "/a", "values": {}, "status": 5, "result": True}
    old = {"op": "action_result", "id": "m:1:0.2", "action": "/a", "values": {}, "result": True}
    error = {"op": "status", "level": "error", "msg": "no such type"}
    listener, _ = exchange(json.dumps(end), json.dumps(old), json.dumps(error))
    assert listener.ends == [ActionResult("m:1:0.1", 5, {}), ActionResult("m:1:0.2", 4, {})]
    assert "rosbridge: no such type" in listener.told


def test_feedback_of_any_size_is_received_whole_or_in_fragments() -> None:
    many = [
        json.dumps({"op": "action_feedback", "id": "m:1:0.1", "action": "/a", "values": {"distance_to_goal": i}})
        for i in range(5000)
    ]
    parts = [many[0][:30], many[0][30:]]
    fragments = [
        json.dumps({"op": "fragment", "id": "1", "data": part, "num": i, "total": 2}) for i, part in enumerate(parts)
    ]
    heard = exchange(*many, *fragments)[0].fed
    assert [values["distance_to_goal"] for _, values in heard] == [*range(5000), 0]
    assert {goal for goal, _ in heard} == {"m:1:0.1"}


# settings, state, command


def test_the_settings_of_the_documentation_can_be_read(tmp_path: Path) -> None:
    text = (Path(__file__).parents[3] / "docs" / "ros.md").read_text()
    whole, _ = re.findall(r"^```yaml\n(.*?)^```", text, re.MULTILINE | re.DOTALL)
    (tmp_path / "fleet.yaml").write_text(whole)
    settings = read_settings(tmp_path / "fleet.yaml")
    assert [robot.namespace for robot in settings.robots] == ["/carrier1", "/fleet/c2", "/rover1", "/rover2"]
    short = re.sub(r"^(map|planning|waits|goal|rosbridge|name):.*\n(  .*\n)*", "", whole, flags=re.MULTILINE)
    (tmp_path / "fleet.yaml").write_text(short)
    usual = read_settings(tmp_path / "fleet.yaml")
    assert (usual.map.topic, usual.waits, usual.goal) == (settings.map.topic, settings.waits, settings.goal)


def test_the_first_hour_of_the_documentation_fits_itself(tmp_path: Path) -> None:
    text = (Path(__file__).parents[3] / "docs" / "ros-first-hour.md").read_text()
    slam, fleet = re.findall(r"^```yaml\n(.*?)^```", text, re.MULTILINE | re.DOTALL)
    (tmp_path / "fleet.yaml").write_text(fleet)
    settings = read_settings(tmp_path / "fleet.yaml")
    names = re.findall(r"robot\.launch\.py name:=(\w+)", text)
    assert [(one.name, one.namespace, one.tf) for one in settings.robots] == [(n, f"/{n}", f"/{n}/tf") for n in names]
    assert list(settings.map.topics) == [f"/{name}/map" for name in names]
    assert f"map_frame: {settings.map.frame}\n" in slam


def test_errors_in_settings_are_reported_by_field(tmp_path: Path) -> None:
    more = {
        "map": "{tpic: /map, free_thresh: 0.7}",
        "controller": "{goal_checker_id: 3}",
        "goal": "{recover_rovers: perhaps}",
    }
    extra = "  - {name: c2, type: carrier, base_frame: carrier1/base_link, namespace: c2, drive: fly}\n"
    path = tmp_path / "fleet.yaml"
    with pytest.raises(ScenarioError):
        settings_of(tmp_path, more)
    text = path.read_text().replace("waits: {", extra + "waits: {").replace("ws://", "http://")
    path.write_text(text)
    with pytest.raises(ScenarioError) as caught:
        read_settings(path)
    lines = {re.sub(r"^line \d+: ", "", line.removeprefix(f"{path}: ")) for line in str(caught.value).splitlines()}
    assert lines == {
        "rosbridge: must be like ws://127.0.0.1:9090, got 'http://127.0.0.1:1'",
        "map.free_thresh: must be below occupied_thresh (0.65)",
        "map.tpic: unknown field, did you mean 'topic'?; the fields here are topic, updates, topics, frame, "
        "free_thresh, occupied_thresh, compression, keepout, speed",
        "controller.goal_checker_id: must be a text, got 3",
        "goal.recover_rovers: must be true or false, got 'perhaps'",
        "robots[2].namespace: must begin with '/', got 'c2'",
        "robots[2].drive: must be follow_path or navigate_to_pose, got 'fly'",
        "robots[2].base_frame: 'carrier1/base_link' of /tf is also that of carrier1",
    }


def test_a_state_reads_back_unchanged(tmp_path: Path) -> None:
    journal = Journal(tmp_path / "state")
    assert journal.read() is None
    record = Record(mission="m", frame=FRAME, after=3, aboard={"a": "b"}, report={"n": 1, "t_ms": 2})
    journal.write(record)
    assert journal.read() == record
    journal.forget()
    assert journal.read() is None


STATE = json.dumps({"version": 1, "mission": "m", "frame": FRAME})


@pytest.mark.parametrize(
    "text",
    [
        "",
        "{}",
        "[]",
        '{"version": 9}',
        '{"version": 1, "other": 2}',
        "[" * 100_000,
        STATE[:-10],
        STATE.replace('"m"', "7"),
        STATE.replace('"width": 1', '"width": 1e99'),
        STATE.replace('"width": 1', '"width": -1'),
        STATE.replace('"origin_m": [0.0, ', '"origin_m": ['),
        STATE.replace("}}", '}, "active_commands": [{}]}'),
        STATE.replace("}}", '}, "aboard": 3}'),
    ],
)
def test_an_invalid_state_file_is_refused(tmp_path: Path, text: str) -> None:
    (tmp_path / "state").write_text(text)
    with pytest.raises(InputError, match="is not a state file of `marsupial ros`"):
        Journal(tmp_path / "state").read()


def test_an_unwritable_state_file_is_reported_before_a_mission_begins(tmp_path: Path) -> None:
    with pytest.raises(UsageError, match="can't be written"):
        Journal(tmp_path / "missing" / "state").read()


def test_a_state_of_other_robots_is_refused(tmp_path: Path) -> None:
    journal = Journal(tmp_path / "state")
    journal.write(Record(mission="m", frame=FRAME, aboard={"rover9": "carrier9"}, lost=["carrier1"]))
    bridge = Bridge(
        settings_of(tmp_path),
        Rosbridge("ws://127.0.0.1:1", []),
        AsyncClient("http://127.0.0.1:1"),
        journal,
        print,
        lambda: 0,
    )
    with pytest.raises(InputError, match="belongs to a mission with other robots: rover9"):
        asyncio.run(bridge.run())


def test_settings_are_checked_without_ros(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    settings_of(tmp_path)
    assert main(["ros", str(tmp_path / "fleet.yaml"), "--check"]) == 0
    assert "2 robots, map on /map, rosbridge at ws://127.0.0.1:1" in capsys.readouterr().err
    (tmp_path / "fleet.yaml").write_text("format: marsupial-ros\nversion: 1\n")
    assert main(["ros", str(tmp_path / "fleet.yaml"), "--check"]) == 3
    assert "robot_types: missing" in capsys.readouterr().err


def test_the_interfaces_of_docking_have_the_fields_that_goals_have(bench: FleetBench) -> None:
    bench.command(2, "undock", robot="rover1", carrier="carrier1", cell=[3, 2], point_m=[3.5, 2.5])
    folder = Path(__file__).parents[3] / "services/marsupial_ros/marsupial_interfaces/action"
    for name in ("Dock", "Undock"):
        goal, result, _ = (folder / f"{name}.action").read_text().split("---\n")
        fields = [[line.split()[1] for line in part.splitlines() if line and line[0] != "#"] for part in (goal, result)]
        assert fields == [list(bench.actions.sent[-1][2]), ["success", "message"]]
