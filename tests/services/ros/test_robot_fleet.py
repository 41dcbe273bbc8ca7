"""The robots of the bridge: their commands, losses, contact, and what is reported of them."""

from dataclasses import replace
from pathlib import Path

import pytest

pytest.importorskip("websockets")

import numpy as np
from ros_parts import FleetBench, tracker_of

from marsupial.errors import ScenarioError
from marsupial.model.grid import Grid
from marsupial_ros.bridge import brief_of
from marsupial_ros.fleet import SETTLED_S, RobotFleet
from marsupial_ros.ros_listener import Clock, RosListener, subscriptions
from marsupial_ros.settings import read_settings
from marsupial_ros.transport import ActionResult, Subscription


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
