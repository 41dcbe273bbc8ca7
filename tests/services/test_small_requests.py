import json
import sys
import time
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
from support.services.attacks import ALL, ATTACKS, MOST_MB, REPORTS, cost_of, mission
from support.services.plain_client import Reply
from support.services.servers import Server

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="the most memory of a process is read from /proc")


@pytest.fixture(scope="module")
def attacked(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Server]:
    with Server(tmp_path_factory.mktemp("attacked")) as server:
        yield server


def unit_s() -> float:
    """Return the CPU time of fixed work, as the unit of speed of this machine."""
    begun = time.process_time()
    sum(i * i for i in range(1_000_000))
    return time.process_time() - begun


def cheap(server: Server, method: str, path: str, body: Any = None) -> Reply:
    """Return the answer to a request, after checking that it was cheap."""
    cost = cost_of(server, method, path, body)
    assert cost.memory_mb <= MOST_MB
    assert cost.cpu_s <= 20 * unit_s()  # about a second
    return cost.reply


@pytest.mark.parametrize("name", ATTACKS)
def test_no_small_request_costs_much(attacked: Server, name: str) -> None:
    attack = ATTACKS[name]
    reply = cheap(attacked, "POST", attack.path, attack.body())
    assert reply.status in attack.statuses, reply.document


def test_no_small_report_costs_much(attacked: Server) -> None:
    links = cheap(attacked, "POST", "/v1/missions", mission()).document["links"]
    replies = [cheap(attacked, "POST", links["reports"], body) for body, _ in REPORTS.values()]
    assert [reply.status for reply in replies] == [status for _, status in REPORTS.values()]
    assert replies[0].document["errors"][0]["pointer"] == "/revealed"
    assert cheap(attacked, "GET", f"{links['self']}/map").document["runs"] == ALL
    assert cheap(attacked, "POST", links["cancel"]).status == 200


def test_a_map_of_many_runs_is_read_and_written_by_other_processes(attacked: Server) -> None:
    side = 300
    cells = np.arange(side * side)
    runs = np.stack([cells, np.ones_like(cells), 2 - cells % 2], axis=1).ravel().tolist()
    frame = {"width": side, "height": side, "resolution_m": 1.0, "known": runs}
    links = cheap(attacked, "POST", "/v1/missions", json.dumps(mission(frame=frame)).encode()).document["links"]
    assert cheap(attacked, "GET", f"{links['self']}/map").document["runs"] == runs
    cheap(attacked, "POST", links["cancel"])
