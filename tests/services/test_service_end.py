import threading
from pathlib import Path

import httpx
from servers import Server
from service_requests import client
from waiting import HANG_S

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
