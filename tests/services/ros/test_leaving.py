"""The end of the bridge: goals are cancelled and the connection is closed, whatever the cause."""

import asyncio
import json
import signal
import sys
from collections.abc import Awaitable, Callable
from pathlib import Path

import pytest

pytest.importorskip("websockets")

from fake_ros import FakeRos
from ros_missions import BridgeUser, drive, robots_in_rooms
from ros_rooms import settings_text
from support.services.servers import Server
from support.waiting import HANG_S, wait_until_async

import marsupial_ros.bridge as bridges
from marsupial_client import ClientError
from marsupial_ros import rosbridge
from marsupial_ros.bridge import Bridge, BridgeOutcome

NORMAL = 1000
BROKEN = 1006


def drives(ros: FakeRos) -> bool:
    return any(action.endswith("follow_path") for action in ros.running)


def docks(ros: FakeRos) -> bool:
    return any(action.endswith("dock") for action in ros.running)


@pytest.fixture(autouse=True)
def patient(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let bridges wait without a practical limit."""
    monkeypatch.setattr(bridges, "STOP_S", HANG_S)
    monkeypatch.setattr(bridges, "LEAVE_S", HANG_S)
    monkeypatch.setattr(rosbridge, "CLOSE_S", HANG_S)


class Broken(Exception):
    """An arbitrary failure within the bridge."""


Work = asyncio.Future[BridgeOutcome]


async def user_leaves(user: BridgeUser, bridge: Bridge, work: Work) -> None:
    user.stops = 2
    await work


async def user_ends_the_mission(user: BridgeUser, bridge: Bridge, work: Work) -> None:
    user.stops = 1
    await work


async def task_is_cancelled(user: BridgeUser, bridge: Bridge, work: Work) -> None:
    work.cancel()
    await asyncio.gather(work, return_exceptions=True)


async def bridge_breaks(user: BridgeUser, bridge: Bridge, work: Work) -> None:
    def due(n: int) -> bool:
        raise Broken

    bridge._due = due  # type: ignore[method-assign]
    with pytest.raises(Broken):
        await work


CASES = [
    (user_leaves, drives),
    (user_leaves, docks),
    (user_ends_the_mission, drives),
    (user_ends_the_mission, docks),
    (task_is_cancelled, drives),
    (bridge_breaks, drives),
]


@pytest.mark.parametrize(("end", "under_way"), CASES)
async def test_a_bridge_that_ends_leaves_no_goal_and_closes_normally(
    server: Server,
    tmp_path: Path,
    end: Callable[[BridgeUser, Bridge, Work], Awaitable[None]],
    under_way: Callable[[FakeRos], bool],
) -> None:
    async with robots_in_rooms() as (ros, user):
        bridge, client = user.bridge(server, ros, tmp_path, tmp_path / "state")
        work = asyncio.ensure_future(drive(bridge, client))
        await wait_until_async(lambda: under_way(ros))
        ros.speedup = 1.0  # so that no goal ends by itself
        ros.faults.ignored_cancels = len(ros.running)  # the first cancel requests are ignored
        await end(user, bridge, work)
        assert ros.running == []
        await wait_until_async(lambda: ros.closes)
    assert ros.closes == [NORMAL]


async def test_a_bridge_without_its_service_leaves_no_goal(tmp_path: Path) -> None:
    async with robots_in_rooms() as (ros, user):
        with Server(tmp_path / "data") as own:
            bridge, client = user.bridge(own, ros, tmp_path)
            work = asyncio.ensure_future(drive(bridge, client))
            await wait_until_async(lambda: drives(ros))
            ros.speedup = 1.0
            own.kill()
            client._session.service.patience_s = 0.5
            with pytest.raises(ClientError):
                await work
            assert ros.running == []
            await wait_until_async(lambda: ros.closes)
    assert ros.closes == [NORMAL]


async def test_a_mission_that_the_service_does_not_end_stays_open(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(bridges, "STOP_S", 0.2)
    async with robots_in_rooms() as (ros, user):
        with Server(tmp_path / "data") as own:
            work = asyncio.ensure_future(drive(*user.bridge(own, ros, tmp_path, tmp_path / "state")))
            await wait_until_async(lambda: drives(ros))
            ros.speedup = 1.0
            own.kill()
            user.stops = 1
            assert (await work).ended is None
            assert ros.running == []
    assert (tmp_path / "state").exists()


async def test_goals_that_do_not_end_delay_the_bridge_briefly_and_are_reported(
    server: Server, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(bridges, "LEAVE_S", 0.2)
    async with robots_in_rooms() as (ros, user):
        for robot in ros.robots.values():
            robot.stuck = True
        work = asyncio.ensure_future(drive(*user.bridge(server, ros, tmp_path)))
        await wait_until_async(lambda: len(ros.running) == 2)
        ros.speedup, ros.faults.ignored_cancels = 0.1, 10**6
        user.stops = 2
        await work
        await wait_until_async(lambda: ros.closes)
    assert ros.closes == [NORMAL]
    assert len([text for text in user.said if text.endswith("was cancelled, but its end was not confirmed")]) == 2


async def test_goals_are_cancelled_over_a_reopened_connection_and_none_is_resent(
    server: Server, tmp_path: Path
) -> None:
    async with robots_in_rooms() as (ros, user):
        work = asyncio.ensure_future(drive(*user.bridge(server, ros, tmp_path)))
        await wait_until_async(lambda: len(ros.running) == 2)
        ros.speedup = 0.1
        sent = len(ros.goals)
        user.stops = 2
        await ros.cut()
        await wait_until_async(
            lambda: not ros.running
        )  # the first connection, which would have received their ends, is gone
        assert len(ros.goals) == sent
        work.cancel()
        await asyncio.gather(work, return_exceptions=True)
        await wait_until_async(lambda: len(ros.closes) == 2)
    assert ros.closes == [BROKEN, NORMAL]


@pytest.mark.skipif(sys.platform == "win32", reason="Windows ends a process at once")
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
async def test_two_signals_cancel_all_goals(server: Server, tmp_path: Path, number: signal.Signals) -> None:
    async with robots_in_rooms() as (ros, _):
        path = tmp_path / "fleet.yaml"
        path.write_text(settings_text(ros.url, list(ros.robots.values())))
        command = [sys.executable, "-m", "marsupial.cli.main", "ros", str(path), "--server", server.url]
        quiet = asyncio.subprocess.DEVNULL
        process = await asyncio.create_subprocess_exec(
            *command, "--json", "--state", str(tmp_path / "state"), stdout=asyncio.subprocess.PIPE, stderr=quiet
        )
        await wait_until_async(lambda: len(ros.running) == 2)
        ros.speedup = 1.0
        process.send_signal(number)
        await wait_until_async(lambda: ros.cancelled or not drives(ros))
        process.send_signal(number)
        out, _ = await process.communicate()
        assert json.loads(out)["status"] == "cancelled"
        assert ros.running == []
        await wait_until_async(lambda: ros.closes)
    assert ros.closes == [NORMAL]
