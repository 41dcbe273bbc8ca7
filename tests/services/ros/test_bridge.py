"""Whole missions with a real server, the bridge, and the fake rosbridge."""

import asyncio
import itertools
import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("websockets")

import numpy as np
from ros_missions import drive, robots_in_rooms
from support.services.servers import Server
from support.waiting import HANG_S, wait_until_async

from marsupial.model.grid import UNKNOWN


async def test_a_team_explores_the_rooms_and_comes_back_aboard(server: Server, tmp_path: Path) -> None:
    maps = itertools.count(1)

    def shrinking(message: dict[str, Any]) -> dict[str, Any]:
        """Give one map without the robots and nearly all cells, as a mapper does that starts anew."""
        if next(maps) != 9:
            return message
        cells = np.array(message["data"]).reshape(message["info"]["height"], -1)[:4, :4]
        return {**message, "info": {**message["info"], "width": 4, "height": 4}, "data": cells.ravel().tolist()}

    async with robots_in_rooms() as (ros, user):
        ros.edit_map = shrinking
        outcome = await drive(*user.bridge(server, ros, tmp_path))
    assert outcome.ended["status"] == "complete", (outcome, user.said)
    assert [robot.carrier is not None for robot in ros.robots.values() if robot.kind.name == "rover"] == [True, True]
    actions = [goal["action"].rsplit("/", 1)[1] for goal in ros.goals]
    assert actions.count("undock") >= 2
    assert actions.count("dock") == actions.count("undock")
    assert len(actions) < 80
    assert {goal["action_type"] for goal in ros.goals} == {
        "nav2_msgs/action/FollowPath",
        "marsupial_interfaces/action/Dock",
        "marsupial_interfaces/action/Undock",
    }
    floor = ros.truth.cells == 1
    assert np.count_nonzero(ros.known[floor] == UNKNOWN) < 0.03 * np.count_nonzero(floor)
    assert (ros.running, ros.unknown_ops) == ([], [])


async def test_a_lost_connection_and_a_restarted_bridge_lose_nothing(server: Server, tmp_path: Path) -> None:
    state = tmp_path / "state.json"
    async with robots_in_rooms() as (ros, user):
        first = asyncio.ensure_future(drive(*user.bridge(server, ros, tmp_path, state)))
        await wait_until_async(lambda: "/rover1/undock" in ros.running or "/rover2/undock" in ros.running)
        await ros.cut()
        await wait_until_async(lambda: ros.connections == 2 and ros.running)
        await asyncio.sleep(0.3)
        assert state.exists()
        first.cancel()
        await asyncio.gather(first, return_exceptions=True)
        outcome = await drive(*user.bridge(server, ros, tmp_path, state))
    assert outcome.ended["status"] == "complete", (outcome, user.said)
    assert len([text for text in user.said if text.endswith(" started")]) == 1
    assert any("resumed after report" in text for text in user.said)
    names = [goal["id"] for goal in ros.goals]
    assert len(set(names)) == len(names)
    assert any(name.endswith(":0.2") for name in names), "what was under way was sent again"
    assert any(name.endswith(":1.1") for name in names)
    assert not state.exists()


async def test_a_resumed_mission_ignores_maps_of_another_resolution(server: Server, tmp_path: Path) -> None:
    state = tmp_path / "state.json"

    def coarser(message: dict[str, Any]) -> dict[str, Any]:
        return {**message, "info": {**message["info"], "resolution": 0.5}}

    async with robots_in_rooms() as (ros, user):
        first = asyncio.ensure_future(drive(*user.bridge(server, ros, tmp_path, state)))
        await wait_until_async(lambda: "/carrier1/follow_path" in ros.running)
        first.cancel()
        await asyncio.gather(first, return_exceptions=True)
        ros.edit_map = coarser
        second = asyncio.ensure_future(drive(*user.bridge(server, ros, tmp_path, state)))
        passed = "/map: message ignored: the resolution of the map has changed: it was 0.25 m, now 0.5 m"
        await wait_until_async(lambda: {passed, "waiting for a map on /map"} <= set(user.said) or second.done())
        ros.edit_map = lambda message: message
        outcome = await second
    assert outcome.ended["status"] == "complete", (outcome, user.said)


async def test_results_from_just_before_the_end_of_a_bridge_are_reported_by_the_next_one(
    server: Server, tmp_path: Path
) -> None:
    state = tmp_path / "state.json"
    async with robots_in_rooms() as (ros, user):
        bridge, client = user.bridge(server, ros, tmp_path, state)
        first = asyncio.ensure_future(drive(bridge, client))
        await wait_until_async(lambda: bridge._fleet.unreported.any)
        bridge._save()  # as happens when another message arrives at that moment
        assert json.loads(state.read_text())["unreported"]["finished"]
        first.cancel()
        await asyncio.gather(first, return_exceptions=True)
        outcome = await drive(*user.bridge(server, ros, tmp_path, state))
    assert outcome.ended["status"] == "complete"


async def test_a_user_who_stops_gets_the_mission_ended_and_its_robots_stopped(
    server: Server, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("marsupial_ros.bridge.STOP_S", HANG_S)
    async with robots_in_rooms() as (ros, user):
        work = asyncio.ensure_future(drive(*user.bridge(server, ros, tmp_path)))
        ros.speedup = 1.0  # so that no robot arrives before it is stopped
        await wait_until_async(lambda: any(action.endswith("follow_path") for action in ros.running))
        user.stops = 1
        outcome = await work
    assert outcome.ended["status"] == "cancelled"
    assert ros.cancelled
    assert ros.running == []


async def test_a_user_who_stops_twice_leaves_at_once_with_all_goals_cancelled(server: Server, tmp_path: Path) -> None:
    async with robots_in_rooms() as (ros, user):
        work = asyncio.ensure_future(drive(*user.bridge(server, ros, tmp_path)))
        await wait_until_async(lambda: len(ros.running) == 2)
        ros.speedup = 0.01  # so that no robot arrives before it is stopped
        await asyncio.sleep(0.1)  # the current step ends
        running = set(ros._running)
        user.stops = 2
        outcome = await work
        await wait_until_async(lambda: not ros.running)
    assert outcome.ended is None
    assert running
    assert running <= set(ros.cancelled)


@pytest.mark.parametrize("repeats", [False, True])
async def test_a_carrier_that_is_silent_or_repeats_its_transforms_is_reported_and_lost_with_its_rover(
    server: Server, tmp_path: Path, repeats: bool
) -> None:
    async with robots_in_rooms(waits="{silent_s: 5, lost_s: 15, stuck_s: 1000}") as (ros, user):
        work = asyncio.ensure_future(drive(*user.bridge(server, ros, tmp_path)))
        await wait_until_async(lambda: "/carrier2/follow_path" in ros.running)
        if repeats:
            ros.robots["carrier2"].stamp_s = ros.now_s
        else:
            ros.robots["carrier2"].silent = True
        await work
    missing = "no new map -> carrier2/base_link on /tf for"
    assert any(text.startswith(f"carrier2: {missing}") for text in user.said)
    assert f"carrier2: lost: {missing} 15 s" in user.said
    assert not any(text.startswith("carrier1: lost") for text in user.said)


async def test_a_rover_out_of_contact_is_heard_again_and_the_mission_is_completed(
    server: Server, tmp_path: Path
) -> None:
    async with robots_in_rooms(waits="{silent_s: 5, lost_s: 15, stuck_s: 120, handover_s: 120}") as (ros, user):
        rovers = [robot for robot in ros.robots.values() if robot.carrier is not None]
        for robot in rovers:
            robot.kind = replace(robot.kind, radio_range_m=4.0)
        work = asyncio.ensure_future(drive(*user.bridge(server, ros, tmp_path)))
        await wait_until_async(lambda: "/rover1/follow_path" in ros.running)
        ros.robots["rover1"].silent = True
        missing = "rover1: out of contact: no new map -> rover1/base_link on /tf for 5 s"
        await wait_until_async(lambda: missing in user.said or work.done())
        ros.robots["rover1"].silent = False
        outcome = await work
    assert outcome.ended["status"] == "complete", (outcome, user.said)
    assert "rover1: in contact again" in user.said
    assert not any("lost" in text or "failed" in text for text in user.said)


async def test_a_robot_without_progress_is_stuck_and_the_mission_continues(server: Server, tmp_path: Path) -> None:
    async with robots_in_rooms(waits="{silent_s: 60, lost_s: 120, stuck_s: 20, handover_s: 120}") as (ros, user):
        work = asyncio.ensure_future(drive(*user.bridge(server, ros, tmp_path)))
        await wait_until_async(lambda: "/carrier2/follow_path" in ros.running)
        ros.robots["carrier2"].stuck = True
        await wait_until_async(lambda: "carrier2: drive failed: no progress for 20 s" in user.said or work.done())
        ros.robots["carrier2"].stuck = False
        outcome = await work
    assert outcome.ended["status"] == "complete", (outcome, user.said)
    assert "carrier2: drive failed: no progress for 20 s" in user.said
    assert not any(text.startswith("carrier1: drive failed") for text in user.said)


async def test_missing_topics_before_a_mission_are_named(server: Server, tmp_path: Path) -> None:
    async with robots_in_rooms() as (ros, user):
        ros.robots["carrier2"].silent = True
        work = asyncio.ensure_future(drive(*user.bridge(server, ros, tmp_path)))
        await wait_until_async(lambda: any("carrier2" in text for text in user.said))
        user.stops = 1
        assert (await work).mission is None
    gap = "nothing there or on /tf_static places carrier2/base_footprint in another frame"
    assert f"waiting for carrier2 (no map -> carrier2/base_link on /tf: {gap})" in user.said
