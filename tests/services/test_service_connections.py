"""Connections that send too little or too slowly, streams that end, and a lack of open files."""

import asyncio
import json
import logging
import resource
import socket
import threading
from collections.abc import Iterator
from contextlib import ExitStack, closing, suppress
from pathlib import Path

import httpx
import pytest
from service_requests import opened, rest
from support.services.plain_client import BROKEN, PlainClient, ask
from support.services.servers import Server
from support.waiting import HANG_S, wait_until

from marsupial_service.http.openfiles import LoopErrorHandler

LAST = b"GET /healthz HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n"
HEAD = b"POST /v1/jobs HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/json\r\n"


@pytest.fixture(scope="module")
def strict(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Server]:
    options = ("--limit", "body_s=0.5", "--limit", "body_rate=100000")
    with Server(tmp_path_factory.mktemp("strict"), *options) as server:
        yield server


def status_of(answer: bytes) -> int:
    return int(answer.split(b" ", 2)[1])


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


def test_requests_over_more_connections_than_the_limit_are_answered_503(tmp_path: Path) -> None:
    with Server(tmp_path, "--limit", "connections=3") as server, ExitStack() as kept:
        idle = [kept.enter_context(opened(server)) for _ in range(3)]
        # until the service has accepted all of them
        wait_until(lambda: status_of(rest(opened(server, LAST))) == 503)
        idle.pop().close()
        wait_until(lambda: status_of(rest(opened(server, LAST))) == 200)


def test_a_stream_that_is_over_is_answered_without_content(http: httpx.Client) -> None:
    yard = http.get("/v1/demo-data/yard").json()
    job = http.post("/v1/jobs", json=yard, headers={"Prefer": f"wait={HANG_S:g}"}).json()
    path = job["links"]["events"]
    last = max(int(line[4:]) for line in http.get(path).text.splitlines() if line.startswith("id: "))
    assert http.get(path, headers={"Last-Event-ID": str(last - 1)}).status_code == 200
    for after in (last, last + 5):
        again = http.get(path, headers={"Last-Event-ID": str(after)})
        assert (again.status_code, again.text) == (204, "")


def test_a_lack_of_file_descriptors_is_logged_once_and_the_service_continues(strict: Server) -> None:
    number = strict.process.pid
    open_now = len(list(Path(f"/proc/{number}/fd").iterdir()))
    soft, hard = resource.prlimit(number, resource.RLIMIT_NOFILE)
    resource.prlimit(number, resource.RLIMIT_NOFILE, (open_now + 5, hard))
    with ExitStack() as kept:
        for _ in range(50):
            kept.enter_context(opened(strict))
        wait_until(lambda: "can't be accepted" in strict.log)
        assert strict.log.count("can't be accepted") == 1
    resource.prlimit(number, resource.RLIMIT_NOFILE, (soft, hard))
    assert ask(strict.port, "GET", "/healthz").status == 200


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
