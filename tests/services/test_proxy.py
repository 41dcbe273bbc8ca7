"""The proxy of docker/ keeps slow and hostile clients away from the service, and passes on what it should."""

import json
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path

import httpx
import pytest
from service_requests import opened, rest
from support.services.plain_client import HOST, ask
from support.services.proxies import Proxy, needs_nginx
from support.services.servers import Server
from support.waiting import HANG_S, wait_until

pytestmark = needs_nginx

HEAD = b"POST /v1/validations HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/json\r\n"
CHUNKED = HEAD + b"Transfer-Encoding: chunked\r\n\r\n"
BODY_BYTES = 16_000_000
SHORT = {"client_header_timeout": "1s", "client_body_timeout": "1s", "send_timeout": "1s", "limit_conn": "addresses 3"}


@pytest.fixture(scope="module")
def server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Server]:
    with Server(tmp_path_factory.mktemp("server")) as found:
        found.wait_ready()
        yield found


@pytest.fixture(scope="module")
def proxy(tmp_path_factory: pytest.TempPathFactory, server: Server) -> Iterator[Proxy]:
    with Proxy(tmp_path_factory.mktemp("proxy"), [server.port]) as found:
        yield found


@pytest.fixture(scope="module")
def impatient(tmp_path_factory: pytest.TempPathFactory, server: Server) -> Iterator[Proxy]:
    """A proxy with short timeouts, and three connections for each address."""
    with Proxy(tmp_path_factory.mktemp("impatient"), [server.port], SHORT) as found:
        yield found


def requests_of(server: Server, route: str) -> int:
    """Return how many requests for a route have reached the service."""
    return sum(json.loads(line).get("route") == route for line in server.log.splitlines() if line.startswith("{"))


def client(proxy: Proxy) -> httpx.Client:
    return httpx.Client(base_url=f"http://{HOST}:{proxy.port}", timeout=HANG_S, trust_env=False)


def test_a_client_that_sends_no_headers_is_disconnected(impatient: Proxy) -> None:
    assert rest(opened(impatient)) == b""
    assert rest(opened(impatient, b"GET /healthz HTTP/1.1\r\nHost: loc"))[:12] in (b"", b"HTTP/1.1 408")


def test_a_client_that_sends_nothing_of_its_body_never_reaches_the_service(server: Server, impatient: Proxy) -> None:
    before = requests_of(server, "/v1/validations")
    for begun in (HEAD + b"Content-Length: 1000\r\n\r\n{", CHUNKED + b"1\r\n{\r\n"):
        assert rest(opened(impatient, begun))[:12] in (b"", b"HTTP/1.1 408")
    assert requests_of(server, "/v1/validations") == before


def test_a_client_that_does_not_read_its_answers_is_disconnected(server: Server, impatient: Proxy) -> None:
    def send_more() -> bool:
        try:
            line.sendall(b"GET /openapi.json HTTP/1.1\r\nHost: localhost\r\n\r\n" * 100)
        except TimeoutError:
            return False
        except ConnectionError:
            return True
        return False

    with opened(impatient) as line:
        line.settimeout(0.05)
        wait_until(send_more, "the end of the connection")


def test_an_address_with_many_requests_in_progress_is_answered_429(impatient: Proxy) -> None:
    with ExitStack() as kept:
        begun = HEAD + b"Content-Length: 1000\r\nExpect: 100-continue\r\n\r\n"
        for _ in range(3):
            assert kept.enter_context(opened(impatient, begun)).recv(100).startswith(b"HTTP/1.1 100")
        assert ask(impatient.port, "GET", "/healthz").status == 429
    wait_until(lambda: ask(impatient.port, "GET", "/healthz").status == 200)


def test_a_request_reaches_the_service_only_once_its_last_chunk_has_arrived(server: Server, proxy: Proxy) -> None:
    before = requests_of(server, "/v1/validations")
    with opened(proxy, CHUNKED) as line:
        for _ in range(10):
            line.sendall(b"1\r\n \r\n" * 10_000)
            assert ask(proxy.port, "GET", "/healthz").status == 200
        assert requests_of(server, "/v1/validations") == before
        line.sendall(b"2\r\n{}\r\n0\r\n\r\n")
        assert line.recv(100).startswith(b"HTTP/1.1 422")
    wait_until(lambda: requests_of(server, "/v1/validations") == before + 1)  # counted after the answer


def test_half_open_connections_do_not_block_requests(proxy: Proxy) -> None:
    with ExitStack() as kept:
        for i in range(1000):
            kept.enter_context(opened(proxy, b"GET / HT" * (i % 2)))
        assert ask(proxy.port, "GET", "/healthz").status == 200


def test_the_largest_body_passes_and_a_larger_one_is_refused_as_too_large(server: Server, proxy: Proxy) -> None:
    limit = server.ask("GET", "/v1/limits").document["limits"]["body_bytes"]["value"]
    assert limit == BODY_BYTES
    before = requests_of(server, "/v1/validations")
    with client(proxy) as http:
        kind = {"Content-Type": "application/json"}
        largest = b"{}" + b" " * (BODY_BYTES - 2)
        assert http.post("/v1/validations", content=largest, headers=kind).status_code == 422
        assert http.post("/v1/validations", content=largest + b" ", headers=kind).status_code == 413
    wait_until(lambda: requests_of(server, "/v1/validations") == before + 1)  # counted after the answer


def test_events_pass_as_they_come(proxy: Proxy) -> None:
    with client(proxy) as http:
        job = {**http.get("/v1/demo-data/office-2x2").json(), "planner": "anytime", "budget": {"seconds": 60}}
        links = http.post("/v1/jobs", json=job).json()["links"]
        with http.stream("GET", links["events"]) as stream:
            lines = stream.iter_lines()
            while next(lines) != "event: plan":
                pass
            assert http.get(links["self"]).json()["outcome"] is None
            http.post(links["cancel"])
            assert "event: end" in lines


def test_a_body_that_is_arriving_when_the_service_ends_is_answered_503(tmp_path: Path) -> None:
    (tmp_path / "proxy").mkdir()
    with Server(tmp_path / "server") as server, Proxy(tmp_path / "proxy", [server.port]) as proxy:
        with opened(proxy, HEAD + b"Connection: close\r\nContent-Length: 100\r\n\r\n{") as line:
            server.stop()
            line.sendall(b" " * 99)
            head, _, body = rest(line).partition(b"\r\n\r\n")
        assert head.startswith(b"HTTP/1.1 503")
        assert b"\r\nRetry-After: 1\r\n" in head + b"\r\n"
        assert json.loads(body)["type"] == "urn:marsupial:problem:not-ready"
