"""Proxies of the environment: whom they are asked for, and what is said if they fail."""

import asyncio
import os
import socket
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from http.server import BaseHTTPRequestHandler, HTTPServer
from threading import Thread

import pytest

from marsupial.cli.main import main
from marsupial_client import AsyncClient, Client, ClientError, KeyRefused, ProxyUnusable, Unreachable
from marsupial_client.proxies import EnvironmentProxy, proxy_for

PROXY = "http://10.9.8.7:3128"
FAR = "http://robots.example.com:8080"
OTHER = "ws://robots.example.com:9090"


@pytest.fixture(autouse=True)
def environment(monkeypatch: pytest.MonkeyPatch) -> pytest.MonkeyPatch:
    """Return an environment without proxies."""
    for name in list(os.environ):
        if name.lower().endswith("_proxy"):
            monkeypatch.delenv(name)
    return monkeypatch


def free_port() -> int:
    with socket.socket() as one:
        one.bind(("127.0.0.1", 0))
        return int(one.getsockname()[1])


@contextmanager
def answering(status: int, text: str) -> Iterator[str]:
    """Run a server with one answer to everything."""

    class Answer(BaseHTTPRequestHandler):
        def do_GET(self) -> None:
            self.send_response(status)
            self.end_headers()
            self.wfile.write(text.encode())

        def log_message(self, *_: object) -> None:
            pass

    with HTTPServer(("127.0.0.1", 0), Answer) as server:
        thread = Thread(target=server.serve_forever, args=(0.01,))
        thread.start()
        try:
            yield f"http://127.0.0.1:{server.server_port}"
        finally:
            server.shutdown()
            thread.join()


@pytest.mark.parametrize("name", ["http_proxy", "HTTP_PROXY", "all_proxy", "ALL_PROXY"])
@pytest.mark.parametrize(
    "host",
    [
        *("localhost", "LOCALHOST.", "a.localhost", "127.0.0.1", "127.8.8.8", "0.0.0.0", "[::1]", "[::ffff:127.0.0.1]"),
        *("10.1.2.3", "172.16.0.9", "192.168.1.4", "169.254.3.4", "100.64.1.1", "[fd12::1]", "[fe80::1]"),
        *("robot", "robot.local", "Robot.Local.", "robot.lan", "robot.home.arpa"),
    ],
)
def test_this_machine_and_its_network_are_asked_without_a_proxy(
    environment: pytest.MonkeyPatch, name: str, host: str
) -> None:
    environment.setenv(name, PROXY)
    assert proxy_for(f"http://{host}:8080") is None
    assert proxy_for(f"ws://{host}:9090") is None
    assert proxy_for(FAR) == EnvironmentProxy(name, PROXY)


@pytest.mark.parametrize(
    "host", ["172.32.0.1", "192.169.0.1", "8.8.8.8", "[2001:4860::8]", "local.example", "x.notlan"]
)
def test_other_addresses_are_asked_through_the_proxy(environment: pytest.MonkeyPatch, host: str) -> None:
    environment.setenv("HTTP_PROXY", PROXY)
    assert proxy_for(f"http://{host}:8080") is not None


@pytest.mark.parametrize(
    ("url", "variables", "chosen"),
    [
        ("https://far.example", {"http_proxy": PROXY}, None),
        ("https://far.example", {"https_proxy": PROXY, "all_proxy": "http://other:1"}, "https_proxy"),
        (FAR, {"https_proxy": PROXY, "socks_proxy": PROXY, "ws_proxy": PROXY}, None),
        (FAR, {"http_proxy": PROXY, "HTTP_PROXY": "http://other:1"}, "http_proxy"),
        (FAR, {"http_proxy": "", "HTTP_PROXY": PROXY}, None),
        (OTHER, {"http_proxy": PROXY, "HTTPS_PROXY": "http://other:1"}, "HTTPS_PROXY"),
        (OTHER, {"https_proxy": PROXY, "socks_proxy": "socks5://other:1"}, "socks_proxy"),
        (OTHER, {"http_proxy": PROXY, "WS_PROXY": "http://other:1"}, "WS_PROXY"),
        (OTHER, {"ALL_PROXY": PROXY}, "ALL_PROXY"),
        ("wss://far.example", {"http_proxy": PROXY}, None),
        ("ftp://far.example", {"ftp_proxy": PROXY, "all_proxy": PROXY}, None),
        ("ws://far.example:port", {"all_proxy": PROXY}, None),
    ],
)
def test_the_variable_for_an_address_is_chosen(
    environment: pytest.MonkeyPatch, url: str, variables: dict[str, str], chosen: str | None
) -> None:
    for name, value in variables.items():
        environment.setenv(name, value)
    found = proxy_for(url)
    assert (None if found is None else found.variable) == chosen


@pytest.mark.parametrize(
    "exempt",
    [
        *("*", "a.example,*", "robots.example.com", "ROBOTS.example.com", "example.com", ".example.com"),
        *("*.example.com", " x.y , example.com", "x.y example.com", "robots.example.com:8080"),
    ],
)
@pytest.mark.parametrize("name", ["no_proxy", "NO_PROXY"])
def test_hosts_in_no_proxy_are_asked_directly(environment: pytest.MonkeyPatch, name: str, exempt: str) -> None:
    environment.setenv("all_proxy", PROXY)
    environment.setenv(name, exempt)
    assert proxy_for(FAR) is None
    assert (proxy_for("http://notexample.com") is None) == ("*" in exempt.split(","))


def test_networks_in_no_proxy_are_asked_directly(environment: pytest.MonkeyPatch) -> None:
    environment.setenv("all_proxy", PROXY)
    environment.setenv("no_proxy", "8.8.0.0/16,2001:db8::/32,[2002::1]")
    for host, direct in {"8.8.1.2": True, "8.9.1.2": False, "[2001:db8::7]": True, "[2002::1]": True}.items():
        assert (proxy_for(f"http://{host}:8080") is None) is direct
    environment.setenv("no_proxy", "robots.example.com:9999")
    assert proxy_for(FAR) is not None


@pytest.mark.parametrize(
    ("name", "text", "url"),
    [
        ("all_proxy", "proxy:3128", "http://proxy:3128"),
        ("all_proxy", "http://proxy:3128/", "http://proxy:3128"),
        ("all_proxy", "https://me:word@proxy", "https://me:word@proxy:443"),
        ("all_proxy", "http://me@[fd00::1]", "http://me:@[fd00::1]:80"),
        ("all_proxy", "socks://127.0.0.1:1080/", "socks5h://127.0.0.1:1080"),
        ("all_proxy", "SOCKS5://proxy", "socks5://proxy:1080"),
        ("socks_proxy", "proxy:1080", "socks5h://proxy:1080"),
        ("socks_proxy", "http://proxy:1080", "socks5h://proxy:1080"),
    ],
)
def test_a_proxy_may_be_written_in_many_ways(environment: pytest.MonkeyPatch, name: str, text: str, url: str) -> None:
    environment.setenv(name, text)
    assert proxy_for(OTHER) == EnvironmentProxy(name, url)


@pytest.mark.parametrize("text", ["http://", "http://proxy:port", "ftp://proxy:1", "a b", "http://me:word@proxy:x"])
def test_a_proxy_that_is_no_address_is_named_without_its_password(environment: pytest.MonkeyPatch, text: str) -> None:
    environment.setenv("Http_Proxy", text)
    with pytest.raises(ProxyUnusable, match=r"^Http_Proxy must be like http://HOST:PORT") as caught:
        Client(FAR)
    assert "word" not in str(caught.value)


@pytest.mark.parametrize("value", ["socks5://127.0.0.1:1080", "socks4://127.0.0.1:1080", "socks://127.0.0.1:1080"])
def test_a_kind_of_proxy_that_cannot_be_used_is_an_error_of_the_client(
    environment: pytest.MonkeyPatch, value: str
) -> None:
    environment.setenv("ALL_PROXY", value)
    environment.setitem(sys.modules, "socksio", None)  # type: ignore[arg-type]
    for kind in (Client, AsyncClient):
        with pytest.raises(ClientError, match=r"of ALL_PROXY can't be used: .*unset ALL_PROXY, or list .* in no_proxy"):
            kind(FAR)
        kind("http://127.0.0.1:1")
    environment.setenv("NO_PROXY", "example.com")
    Client(FAR).close()


def test_a_proxy_that_needs_a_package_ends_a_run_with_what_to_install(
    environment: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    environment.setenv("all_proxy", "socks5://127.0.0.1:1080")
    environment.setitem(sys.modules, "socksio", None)  # type: ignore[arg-type]
    assert main(["run", "lobby", "--steps", "4", "--server", FAR]) == 2
    assert "pip install 'httpx2[socks]'" in capsys.readouterr().err


def test_the_service_on_this_machine_is_reached_whatever_the_environment_says(environment: pytest.MonkeyPatch) -> None:
    for name in ("http_proxy", "https_proxy", "all_proxy", "socks_proxy"):
        environment.setenv(name, f"socks5://127.0.0.1:{free_port()}")

    async def ask(url: str) -> object:
        async with AsyncClient(url) as client:
            return await client.ask("GET", "/v1/limits")

    with answering(200, '{"well": true}') as url:
        with Client(url) as client:
            assert client.ask("GET", "/v1/limits") == {"well": True}
        assert asyncio.run(ask(url)) == {"well": True}


def test_a_proxy_that_does_not_answer_is_named(environment: pytest.MonkeyPatch) -> None:
    proxy = f"127.0.0.1:{free_port()}"
    environment.setenv("HTTP_PROXY", f"http://me:word@{proxy}")
    said = rf"{FAR} can't be reached through the proxy http://{proxy} of HTTP_PROXY \(connection refused\)"
    with Client(FAR, patience_s=0.0) as client, pytest.raises(Unreachable, match=said):
        client.ready()


def test_a_refusal_by_a_proxy_names_it(environment: pytest.MonkeyPatch) -> None:
    with answering(403, "<h1>Forbidden by policy</h1>") as proxy:
        environment.setenv("http_proxy", proxy)
        with (
            Client(FAR) as client,
            pytest.raises(KeyRefused, match=rf"Forbidden by policy.*perhaps by the proxy {proxy} of http_proxy"),
        ):
            client.ready()
