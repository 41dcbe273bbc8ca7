"""The parts of docker/servers.yaml as processes: proxy, two servers, a database."""

import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path

import httpx
import pytest
from support.services.proxies import Proxy, needs_nginx
from support.services.servers import Server
from support.waiting import HANG_S, wait_until

pytestmark = [needs_nginx, pytest.mark.slow]


@pytest.fixture
def servers(tmp_path: Path, shared: str) -> Iterator[list[Server]]:
    with ExitStack() as stack:
        yield [stack.enter_context(Server(tmp_path / str(number), "--store", shared)) for number in (1, 2)]


@pytest.fixture
def proxy(tmp_path: Path, servers: list[Server]) -> Iterator[str]:
    """The address of a proxy with the configuration of the container."""
    with Proxy(tmp_path, [server.port for server in servers]) as found:
        yield f"http://127.0.0.1:{found.port}"


def test_jobs_and_missions_continue_although_a_server_dies(tmp_path: Path, servers: list[Server], proxy: str) -> None:
    for server in servers:
        server.wait_ready()
    out = tmp_path / "mission.jsonl"
    words = [sys.executable, "-m", "marsupial.cli.main", "run", "lobby", "--planner", "greedy", "--steps", "1"]
    command = [*words, "--server", proxy, "--log", str(out)]
    with httpx.Client(base_url=proxy, timeout=HANG_S, trust_env=False) as http:
        job = {**http.get("/v1/demo-data/office-2x2").json(), "planner": "anytime", "budget": {"seconds": 8}}
        jobs = [http.post("/v1/jobs", json=job).json()["links"]["self"] for _ in range(2)]
        wait_until(lambda: all(http.get(one).json()["best"] for one in jobs))
        mission = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
        wait_until(lambda: http.get("/v1/missions").json()["missions"])
        servers[0].kill()
        said, _ = mission.communicate(timeout=HANG_S)
        assert mission.returncode == 0, said
        subprocess.run([*words, "--log", str(tmp_path / "here.jsonl")], check=True, capture_output=True, timeout=HANG_S)
        assert out.read_bytes() == (tmp_path / "here.jsonl").read_bytes()
        for one in jobs:
            while (ended := http.get(one).json())["outcome"] is None:
                time.sleep(0.1)
            assert ended["state"] == "succeeded"
