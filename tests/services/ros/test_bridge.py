"""Whole missions: a real server, the bridge, and a rosbridge made for the test with simple robots behind it."""

from __future__ import annotations

import asyncio
import json
from collections.abc import Awaitable, Callable
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("websockets")

import numpy as np
from fake_ros import FakeRos, rooms, settings_text, team
from patience import HANG_S
from servers import Server

from marsupial.model.grid import UNKNOWN
from marsupial_client import AsyncClient
from marsupial_ros.bridge import Bridge, Outcome
from marsupial_ros.journal import Journal
from marsupial_ros.settings import read_settings


class Talk:
    """What the bridge has told the user; and how often that wants to stop."""

    def __init__(self, more: dict[str, str] | None = None) -> None:
        self.said: list[str] = []
        self.more = more
        self.stops = 0

    def bridge(
        self, server: Server, ros: FakeRos, folder: Path, state: Path | None = None
    ) -> tuple[Bridge, AsyncClient]:
        path = folder / "fleet.yaml"
        path.write_text(settings_text(ros.url, list(ros.bodies.values()), self.more))
        client = AsyncClient(server.url)
        return Bridge(read_settings(path), client, Journal(state), self.said.append, lambda: self.stops), client


async def drive(bridge: Bridge, client: AsyncClient) -> Outcome:
    async with client:
        return await bridge.run()


def play(story: Callable[[FakeRos, Talk], Awaitable[None]], **more: str) -> tuple[FakeRos, Talk]:
    """Play a story with robots in the rooms, and return how they and the talk are afterwards; `more` are settings."""
    grid = rooms()
    ros, talk = FakeRos(grid, team(grid)), Talk(more)

    async def within() -> None:
        async with ros:
            await asyncio.wait_for(story(ros, talk), HANG_S)

    asyncio.run(within())
    return ros, talk


async def until(holds: Callable[[], Any]) -> None:
    while not holds():
        await asyncio.sleep(0.01)


def test_a_team_explores_the_rooms_and_comes_back_aboard(server: Server, tmp_path: Path) -> None:
    outcomes: list[Outcome] = []

    async def story(ros: FakeRos, talk: Talk) -> None:
        outcomes.append(await drive(*talk.bridge(server, ros, tmp_path)))

    ros, talk = play(story)
    assert outcomes[0].ended is not None
    assert outcomes[0].ended["status"] == "complete", (outcomes[0], talk.said)
    assert [body.carrier is not None for body in ros.bodies.values() if body.kind.name == "rover"] == [True, True]
    actions = [goal["action"].rsplit("/", 1)[1] for goal in ros.goals]
    assert actions.count("undock") >= 2
    assert actions.count("dock") == actions.count("undock")
    assert {goal["action_type"] for goal in ros.goals} == {
        "nav2_msgs/action/FollowPath",
        "marsupial_interfaces/action/Dock",
        "marsupial_interfaces/action/Undock",
    }
    floor = ros.truth.cells == 1
    assert np.count_nonzero(ros.known[floor] == UNKNOWN) < 0.03 * np.count_nonzero(floor)
    assert (ros.running, ros.unknown_ops) == ([], [])


def test_a_lost_connection_and_a_bridge_started_again_lose_nothing(server: Server, tmp_path: Path) -> None:
    outcomes: list[Outcome] = []
    state = tmp_path / "state.json"

    async def story(ros: FakeRos, talk: Talk) -> None:
        first = asyncio.ensure_future(drive(*talk.bridge(server, ros, tmp_path, state)))
        await until(lambda: "/rover1/undock" in ros.running or "/rover2/undock" in ros.running)
        await ros.cut()
        await until(lambda: ros.connections == 2 and ros.running)
        await asyncio.sleep(0.3)
        assert state.exists()
        first.cancel()
        await asyncio.gather(first, return_exceptions=True)
        outcomes.append(await drive(*talk.bridge(server, ros, tmp_path, state)))

    ros, talk = play(story)
    assert outcomes[0].ended is not None
    assert outcomes[0].ended["status"] == "complete", (outcomes[0], talk.said)
    assert len([text for text in talk.said if text.endswith(" began")]) == 1
    assert any("goes on after report" in text for text in talk.said)
    names = [goal["id"] for goal in ros.goals]
    assert len(set(names)) == len(names)
    assert any(name.endswith(":0.2") for name in names), "what was under way was sent again"
    assert any(name.endswith(":1.1") for name in names)
    assert not state.exists()


def test_what_ended_just_before_a_bridge_was_ended_is_reported_by_the_next_one(server: Server, tmp_path: Path) -> None:
    outcomes: list[Outcome] = []
    state = tmp_path / "state.json"

    async def story(ros: FakeRos, talk: Talk) -> None:
        bridge, client = talk.bridge(server, ros, tmp_path, state)
        first = asyncio.ensure_future(drive(bridge, client))
        await until(lambda: bridge._fleet.pending)
        bridge._keep()  # as it does when something else is told just then
        assert json.loads(state.read_text())["gathered"]["finished"]
        first.cancel()
        await asyncio.gather(first, return_exceptions=True)
        outcomes.append(await drive(*talk.bridge(server, ros, tmp_path, state)))

    play(story)
    assert outcomes[0].ended is not None
    assert outcomes[0].ended["status"] == "complete"


def test_a_user_who_stops_gets_the_mission_ended_and_its_robots_stopped(server: Server, tmp_path: Path) -> None:
    outcomes: list[Outcome] = []

    async def story(ros: FakeRos, talk: Talk) -> None:
        work = asyncio.ensure_future(drive(*talk.bridge(server, ros, tmp_path)))
        await until(lambda: any(action.endswith("follow_path") for action in ros.running))
        ros.speedup = 1.0  # so that no robot gets there before it is stopped
        talk.stops = 1
        outcomes.append(await work)

    ros, _ = play(story)
    assert outcomes[0].ended is not None
    assert outcomes[0].ended["status"] == "cancelled"
    assert ros.cancelled
    assert ros.running == []


def test_a_user_who_stops_twice_leaves_at_once_with_all_goals_cancelled(server: Server, tmp_path: Path) -> None:
    outcomes: list[Outcome] = []

    async def story(ros: FakeRos, talk: Talk) -> None:
        work = asyncio.ensure_future(drive(*talk.bridge(server, ros, tmp_path)))
        await until(lambda: len(ros.running) == 2)
        ros.speedup = 1.0  # so that no robot gets there before it is stopped
        talk.stops = 2
        outcomes.append(await work)
        await until(lambda: not ros.running)

    ros, _ = play(story)
    assert outcomes[0].ended is None
    assert {goal["id"] for goal in ros.goals[:2]} <= set(ros.cancelled)


def test_a_carrier_that_is_not_heard_of_is_told_and_lost_with_its_rover(server: Server, tmp_path: Path) -> None:
    outcomes: list[Outcome] = []

    async def story(ros: FakeRos, talk: Talk) -> None:
        work = asyncio.ensure_future(drive(*talk.bridge(server, ros, tmp_path)))
        await until(lambda: "/carrier2/follow_path" in ros.running)
        ros.bodies["carrier2"].mute = True
        outcomes.append(await work)

    _, talk = play(story, waits="{silent_s: 5, lost_s: 15}")
    assert outcomes[0].ended is not None
    missing = "no map -> carrier2/base_link on /tf for"
    assert any(text.startswith(f"carrier2: {missing}") for text in talk.said)
    assert f"carrier2: lost: {missing} 15 s" in talk.said
    assert not any(text.startswith("carrier1: lost") for text in talk.said)


def test_what_is_missing_before_a_mission_is_told_by_name(server: Server, tmp_path: Path) -> None:
    async def story(ros: FakeRos, talk: Talk) -> None:
        ros.bodies["carrier2"].mute = True
        work = asyncio.ensure_future(drive(*talk.bridge(server, ros, tmp_path)))
        await until(lambda: any("carrier2" in text for text in talk.said))
        talk.stops = 1
        assert (await work).mission is None

    _, talk = play(story)
    assert "waiting for carrier2 (no map -> carrier2/base_link on /tf)" in talk.said
