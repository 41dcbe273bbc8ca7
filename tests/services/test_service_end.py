from __future__ import annotations

import threading
from pathlib import Path

import httpx
from servers import Server
from service_house import client

STREAMS = 50


def test_the_service_ends_within_three_seconds_with_50_open_streams(tmp_path: Path) -> None:
    ends: list[str] = []
    opened = threading.Barrier(STREAMS + 1)

    def listen(http: httpx.Client, path: str) -> None:
        with http.stream("GET", path) as answer:
            lines = answer.iter_lines()
            next(lines)
            opened.wait(60)
            ends.append(list(lines)[-2])

    with Server(tmp_path) as server, client(server) as http:
        http._transport = httpx.HTTPTransport(limits=httpx.Limits(max_connections=STREAMS + 5))
        body = {**http.get("/v1/demo-data/office-6x3").json(), "planner": "anytime", "budget": {"seconds": 120}}
        path = http.post("/v1/jobs", json=body).json()["links"]["events"]
        threads = [threading.Thread(target=listen, args=(http, path)) for _ in range(STREAMS)]
        for thread in threads:
            thread.start()
        opened.wait(60)
        server.process.terminate()
        assert server.process.wait(3) == 0
        for thread in threads:
            thread.join(10)
    assert len(ends) == STREAMS
    assert all(end.startswith(": the service is ending") for end in ends)
