"""Whole missions: a real server, the bridge, and a rosbridge made for the test with simple robots behind it."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("websockets")

import numpy as np
from fake_ros import Body, FakeRos, rooms, settings_text, team
from servers import Server

from marsupial.model.grid import UNKNOWN
from marsupial_client import AsyncClient
from marsupial_ros.bridge import Bridge, Outcome
from marsupial_ros.journal import Journal
from marsupial_ros.settings import read_settings

LIMIT_S = 90.0


class Talk:
    """What the bridge has told the user; and how often that wants to stop."""

    def __init__(self) -> None:
        self.said: list[str] = []
        self.stops = 0

    def bridge(self, server: Server, ros: FakeRos, folder: Path, state: Path | None = None) -> tuple[Bridge, AsyncClient]:
        path = folder / "fleet.yaml"
        path.write_text(settings_text(ros.url, list(ros.bodies.values())))
        client = AsyncClient(server.url)
        return Bridge(read_settings(path), client, Journal(state), self.said.append, lambda: self.stops), client


async def drive(bridge: Bridge, client: AsyncClient) -> Outcome:
    async with client:
        return await bridge.run()


def play(story: Callable[[FakeRos, Talk], Awaitable[None]], bodies: list[Body] | None = None) -> tuple[FakeRos, Talk]:
    """Play a story with robots in the rooms, and return how they and the talk are afterwards."""
    grid = rooms()
    ros, talk = FakeRos(grid, team(grid) if bodies is None else bodies), Talk()

    async def within() -> None:
        async with ros:
            await asyncio.wait_for(story(ros, talk), LIMIT_S)

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
