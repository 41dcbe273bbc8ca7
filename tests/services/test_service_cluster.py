"""`marsupial serve --ray`: messages about its cluster, and cleanup there."""

import subprocess
import time
from collections.abc import Iterator
from pathlib import Path

import psutil
import pytest
from service_requests import client, problem
from support.processes.ray_nodes import Head, Nodes, needs_ray
from support.services.servers import START, Server, free_port
from support.waiting import HANG_S, wait_until

pytestmark = needs_ray


@pytest.mark.parametrize(
    ("address", "said"), [("127.0.0.1:{port}", "can't reach 127.0.0.1:"), ("nowhere", "must be HOST:PORT")]
)
def test_an_unreachable_cluster_is_reported_at_the_start(tmp_path: Path, address: str, said: str) -> None:
    command = [*START, "--port", "0", "--data", str(tmp_path), "--ray", address.format(port=free_port())]
    done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=HANG_S)
    assert done.returncode == 2
    assert f"--ray: {said}" in done.stderr


def test_a_server_that_is_killed_leaves_no_process_on_the_cluster(
    tmp_path: Path, nodes: Nodes, cluster: object
) -> None:
    before = {process.pid for process in nodes.planning()}
    with Server(tmp_path, "--ray", nodes.address) as server, client(server) as http:
        server.wait_ready()
        job = {**http.get("/v1/demo-data/office-2x2").json(), "planner": "anytime", "budget": {"seconds": 100}}
        made = http.post("/v1/jobs", json=job).json()
        wait_until(lambda: http.get(made["links"]["self"]).json()["best"])
        ours = [process for process in nodes.planning() if process.pid not in before]
        assert len(ours) >= 3
        server.kill()
        assert psutil.wait_procs(ours, HANG_S)[1] == []


@pytest.mark.slow
def test_jobs_wait_for_a_lost_cluster_and_continue_when_it_is_back(tmp_path: Path, head: Head) -> None:
    with Server(tmp_path, "--ray", head.address) as server, client(server) as http:
        server.wait_ready()
        job = {**http.get("/v1/demo-data/office-2x2").json(), "planner": "anytime", "budget": {"seconds": 20}}
        running = http.post("/v1/jobs", json=job).json()["links"]["self"]
        wait_until(lambda: http.get(running).json()["best"])
        head.kill()
        while (answer := http.get("/readyz")).status_code == 200:
            time.sleep(0.2)
        assert "cluster" in problem(answer, 503, "not-ready")["detail"]
        waiting = http.post("/v1/jobs", json={**job, "budget": {"seconds": 1}}).json()["links"]["self"]
        time.sleep(3)
        assert [http.get(one).json()["state"] for one in (running, waiting)] == ["queued", "queued"]
        assert http.get("/healthz").status_code == 200
        head.start()
        server.wait_ready()
        for one in (waiting, running):
            while (ended := http.get(one).json())["outcome"] is None:
                time.sleep(0.1)
            assert ended["state"] == "succeeded"


@pytest.fixture
def head(monkeypatch: pytest.MonkeyPatch) -> Iterator[Head]:
    started = Head()
    for name, value in started.env.items():
        monkeypatch.setenv(name, value)
    started.start()
    yield started
    started.stop()
