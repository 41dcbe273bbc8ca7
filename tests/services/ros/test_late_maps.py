"""Maps that come slowly, or not at all for a while."""

import asyncio
from pathlib import Path

import pytest

pytest.importorskip("websockets")

from fake_ros import FakeRos
from ros_missions import drive, robots_in_rooms
from ros_parts import FleetBench, grid_message, tracker_of
from support.services.servers import Server
from support.waiting import wait_until_async

from marsupial_ros.fleet import MAP_LATE_S, RobotFleet
from marsupial_ros.map_tracker import MapTracker
from marsupial_ros.messages import occupancy_in
from marsupial_ros.transport import ActionResult


def drives(ros: FakeRos) -> int:
    return len([goal for goal in ros.goals if goal["action"].endswith("follow_path")])


async def test_a_map_that_stalls_is_told_and_makes_no_robot_dance(server: Server, tmp_path: Path) -> None:
    async with robots_in_rooms() as (ros, user):
        work = asyncio.ensure_future(drive(*user.bridge(server, ros, tmp_path)))
        await wait_until_async(lambda: drives(ros) > 2 or work.done())
        ros.faults.stalled, before = True, drives(ros)
        await wait_until_async(lambda: f"no map on /map for {MAP_LATE_S:g} s" in user.said or work.done())
        meanwhile = drives(ros) - before
        ros.faults.stalled = False
        outcome = await work
    assert outcome.ended["status"] == "complete", (outcome, user.said)
    assert "maps arrive on /map again" in user.said
    assert meanwhile < 10


async def test_slow_maps_need_no_more_drives(server: Server, tmp_path: Path) -> None:
    async with robots_in_rooms() as (ros, user):
        ros.faults.map_steps = 100
        outcome = await drive(*user.bridge(server, ros, tmp_path))
    assert outcome.ended["status"] == "complete", (outcome, user.said)
    assert drives(ros) < 60
    assert not any("no map" in text for text in user.said)


def arrived(bench: FleetBench, *rows: list[int]) -> tuple[RobotFleet, MapTracker]:
    """Return a fleet whose carrier has arrived on this map, made 9 s after another one, and its tracker."""
    tracker = tracker_of(*rows)
    tracker.date(-10.0)
    tracker.date(-1.0)
    bench.fleet = RobotFleet(bench.settings, bench.frames, tracker, bench.actions, bench.said.append)  # type: ignore[arg-type]
    bench.fleet.mission = "m"
    bench.fleet.place()
    bench.drive()
    bench.at("carrier1", 8.5, 2.5)
    bench.fleet.ended(ActionResult("m:1:0.1", 4, {"error_code": 0}))
    bench.fleet.watch(0.5)
    return bench.fleet, tracker


OPEN = [[0] * 12 + [-1] * 8] * 10
CLOSED = [[100] * 20, *[[100, *[0] * 18, 100]] * 8, [100] * 20]


def test_a_drive_to_a_frontier_ends_with_a_map_that_was_made_later(bench: FleetBench) -> None:
    fleet, tracker = arrived(bench, *OPEN)
    tracker.date(0.4)  # made before the robot arrived
    fleet.watch(1.0)
    assert not fleet.unreported.any
    tracker.take(occupancy_in(grid_message(OPEN)))
    tracker.date(1.5)
    fleet.watch(2.0)
    assert fleet.report()["finished"] == [1]


def test_a_robot_at_a_frontier_does_not_wait_for_ever(bench: FleetBench) -> None:
    fleet, _ = arrived(bench, *OPEN)
    fleet.watch(0.6 + MAP_LATE_S)
    assert fleet.report()["finished"] == [1]


def test_a_drive_within_known_ground_ends_at_once(bench: FleetBench) -> None:
    assert arrived(bench, *CLOSED)[0].report()["finished"] == [1]


def test_a_map_that_is_published_once_is_not_waited_for(bench: FleetBench) -> None:
    bench.drive()
    bench.at("carrier1", 8.5, 2.5)
    bench.fleet.ended(ActionResult("m:1:0.1", 4, {"error_code": 0}))
    assert bench.fleet.report()["finished"] == [1]
