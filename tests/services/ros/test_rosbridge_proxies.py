"""Connections to rosbridge where the environment names proxies."""

import asyncio
from importlib.util import find_spec

import pytest

pytest.importorskip("websockets")

from support.waiting import HANG_S
from websockets.asyncio.server import ServerConnection, serve

from marsupial.errors import UsageError
from marsupial_ros.rosbridge import Rosbridge

FAR = "ws://robots.example.com:9090"


class Connections:
    """A listener that notes connections and why there is none, and ends at the first of them."""

    def __init__(self) -> None:
        self.first: asyncio.Future[str] = asyncio.get_running_loop().create_future()

    def connected(self) -> None:
        self.disconnected("connected")

    def disconnected(self, reason: str) -> None:
        if not self.first.done():
            self.first.set_result(reason)


async def _first(url: str) -> str:
    listener = Connections()
    work = asyncio.ensure_future(Rosbridge(url, []).run(listener))  # type: ignore[arg-type]
    await asyncio.wait((work, listener.first), return_when=asyncio.FIRST_COMPLETED)
    if not listener.first.done():
        await work
    work.cancel()
    await asyncio.gather(work, return_exceptions=True)
    return await listener.first


def first_news(url: str) -> str:
    return asyncio.run(asyncio.wait_for(_first(url), HANG_S))


@pytest.mark.parametrize("name", ["http_proxy", "HTTPS_PROXY", "socks_proxy", "ALL_PROXY"])
def test_rosbridge_on_this_machine_is_asked_without_a_proxy(monkeypatch: pytest.MonkeyPatch, name: str) -> None:
    monkeypatch.delenv("no_proxy", raising=False)
    monkeypatch.delenv("NO_PROXY", raising=False)
    monkeypatch.setenv(name, "socks5://127.0.0.1:1")

    async def quiet(line: ServerConnection) -> None:
        await line.wait_closed()

    async def run() -> str:
        async with serve(quiet, "127.0.0.1", 0) as server:
            return await _first(f"ws://127.0.0.1:{server.sockets[0].getsockname()[1]}")

    assert asyncio.run(asyncio.wait_for(run(), HANG_S)) == "connected"


def test_a_proxy_that_refuses_is_named_without_its_password(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("https_proxy", "http://me:word@127.0.0.1:1")
    said = first_news(FAR)
    assert said.endswith("(asked the proxy http://127.0.0.1:1 of https_proxy)")
    assert "word" not in said


@pytest.mark.parametrize(
    ("value", "why"),
    [
        pytest.param(
            "socks5://127.0.0.1:1",
            r"of socks_proxy can't be used: install .* 'python-socks\[asyncio\]'.* unset socks_proxy",
            marks=pytest.mark.skipif(find_spec("python_socks") is not None, reason="python-socks is installed"),
        ),
        ("http:///", "socks_proxy must be like http://HOST:PORT"),
    ],
)
def test_a_proxy_that_cannot_be_used_ends_the_bridge_with_what_to_do(
    monkeypatch: pytest.MonkeyPatch, value: str, why: str
) -> None:
    monkeypatch.setenv("socks_proxy", value)
    with pytest.raises(UsageError, match=f"rosbridge: .*{why}"):
        first_news(FAR)
