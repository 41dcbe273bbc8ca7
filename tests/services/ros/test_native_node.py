"""The node of ROS 2, on a stand-in for rclpy: whole missions and faults, what it shows, services, signals."""

from __future__ import annotations

import asyncio
import os
import re
import shlex
import shutil
import signal
import subprocess
import sys
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import Any

import pytest

pytest.importorskip("websockets")

from fake_rclpy import FakeRclpy
from fake_ros import FakeRos
from ros_rooms import rooms, settings_text, team
from support.services.servers import START, Server
from support.waiting import wait_until_async

from marsupial.errors import UsageError
from marsupial_client import AsyncClient, ClientError

Start = Callable[..., Any]


def native_modules() -> list[str]:
    return [name for name in sys.modules if name.startswith("marsupial_ros.native")]


@asynccontextmanager
async def node_in_rooms(
    monkeypatch: pytest.MonkeyPatch, folder: Path, server: str, **parameters: Any
) -> AsyncIterator[tuple[FakeRos, FakeRclpy, ModuleType]]:
    """Yield robots in the rooms, the stand-in, and the node's main module, with its settings for them."""
    grid = rooms()
    async with FakeRos(grid, team(grid)) as ros:
        path = folder / "fleet.yaml"
        path.write_text(settings_text("ws://127.0.0.1:1", list(ros.robots.values())))
        rclpy = FakeRclpy(ros, settings=str(path), server=server, **parameters)
        rclpy.install(monkeypatch)
        for name in native_modules():
            del sys.modules[name]
        from marsupial_ros.native import display, main

        monkeypatch.setattr(display, "SHOW_S", 0.05)  # simulated time is faster
        try:
            yield ros, rclpy, main
        finally:
            for name in native_modules():  # they know the stand-in
                del sys.modules[name]


async def test_a_node_leads_a_mission_and_shows_it(
    server: Server, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    async with node_in_rooms(monkeypatch, tmp_path, server.url) as (ros, rclpy, main):
        outcome = await main.run_node()
    assert outcome.ended["status"] == "complete", (outcome, rclpy.logged)
    assert [robot.carrier is not None for robot in ros.robots.values() if robot.kind.name == "rover"] == [True, True]
    assert (ros.running, rclpy.open_nodes) == ([], 0)
    states = [message["data"] for message in rclpy.published["~/state"]]
    assert states[-1].startswith("complete: ")
    assert rclpy.logged[-1] == f"mission {states[-1]}"
    assert "running" in states
    shown = [one for message in rclpy.published["~/plan"] for one in message["markers"]]
    assert {"targets", "meeting points", "plan carrier1", "route carrier1"} <= {one.get("ns") for one in shown}
    sent = [g["args"]["path"]["poses"][-1] for g in ros.goals if g["action"] == "/carrier1/follow_path"]
    goals = [pose["pose"]["position"] for pose in sent]
    ends = [one["points"][-1] for one in shown if one.get("ns") == "route carrier1"]
    # of the drives, a busy machine shows some only
    assert any({"x": at["x"], "y": at["y"]} in ends for at in goals)
    statuses = rclpy.published["/diagnostics"][-1]["status"]
    assert [one["name"] for one in statuses] == [
        f"marsupial: {name}" for name in ("mission", "carrier1", "rover1", "carrier2", "rover2")
    ]
    assert {one["level"] for one in statuses} == {b"\x00"}


async def test_maps_and_static_transforms_are_latched(
    server: Server, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    async with node_in_rooms(monkeypatch, tmp_path, server.url) as (_, rclpy, main):
        work = asyncio.ensure_future(main.run_node())
        await wait_until_async(lambda: "/clock" in rclpy.qos)
        signal.raise_signal(signal.SIGTERM)
        signal.raise_signal(signal.SIGTERM)
        await work
    durability = {topic: profile.durability for topic, profile in rclpy.qos.items()}
    assert durability == {
        "/map": "transient_local",
        "/map_updates": "volatile",
        "/tf": "volatile",
        "/tf_static": "transient_local",
        "/clock": "volatile",
    }
    assert rclpy.qos["/clock"].reliability == "best_effort"


async def test_a_node_waits_for_action_servers_and_asks_again_those_that_reject_goals(
    server: Server, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    async with node_in_rooms(monkeypatch, tmp_path, server.url) as (ros, rclpy, main):
        ros.faults.absent = {"/carrier1/follow_path"}
        ros.faults.rejecting = {f"/{name}/follow_path" for name in ros.robots}
        work = asyncio.ensure_future(main.run_node())
        missing = "waiting for /carrier1/follow_path, an action server"
        await wait_until_async(lambda: missing in rclpy.logged or work.done())
        ros.faults.absent = set()
        told = "nav2 of carrier1 does not accept goals"
        await wait_until_async(lambda: any(text.startswith(told) for text in rclpy.logged) or work.done())
        ros.faults.absent, ros.faults.rejecting = ros.faults.rejecting, set()  # nav2 restarts
        await wait_until_async(lambda: not ros.running)
        ros.faults.absent = set()
        outcome = await work
    assert outcome.ended["status"] == "complete", (outcome, rclpy.logged)
    assert "carrier1: goals are accepted again" in rclpy.logged
    assert not any("failed" in text or "lost" in text for text in rclpy.logged)


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
async def test_a_signal_ends_the_mission_and_leaves_no_goal(
    server: Server, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, number: int
) -> None:
    async with node_in_rooms(monkeypatch, tmp_path, server.url) as (ros, rclpy, main):
        work = asyncio.ensure_future(main.run_node())
        await wait_until_async(lambda: any(action.endswith("follow_path") for action in ros.running) or work.done())
        signal.raise_signal(number)
        signal.raise_signal(signal.SIGINT)  # at once, as `ros2 launch` does
        outcome = await work
    assert (outcome.ended["status"], ros.running, rclpy.open_nodes) == ("cancelled", [], 0)
    assert rclpy.published["~/state"][-1]["data"].startswith("cancelled")


async def test_other_nodes_pause_resume_and_wind_down_the_mission(
    server: Server, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    async with node_in_rooms(monkeypatch, tmp_path, server.url) as (ros, rclpy, main):
        ros.faults.absent = {"/carrier1/follow_path"}
        work = asyncio.ensure_future(main.run_node())
        await wait_until_async(lambda: "~/pause" in rclpy.services and "/clock" in rclpy.qos)
        assert await rclpy.trigger("~/pause") == (False, "the mission has not begun")
        ros.faults.absent = set()
        await wait_until_async(lambda: ros.running or work.done())
        success, text = await rclpy.trigger("~/pause")
        assert (success, text) in [(True, "mission paused"), (True, "mission pausing")]
        await wait_until_async(lambda: not ros.running)
        assert (await rclpy.trigger("~/resume"))[0]
        assert (await rclpy.trigger("~/wind_down"))[0]
        outcome = await work
    assert outcome.ended["reason"].startswith("called back by the operator"), (outcome, rclpy.logged)


async def test_a_package_that_is_not_installed_ends_the_node_with_its_name(
    server: Server, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    async with node_in_rooms(monkeypatch, tmp_path, server.url) as (_, rclpy, main):
        rclpy.missing = {"marsupial_interfaces"}
        with pytest.raises(UsageError, match="ROS has no marsupial_interfaces/action/Dock: install marsupial_interf"):
            await main.run_node()
    assert rclpy.open_nodes == 0


async def test_a_local_service_is_started_and_ended(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    serve = shlex.join([*START, "--port", "0", "--data", str(tmp_path / "data")])
    async with node_in_rooms(monkeypatch, tmp_path, "local", serve=serve) as (_, _, main):
        node = main.RosNode("marsupial")
        async with main.service_of(node) as url, AsyncClient(url) as client:
            await client.ready()
        async with AsyncClient(url, patience_s=0) as client:
            with pytest.raises(ClientError):
                await client.ready()


@pytest.mark.parametrize(
    ("serve", "reason"), [("no-such-program", "can't be started"), (f"{sys.executable} -c 1", "has ended")]
)
async def test_a_local_service_that_does_not_start_is_told(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, serve: str, reason: str
) -> None:
    async with node_in_rooms(monkeypatch, tmp_path, "local", serve=serve) as (_, _, main):
        with pytest.raises(UsageError, match=reason):
            await main.run_node()


@pytest.mark.parametrize(("simulated", "clock"), [(True, "/clock"), (False, None)])
async def test_simulated_time_is_a_parameter(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, simulated: bool, clock: str | None
) -> None:
    async with node_in_rooms(monkeypatch, tmp_path, "", use_sim_time=simulated) as (_, rclpy, main):
        path = Path(rclpy.parameters["settings"])
        path.write_text(path.read_text().replace("clock: /clock\n", ""))
        assert main.settings_of(main.RosNode("marsupial")).clock == clock
        rclpy.parameters["settings"] = ""
        with pytest.raises(UsageError, match="`settings`"):
            main.settings_of(main.RosNode("marsupial"))


@pytest.mark.parametrize(("status", "code"), [("complete", 0), ("cancelled", 0), ("stalled", 1), (None, 0)])
async def test_a_node_that_ends_cleanly_exits_with_0(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, status: str | None, code: int
) -> None:
    async with node_in_rooms(monkeypatch, tmp_path, "") as (_, _, main):
        ended = None if status is None else {"status": status}

        async def run_node() -> Any:
            return SimpleNamespace(ended=ended)

        monkeypatch.setattr(main, "run_node", run_node)
        assert await asyncio.to_thread(main.main) == code


def test_the_ros_package_installs_what_launch_needs(tmp_path: Path) -> None:
    pytest.importorskip("setuptools")
    services = Path(__file__).resolve().parents[3] / "services"
    package = shutil.copytree(services / "marsupial_ros" / "marsupial_node", tmp_path / "marsupial_node")
    command = [sys.executable, "setup.py", "-q", "install", "--prefix", str(tmp_path / "install")]
    command += ["--single-version-externally-managed", "--record", str(tmp_path / "record")]
    environment = {**os.environ, "PYTHONWARNINGS": "ignore"}
    done = subprocess.run(command, cwd=package, env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    installed = {path.relative_to(tmp_path / "install").as_posix() for path in (tmp_path / "install").rglob("*")}
    assert {
        "share/ament_index/resource_index/packages/marsupial_node",
        "share/marsupial_node/package.xml",
        "share/marsupial_node/launch/fleet.launch.py",
        "lib/marsupial_node/fleet",
    } <= installed
    program = (tmp_path / "install" / "lib" / "marsupial_node" / "fleet").read_text()
    assert program.startswith("#!/usr/bin/env python3\n")
    launch = (package / "launch" / "fleet.launch.py").read_text()
    source = (services / "marsupial_ros" / "native" / "main.py").read_text()
    for name in re.findall(r'parameter\("(\w+)"', source):
        assert f'"{name}": ' in launch
