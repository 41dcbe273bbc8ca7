"""Topics that other clients hold, publishers that come late, messages over a limit, and what the user is told."""

import asyncio
import itertools
import math
from pathlib import Path

import pytest

pytest.importorskip("websockets")

from ros_missions import drive, robots_in_rooms
from ros_parts import grid_message
from support.services.servers import Server
from support.waiting import wait_until_async
from test_ros_listener import FITTING, ListenerBench

import marsupial_ros.bridge as bridges
from marsupial_ros.goals import SPACING_M, thinned
from marsupial_ros.rosbridge import Rosbridge


async def test_latched_transforms_arrive_although_another_client_has_them(server: Server, tmp_path: Path) -> None:
    async with robots_in_rooms() as (ros, user):
        ros.faults.held = {"/tf_static"}
        outcome = await drive(*user.bridge(server, ros, tmp_path))
    assert outcome.ended["status"] == "complete", (outcome, user.said)
    assert not any("base_link" in text for text in user.said)


async def test_silent_topics_are_subscribed_to_again_and_the_user_is_told_where_to_look(
    server: Server, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(bridges, "RENEW_S", 0.3)
    monkeypatch.setattr(bridges, "REMIND_S", 0.3)
    async with robots_in_rooms() as (ros, user):
        ros.faults.late, ros.faults.held = {"/clock"}, {"tf_static"}
        work = asyncio.ensure_future(drive(*user.bridge(server, ros, tmp_path)))
        hint = f"{Rosbridge.hint}; `ros2 topic info -v /map` shows who publishes"
        await wait_until_async(lambda: hint in user.said or work.done())
        ros.faults.late = set()
        outcome = await work
    assert outcome.ended["status"] == "complete", (outcome, user.said)


async def test_a_goal_over_the_limit_of_rosbridge_fails_and_no_other(server: Server, tmp_path: Path) -> None:
    async with robots_in_rooms() as (ros, user):
        ros.faults.limit = 1500  # a long route of the first drives is more
        work = asyncio.ensure_future(drive(*user.bridge(server, ros, tmp_path)))
        failed = "bytes are more than rosbridge's max_message_size)"
        await wait_until_async(lambda: any(failed in text for text in user.said) or work.done())
        ros.faults.limit = None
        outcome = await work
    assert outcome.ended["status"] == "complete", (outcome, user.said)
    failures = [text for text in user.said if failed in text]
    assert failures, "no goal was over the limit"
    assert ros.connections == 1 + len(failures)


def test_straight_stretches_of_paths_have_few_points() -> None:
    there = [(0.05 * i, 0.0) for i in range(101)]
    up = [(5.0, 0.05 * i) for i in range(1, 41)]
    path = thinned([*there, *up])
    assert (path[0], path[-1]) == (there[0], up[-1])
    assert (5.0, 0.0) in path
    assert max(math.dist(a, b) for a, b in itertools.pairwise(path)) <= SPACING_M + 1e-9
    assert len(path) < 20


def test_a_new_reason_why_maps_are_ignored_is_told_and_that_they_are_used_again(tmp_path: Path) -> None:
    listeners = ListenerBench(tmp_path)
    coarse = grid_message([[0, 0]], resolution=0.1)
    odom = {**FITTING, "header": {"frame_id": "odom"}}
    for message in (coarse, coarse, odom, FITTING, FITTING):
        listeners.listener.message("/map", message)
    resolution, frame, again = listeners.said
    assert "resolution of the map has changed" in resolution
    assert "must be in the frame 'map', got 'odom'" in frame
    assert again == "/map: messages are used again"
