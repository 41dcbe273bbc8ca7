"""Connections that say nothing, too little, too slowly or two things at once."""

import asyncio
import json
import logging
import resource
import socket
import threading
import time
from collections.abc import Iterator
from contextlib import ExitStack, closing, suppress
from pathlib import Path

import pytest
from plain_client import BROKEN, HOST, PlainClient, ask
from servers import Server
from service_requests import client
from waiting import HANG_S, wait_until

from marsupial_service.http.connections import LoopErrorHandler
from marsupial_service.keys import KeyFile

MOST, OF_ADDRESS = 60, 40
HEAD = b"POST /v1/jobs HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/json\r\n"


@pytest.fixture(scope="module")
def strict(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Server]:
    numbers = {
        "header_s": 1,
        "body_s": 0.5,
        "body_rate": 100_000,
        "stall_s": 1,
        "connections": MOST,
        "address_connections": OF_ADDRESS,
    }
    options = [word for name, number in numbers.items() for word in ("--limit", f"{name}={number}")]
    with Server(tmp_path_factory.mktemp("strict"), *options) as server:
        yield server


def opened(server: Server, data: bytes = b"") -> socket.socket:
    line = socket.create_connection((HOST, server.port), timeout=HANG_S)
    line.sendall(data)
    return line


def rest(line: socket.socket) -> bytes:
    """Return all data until the service closes the connection; a timeout fails the test."""
    found = b""
    with line, suppress(ConnectionResetError, BrokenPipeError):
        while chunk := line.recv(65536):
            found += chunk
    return found


def breaks(line: socket.socket, data: bytes) -> bool:
    """Send data repeatedly; return whether the service closes the connection."""
    end_s = time.monotonic() + HANG_S
    while time.monotonic() < end_s:
        try:
            with suppress(TimeoutError):
                line.sendall(data)
        except (BrokenPipeError, ConnectionResetError):
            return True
        time.sleep(0.05)
    return False


def status_of(answer: bytes) -> int:
    return int(answer.split(b" ", 2)[1])


@pytest.mark.parametrize(
    "lengths",
    [
        b"Content-Length: 2\r\nContent-Length: 3\r\n",
        b"Content-Length: 2\r\nTransfer-Encoding: chunked\r\n",
        b"Transfer-Encoding: chunked\r\nContent-Length: 2\r\n",
        b"Content-Length: 2, 3\r\n",
        b"Content-Length: -2\r\n",
        b"Transfer-Encoding: identity\r\n",
    ],
)
def test_lengths_that_contradict_each_other_close_the_connection(strict: Server, lengths: bytes) -> None:
    smuggled = b"0\r\n\r\nGET /healthz HTTP/1.1\r\nHost: localhost\r\n\r\n"
    answer = rest(opened(strict, HEAD + lengths + b"\r\n" + smuggled))
    assert status_of(answer) in (400, 501)
    assert answer.count(b"HTTP/1.1") == 1
    assert b"healthz" not in answer


def test_requests_that_are_not_http_are_answered_with_a_problem(strict: Server) -> None:
    answer = rest(opened(strict, b"\x16\x03\x01\r\n\r\n"))
    head, body = answer.split(b"\r\n\r\n", 1)
    assert b"application/problem+json" in head
    assert json.loads(body)["type"] == "urn:marsupial:problem:bad-request"


def test_a_connection_without_headers_is_closed(strict: Server) -> None:
    assert rest(opened(strict)) == b""
    assert status_of(rest(opened(strict, b"GET /healthz HTTP/1.1\r\nHost: loc"))) == 408


def test_a_connection_with_a_slow_body_is_closed(strict: Server) -> None:
    assert status_of(rest(opened(strict, HEAD + b'Content-Length: 1000000\r\n\r\n{"a'))) == 408


@pytest.mark.parametrize("half_closed", [False, True])
@pytest.mark.parametrize("begun", [b'Content-Length: 1000\r\n\r\n{"a', b'Transfer-Encoding: chunked\r\n\r\n20\r\n{"a'])
def test_a_truncated_body_is_not_logged_as_an_error_of_the_service(
    strict: Server, begun: bytes, half_closed: bool
) -> None:
    before = len(strict.log)
    with opened(strict, HEAD + begun) as line:
        if half_closed:
            line.shutdown(socket.SHUT_WR)
        else:
            line.close()
        wait_until(lambda: '"route": "/v1/jobs"' in strict.log[before:], "the line of the request")
    lines = [json.loads(line) for line in strict.log[before:].splitlines()]
    assert [(line["level"], line["status"]) for line in lines if line.get("route") == "/v1/jobs"] == [("info", 400)]
    assert not any("traceback" in line for line in lines)


def test_an_unexpected_body_closes_the_connection(strict: Server) -> None:
    line = opened(strict, b"POST /nowhere HTTP/1.1\r\nHost: localhost\r\nContent-Length: 1000000\r\n\r\n")
    with line:
        assert breaks(line, b"x")


def test_a_client_that_does_not_read_its_answers_is_disconnected(strict: Server) -> None:
    with opened(strict) as line:
        line.settimeout(0.1)
        assert breaks(line, b"GET /openapi.json HTTP/1.1\r\nHost: localhost\r\n\r\n" * 20)


def test_half_open_connections_do_not_block_requests(strict: Server) -> None:
    with ExitStack() as kept:
        for i in range(3 * MOST):
            kept.enter_context(opened(strict, b"GET / HT" * (i % 2)))
            if i % 10 == 9:
                assert ask(strict.port, "GET", "/healthz").status == 200


def test_an_address_with_many_open_requests_gets_no_more_connections(tmp_path: Path) -> None:
    limits = ("--limit", "address_connections=3")
    with Server(tmp_path, *limits) as server, client(server) as http, ExitStack() as kept:
        body = {**http.get("/v1/demo-data/office-6x3").json(), "planner": "anytime", "budget": {"seconds": 60}}
        links = http.post("/v1/jobs", json=body).json()["links"]
        http.close()
        for _ in range(3):
            line = kept.enter_context(
                opened(server, f"GET {links['events']} HTTP/1.1\r\nHost: localhost\r\n\r\n".encode())
            )
            assert line.recv(100).startswith(b"HTTP/1.1 200")
        refused = rest(opened(server))
        assert status_of(refused) == 429
        assert b"retry-after" in refused


def test_a_stream_that_is_over_is_answered_without_content(tmp_path: Path) -> None:
    with Server(tmp_path) as server, client(server) as http:
        job = http.post(
            "/v1/jobs", json=http.get("/v1/demo-data/yard").json(), headers={"Prefer": f"wait={HANG_S:g}"}
        ).json()
        path = job["links"]["events"]
        last = max(int(line[4:]) for line in http.get(path).text.splitlines() if line.startswith("id: "))
        assert http.get(path, headers={"Last-Event-ID": str(last - 1)}).status_code == 200
        for after in (last, last + 5):
            again = http.get(path, headers={"Last-Event-ID": str(after)})
            assert (again.status_code, again.text) == (204, "")


def test_the_streams_of_a_revoked_key_end(tmp_path: Path) -> None:
    keys = KeyFile(tmp_path)
    secret = keys.add("ann", ["plan"], 1, now_s=time.time())
    with Server(tmp_path, "--require-keys") as server, client(server, Authorization=f"Bearer {secret}") as http:
        body = {**http.get("/v1/demo-data/office-6x3").json(), "planner": "anytime", "budget": {"seconds": 120}}
        links = http.post("/v1/jobs", json=body).json()["links"]
        with http.stream("GET", links["events"]) as answer:
            lines = answer.iter_lines()
            next(lines)
            keys.revoke("ann", time.time())
            assert list(lines)[-2] == ": the key has expired or was revoked"


def test_a_lack_of_file_descriptors_is_logged_once_and_the_service_continues(tmp_path: Path) -> None:
    with Server(tmp_path) as server, ExitStack() as kept:
        open_now = len(list(Path(f"/proc/{server.process.pid}/fd").iterdir()))
        soft, hard = resource.prlimit(server.process.pid, resource.RLIMIT_NOFILE)
        resource.prlimit(server.process.pid, resource.RLIMIT_NOFILE, (open_now + 5, hard))
        for _ in range(50):
            kept.enter_context(opened(server))
        wait_until(lambda: "can't be accepted" in server.log)
        assert server.log.count("can't be accepted") == 1
        kept.close()
        resource.prlimit(server.process.pid, resource.RLIMIT_NOFILE, (soft, hard))
        assert ask(server.port, "GET", "/healthz").status == 200


def test_other_errors_of_the_event_loop_are_all_logged(caplog: pytest.LogCaptureFixture) -> None:
    loop = asyncio.new_event_loop()
    faults = LoopErrorHandler()
    with caplog.at_level(logging.ERROR):
        for _ in range(3):
            faults(loop, {"message": "socket.accept() out of system resource", "exception": OSError(24, "full")})
            faults(loop, {"message": "something else"})
    loop.close()
    assert [record.message for record in caplog.records].count("something else") == 3
    assert sum("can't be accepted" in record.message for record in caplog.records) == 1


def test_the_service_ends_during_many_requests(tmp_path: Path) -> None:
    over = threading.Event()

    def press(port: int, body: bytes) -> None:
        while not over.is_set():
            with suppress(*BROKEN), closing(PlainClient(port)) as client:
                client.ask("POST", "/v1/analysis", body)

    with Server(tmp_path) as server, ExitStack() as kept:
        body = json.dumps({"map_state": ask(server.port, "GET", "/v1/demo-data/yard").document["map_state"]})
        large = body.encode() + b" " * 5_000_000
        threads = [threading.Thread(target=press, args=(server.port, large)) for _ in range(6)]
        for thread in threads:
            thread.start()
        for _ in range(200):
            kept.enter_context(opened(server, b"GET / HT"))
        assert ask(server.port, "GET", "/healthz").status == 200
        server.process.terminate()
        assert server.process.wait(HANG_S) == 0
        over.set()
        for thread in threads:
            thread.join(HANG_S)
