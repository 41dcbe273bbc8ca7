"""The parts of docker/cluster.yaml as processes: proxy, two servers, a database, two Ray nodes."""

import os
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path

import httpx
import pytest
from databases import PostgresServer
from ray_nodes import Nodes, needs_ray
from servers import Server, free_port
from waiting import HANG_S, wait_until

pytestmark = [needs_ray, pytest.mark.slow]

CONFIGURATION = Path(__file__).resolve().parents[2] / "docker" / "nginx.conf"


@pytest.fixture
def servers(
    tmp_path: Path, postgres: PostgresServer, nodes: Nodes, monkeypatch: pytest.MonkeyPatch
) -> Iterator[list[Server]]:
    for name, value in nodes.env.items():
        monkeypatch.setenv(name, value)
    database = postgres.database()
    with ExitStack() as stack:
        options = ("--store", database, "--ray", nodes.client)
        yield [stack.enter_context(Server(tmp_path / str(number), *options)) for number in (1, 2)]


@pytest.fixture
def proxy(tmp_path: Path, servers: list[Server]) -> Iterator[str]:
    """The address of a proxy with the configuration of the container."""
    program = shutil.which("nginx", path=f"{os.environ['PATH']}:/usr/sbin")
    if program is None:
        pytest.skip("nginx is not installed (Debian: apt-get install nginx-light)")
    port = free_port()
    text = CONFIGURATION.read_text().replace("listen 8080", f"listen 127.0.0.1:{port}").replace("/tmp/", f"{tmp_path}/")
    for server, name in zip(servers, ("server-1:8080", "server-2:8080"), strict=True):
        assert name in text
        text = text.replace(name, f"127.0.0.1:{server.port}")
    (tmp_path / "nginx.conf").write_text(text)
    command = [program, "-c", str(tmp_path / "nginx.conf"), "-p", str(tmp_path), "-g", "daemon off;"]
    with (tmp_path / "nginx.log").open("wb") as log:
        process = subprocess.Popen(command, stdout=log, stderr=log)
    yield f"http://127.0.0.1:{port}"
    process.send_signal(signal.SIGQUIT)
    process.wait(HANG_S)


def test_jobs_and_missions_continue_although_a_server_dies(
    tmp_path: Path, servers: list[Server], proxy: str, nodes: Nodes
) -> None:
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
        before = nodes.processes("ray::NodeAgent")
        servers[0].kill()
        said, _ = mission.communicate(timeout=HANG_S)
        assert mission.returncode == 0, said
        subprocess.run([*words, "--log", str(tmp_path / "here.jsonl")], check=True, capture_output=True, timeout=HANG_S)
        assert out.read_bytes() == (tmp_path / "here.jsonl").read_bytes()
        for one in jobs:
            while (ended := http.get(one).json())["outcome"] is None:
                time.sleep(0.1)
            assert ended["state"] == "succeeded"
    assert len([process for process in before if process.is_running()]) == len(before) // 2


def test_events_pass_the_proxy_as_they_come(servers: list[Server], proxy: str) -> None:
    servers[0].wait_ready()
    with httpx.Client(base_url=proxy, timeout=HANG_S, trust_env=False) as http:
        job = {**http.get("/v1/demo-data/office-2x2").json(), "planner": "anytime", "budget": {"seconds": 20}}
        made = http.post("/v1/jobs", json=job).json()
        with http.stream("GET", made["links"]["events"]) as stream:
            for line in stream.iter_lines():
                if line == "event: plan":
                    break
            assert http.get(made["links"]["self"]).json()["outcome"] is None
        http.post(made["links"]["self"] + "/cancel")
