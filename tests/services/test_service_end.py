import json
import socket
import threading
from contextlib import ExitStack, closing
from pathlib import Path

import httpx
from service_requests import client
from support.services.plain_client import HOST
from support.services.servers import Server
from support.waiting import HANG_S

from marsupial_service.operations import upkeep

STREAMS = 50


def test_the_service_ends_with_50_open_streams_and_leaves_the_job_for_later(tmp_path: Path) -> None:
    ends: list[str] = []
    opened = threading.Barrier(STREAMS + 1)

    def listen(http: httpx.Client, path: str) -> None:
        with http.stream("GET", path) as answer:
            lines = answer.iter_lines()
            next(lines)
            opened.wait(HANG_S)
            ends.append(list(lines)[-2])

    with Server(tmp_path) as server, client(server) as http:
        http._transport = httpx.HTTPTransport(limits=httpx.Limits(max_connections=STREAMS + 5))
        body = {**http.get("/v1/demo-data/office-6x3").json(), "planner": "anytime", "budget": {"seconds": 300}}
        path = http.post("/v1/jobs", json=body).json()["links"]["events"]
        threads = [threading.Thread(target=listen, args=(http, path)) for _ in range(STREAMS)]
        for thread in threads:
            thread.start()
        opened.wait(HANG_S)
        server.process.terminate()
        assert server.process.wait(HANG_S) == 0
        for thread in threads:
            thread.join(HANG_S)
    assert upkeep.info(tmp_path).open == {"jobs": 1, "missions": 0}
    assert len(ends) == STREAMS
    assert all(end.startswith(": the service is shutting down") for end in ends)


def test_a_body_that_is_arriving_when_the_service_ends_is_answered_503(tmp_path: Path) -> None:
    head = b"POST /v1/jobs HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/json\r\nExpect: 100-continue\r\n"
    beginnings = b"Content-Length: 100\r\n\r\n{", b"Transfer-Encoding: chunked\r\n\r\n1\r\n{\r\n"
    with Server(tmp_path) as server, ExitStack() as lines:
        connections = []
        for beginning in beginnings:
            line = lines.enter_context(closing(socket.create_connection((HOST, server.port), timeout=HANG_S)))
            line.sendall(head + beginning)
            # the service asks for the body once it reads it
            assert line.recv(1000).startswith(b"HTTP/1.1 100")
            connections.append(line)
        server.stop()
        for line in connections:
            headers, _, body = b"".join(iter(lambda line=line: line.recv(65536), b"")).partition(b"\r\n\r\n")  # type: ignore[misc]
            assert headers.startswith(b"HTTP/1.1 503")
            assert b"\r\nretry-after: 1\r\n" in headers
            assert json.loads(body)["type"] == "urn:marsupial:problem:not-ready"
    logged = [json.loads(line) for line in server.log.splitlines() if line.startswith("{")]
    assert not any("traceback" in line for line in logged)
    assert [line["status"] for line in logged if line.get("route") == "/v1/jobs"] == [503, 503]
