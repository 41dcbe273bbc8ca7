"""The node on a real ROS 2, where there is one: messages, whole missions, and faults of its robots."""

from __future__ import annotations

import asyncio
import os
import signal
import sys
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("rclpy")
pytest.importorskip("map_msgs")
pytest.importorskip("nav2_msgs")
pytest.importorskip("tf2_msgs")
pytest.importorskip("marsupial_interfaces")

from fake_ros import FakeRos
from real_robots import RealRobots
from ros_faults import link_of, turned, xyz
from ros_rooms import rooms, settings_text, team
from support.services.servers import Server
from support.waiting import wait_until_async

from marsupial_ros.bridge import BridgeOutcome
from marsupial_ros.messages import MAP_TYPE, TF_TYPE, link_in, occupancy_in
from marsupial_ros.native.main import run_node
from marsupial_ros.native.ros_node import RosNode
from marsupial_ros.native.transport import NativeTransport
from marsupial_ros.transport import ActionResult, Refusal, Subscription

SPEEDUP = 10.0  # each message passes through the middleware


@pytest.fixture(autouse=True)
def domain(monkeypatch: pytest.MonkeyPatch) -> None:
    """Meet no other nodes: neither those of other tests at the same time, nor other machines'."""
    monkeypatch.setenv("ROS_DOMAIN_ID", str(1 + os.getpid() % 100))
    monkeypatch.setenv("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")


class RealMission:
    """Robots in the rooms, and the node that leads them; `said` is what the node tells its user."""

    def __init__(self, ros: FakeRos, said: list[str], work: asyncio.Future[BridgeOutcome]) -> None:
        self.ros = ros
        self.said = said
        self.work = work

    async def until(self, happened: Callable[[], object]) -> None:
        await wait_until_async(lambda: happened() or self.work.done())

    def told(self, text: str) -> bool:
        return any(said.startswith(text) for said in self.said)


@asynccontextmanager
async def real_mission(
    monkeypatch: pytest.MonkeyPatch, folder: Path, server: Server, absent: frozenset[str] = frozenset()
) -> AsyncIterator[tuple[RealMission, RealRobots]]:
    said: list[str] = []
    grid = rooms()
    async with FakeRos(grid, team(grid), speedup=SPEEDUP) as ros:
        path = folder / "fleet.yaml"
        path.write_text(settings_text("ws://127.0.0.1:1", list(ros.robots.values())))
        arguments = [f"settings:={path}", f"server:={server.url}"]
        monkeypatch.setattr(sys, "argv", ["fleet", "--ros-args", *(x for one in arguments for x in ("-p", one))])
        monkeypatch.setattr(RosNode, "say", lambda _, text: said.append(text))
        ros.faults.absent = set(absent)
        robots = RealRobots(ros)
        try:
            yield RealMission(ros, said, asyncio.ensure_future(run_node())), robots
        finally:
            robots.close()


async def test_a_node_leads_a_mission_on_a_real_ros(
    server: Server, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    async with real_mission(monkeypatch, tmp_path, server) as (mission, _):
        outcome = await mission.work
    assert outcome.ended is not None
    assert outcome.ended["status"] == "complete", (outcome, mission.said)
    assert mission.ros.running == []
    rovers = [robot for robot in mission.ros.robots.values() if robot.kind.dock_ms]
    assert all(rover.carrier is not None for rover in rovers)


async def test_action_servers_that_come_late_or_reject_goals_on_a_real_ros(
    server: Server, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    late = frozenset({"/carrier1/follow_path"})
    async with real_mission(monkeypatch, tmp_path, server, late) as (mission, robots):
        await mission.until(lambda: "waiting for /carrier1/follow_path, an action server" in mission.said)
        mission.ros.faults.absent = set()
        mission.ros.faults.rejecting = {f"/{name}/follow_path" for name in mission.ros.robots}
        robots.serve()
        await mission.until(lambda: mission.told("nav2 of carrier1 does not accept goals"))
        mission.ros.faults.rejecting = set()
        outcome = await mission.work
    assert outcome.ended is not None
    assert outcome.ended["status"] == "complete", (outcome, mission.said)
    assert mission.told("carrier1: goals are accepted again")
    assert not any("failed" in text or "lost" in text for text in mission.said)


async def test_an_operator_and_a_map_without_robots_on_a_real_ros(
    server: Server, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    async with real_mission(monkeypatch, tmp_path, server) as (mission, _):
        ros, robot = mission.ros, mission.ros.robots["carrier1"]
        await mission.until(lambda: "/carrier1/follow_path" in ros.running)
        there = (robot.at[0] + 0.3, robot.at[1]), (robot.at[0] + 0.3, robot.at[1] - 0.6)
        await ros.take_over("carrier1", *(there * 3))
        await mission.until(lambda: mission.told("carrier1: somebody else leads it"))
        ros.edit_map = lambda message: {
            **message,
            "info": {**message["info"], "width": 2, "height": 2},
            "data": [0] * 4,
        }
        await mission.until(lambda: mission.told("/map does not contain carrier"))
        ros.edit_map = lambda message: message
        outcome = await mission.work
    assert outcome.ended is not None
    assert outcome.ended["status"] == "complete", (outcome, mission.said)
    assert not any(text.startswith("left out of a report") for text in mission.said)


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
async def test_a_signal_leaves_no_goal_on_a_real_ros(
    server: Server, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, number: int
) -> None:
    async with real_mission(monkeypatch, tmp_path, server) as (mission, _):
        await mission.until(lambda: any(action.endswith("follow_path") for action in mission.ros.running))
        signal.raise_signal(number)
        outcome = await mission.work
    assert outcome.ended is not None
    assert (outcome.ended["status"], mission.ros.running) == ("cancelled", [])


class Heard:
    """A listener that keeps what it gets."""

    def __init__(self) -> None:
        self.messages: dict[str, Any] = {}
        self.ends: list[ActionResult] = []

    def connected(self) -> None: ...

    def disconnected(self, reason: str) -> None: ...

    def message(self, topic: str, message: Any) -> None:
        self.messages[topic] = message

    def feedback(self, goal: str, values: Any) -> None: ...

    def ended(self, end: ActionResult) -> None:
        self.ends.append(end)

    def warning(self, text: str) -> None: ...


async def test_messages_and_absent_servers_of_a_real_ros() -> None:
    node, heard = RosNode("marsupial_test"), Heard()
    transport = NativeTransport(node, [Subscription("~/map", MAP_TYPE), Subscription("~/tf_static", TF_TYPE)])
    work = asyncio.ensure_future(transport.run(heard))
    try:
        origin = {"position": xyz(1.0, 2.0), "orientation": turned(0.0)}
        info = {"resolution": 0.5, "width": 2, "height": 1, "origin": origin}
        node.publisher("~/map", MAP_TYPE)({"header": {"frame_id": "map"}, "info": info, "data": [-1, 100]})
        node.publisher("~/tf_static", TF_TYPE)({"transforms": [link_of("map", "odom", (1.0, 2.0), 0.0, 3.5)]})
        transport.send_goal("g", "/nobody/follow_path", "nav2_msgs/action/FollowPath", {})
        await wait_until_async(lambda: (len(heard.messages) == 2 and heard.ends) or work.done())
        await transport.flush()
    finally:
        work.cancel()
        await asyncio.gather(work, return_exceptions=True)
        node.close()
    occupancy = occupancy_in(heard.messages["~/map"])
    assert (occupancy.values.tolist(), occupancy.origin_m) == ([[-1, 100]], (1.0, 2.0, 0.0))
    assert link_in(heard.messages["~/tf_static"]["transforms"][0])[:2] == ("map", "odom")
    assert [end.refusal for end in heard.ends] == [Refusal.ABSENT]
