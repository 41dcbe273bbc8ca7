"""Robots that somebody else leads, and robots whose place is unknown."""

import asyncio
import math
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("websockets")

from ros_missions import drive, robots_in_rooms
from ros_parts import FleetBench
from support.services.servers import Server
from support.waiting import wait_until_async

from marsupial_ros.robots import IDLE_S
from marsupial_ros.transport import ActionResult

TAKEN = f"carrier1: somebody else leads it: left alone until it has stood still for {IDLE_S:g} s"


async def test_a_robot_that_an_operator_drives_is_left_alone_until_it_stands(server: Server, tmp_path: Path) -> None:
    async with robots_in_rooms() as (ros, user):
        work = asyncio.ensure_future(drive(*user.bridge(server, ros, tmp_path)))
        await wait_until_async(lambda: "/carrier1/follow_path" in ros.running)
        robot = ros.robots["carrier1"]
        there = (robot.at[0] + 0.3, robot.at[1]), (robot.at[0] + 0.3, robot.at[1] - 0.6)
        await ros.take_over("carrier1", *(there * 3), there[1])
        await wait_until_async(lambda: TAKEN in user.said or work.done())
        await wait_until_async(lambda: robot.goal is None or not robot.goal.id.startswith("operator") or work.done())
        assert math.dist(robot.at, there[1]) < 0.2, "the operator's goal was reached"
        outcome = await work
    assert outcome.ended["status"] == "complete", (outcome, user.said)
    assert not any("failed" in text for text in user.said)


def replaced(bench: FleetBench, values: Any, *xs: float) -> None:
    """Replace the goal of a drive; the robot then is at these places, one per second."""
    bench.drive()
    bench.fleet.ended(ActionResult("m:1:0.1", 6, values))
    for now_s, x in enumerate(xs, 1):
        bench.at("carrier1", x, 2.5, now_s)
        bench.fleet.watch(float(now_s))


@pytest.mark.parametrize("values", [{"error_code": 0, "error_msg": ""}, {}])
def test_a_goal_that_somebody_replaces_is_refused_when_the_robot_stands_and_not_fought(
    bench: FleetBench, values: Any
) -> None:
    replaced(bench, values, 2.5, 3.0, 3.5, 4.0)
    assert TAKEN in bench.said
    assert (len(bench.actions.sent), bench.fleet.unreported.any) == (1, False)
    bench.fleet.watch(4.0 + IDLE_S + 0.1)
    (declined,) = bench.fleet.report()["declined"]
    assert declined["reason"] == "/carrier1/follow_path: aborted"


def test_a_drive_that_ends_without_a_reason_where_the_robot_stands_has_failed(bench: FleetBench) -> None:
    replaced(bench, {}, *[2.5] * 8)
    assert [failed["id"] for failed in bench.fleet.report()["failed"]] == [1]
    assert not any("somebody" in text for text in bench.said)


def test_a_stop_ends_a_drive_that_was_replaced_and_the_next_one_waits(bench: FleetBench) -> None:
    replaced(bench, {"error_code": 0}, 2.5, 3.0)
    bench.command(1, "stop")
    assert [one["id"] for one in bench.fleet.report()["declined"]] == [1]
    bench.command(2, "drive", route=[], route_m=[[x + 0.5, 2.5] for x in range(2, 9)])
    bench.fleet.watch(3.0)
    assert len(bench.actions.sent) == 1
    bench.fleet.watch(2.1 + IDLE_S)
    assert [goal for goal, _, _ in bench.actions.sent] == ["m:1:0.1", "m:2:0.1"]


def test_a_robot_whose_place_is_unknown_is_not_driven(bench: FleetBench) -> None:
    bench.fleet.robots["rover1"].aboard = None
    bench.command(1, "drive", robot="rover1", route=[], route_m=[[3.5, 2.5], [4.5, 2.5]])
    assert bench.actions.sent == []
    gap = "nothing there or on /tf_static places rover1/base_link in another frame"
    assert bench.fleet.missing_poses(0.0) == [f"rover1 (no map -> rover1/base_link on /tf: {gap})"]
    bench.at("rover1", 3.5, 2.5)
    bench.fleet.watch(0.1)
    assert [goal for goal, _, _ in bench.actions.sent] == ["m:1:0.1"]


def test_a_robot_that_is_silent_is_not_driven_on(bench: FleetBench) -> None:
    bench.drive()
    bench.fleet.watch(61.0)
    assert [failed["id"] for failed in bench.fleet.report()["declined"]] == [1]
    command = {
        "id": 2,
        "robot": "carrier1",
        "name": "drive",
        "revision": 1,
        "route": [],
        "route_m": [[2.5, 2.5], [4, 2]],
    }
    bench.fleet.execute(command, 62.0)  # type: ignore[arg-type]
    bench.fleet.watch(63.0)
    assert len(bench.actions.sent) == 1
    bench.at("carrier1", 2.5, 2.5, 64.0)
    bench.fleet.watch(64.0)
    assert len(bench.actions.sent) == 2
