"""Whole missions of the bridge: a user of the command, and simulated robots in the rooms of `fake_ros`."""

from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from pathlib import Path

from fake_ros import FakeRos
from ros_rooms import rooms, settings_text, team
from support.services.servers import Server

from marsupial_client import AsyncClient
from marsupial_ros.bridge import Bridge, BridgeOutcome
from marsupial_ros.journal import Journal
from marsupial_ros.ros_listener import subscriptions
from marsupial_ros.rosbridge import Rosbridge
from marsupial_ros.settings import read_settings


class BridgeUser:
    """The messages that the bridge has shown, and how often the user has asked to stop."""

    def __init__(self, more: dict[str, str] | None = None) -> None:
        self.said: list[str] = []
        self.more = more
        self.stops = 0

    def bridge(
        self, server: Server, ros: FakeRos, folder: Path, state: Path | None = None
    ) -> tuple[Bridge, AsyncClient]:
        path = folder / "fleet.yaml"
        path.write_text(settings_text(ros.url, list(ros.robots.values()), self.more))
        client = AsyncClient(server.url)
        settings = read_settings(path)
        transport = Rosbridge(settings.rosbridge, subscriptions(settings))
        return Bridge(settings, transport, client, Journal(state), self.said.append, lambda: self.stops), client


async def drive(bridge: Bridge, client: AsyncClient) -> BridgeOutcome:
    async with client:
        return await bridge.run()


@asynccontextmanager
async def robots_in_rooms(**more: str) -> AsyncIterator[tuple[FakeRos, BridgeUser]]:
    """Yield a rosbridge with robots in the rooms, and a user; `more` are settings."""
    grid = rooms()
    async with FakeRos(grid, team(grid)) as ros:
        yield ros, BridgeUser(more)
