"""Stories of whole missions: what is said to the user, and robots in the rooms that it is played with."""

import asyncio
from collections.abc import Awaitable, Callable
from pathlib import Path
from typing import Any

from fake_ros import FakeRos, rooms, settings_text, team
from patience import HANG_S
from servers import Server

from marsupial_client import AsyncClient
from marsupial_ros.bridge import Bridge, BridgeOutcome
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


async def drive(bridge: Bridge, client: AsyncClient) -> BridgeOutcome:
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
