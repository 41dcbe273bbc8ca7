"""Stories of whole missions: what is said to the user, and robots in the rooms that it is played with."""

from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from pathlib import Path

from fake_ros import FakeRos, rooms, settings_text, team
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


@asynccontextmanager
async def play(**more: str) -> AsyncIterator[tuple[FakeRos, Talk]]:
    """Give robots in the rooms, and a talk, for a story to be played with; `more` are settings."""
    grid = rooms()
    async with FakeRos(grid, team(grid)) as ros:
        yield ros, Talk(more)
