"""The smallest request for the greatest cost, route by route: each is sent, and what it costs the server is measured.

Time is the processor time of the server's process, memory the growth of the most it had at a time; what a worker does
has limits of its own.
"""

from __future__ import annotations

import base64
import io
import json
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import psutil
import pytest
from PIL import Image
from servers import Server
from talk import Reply, Talk

MOST_MB, MOST_S = 200, 1.0

CARRIER = {
    "name": "carrier",
    "role": "carrier",
    "speed_mps": 1.0,
    "sensor_range_m": 10.0,
    "radius_m": 0.4,
    "terrains": ["floor"],
    "capacity": 2,
}
ROWS = ["." * 10] * 10
SIDE = 2000
ALL = [0, SIDE * SIDE, 1]


class Attack(NamedTuple):
    """A request, and the statuses it may be answered with."""

    path: str
    body: Callable[[], Any]
    statuses: tuple[int, ...]


def map_state(**changes: Any) -> dict[str, Any]:
    found = {
        "map": {"rows": ROWS, "resolution_m": 1.0},
        "robot_types": [CARRIER],
        "robots": [{"name": "m", "type": "carrier", "cell": [5, 5]}],
    }
    return {"map_state": {**found, **changes}}


def fine(radius_m: float) -> dict[str, Any]:
    """Return a robot of many cells."""
    return map_state(map={"rows": ROWS, "resolution_m": 0.001}, robot_types=[{**CARRIER, "radius_m": radius_m}])


def white(side: int) -> dict[str, Any]:
    """Return a large map in few bytes."""
    buffer = io.BytesIO()
    Image.new("1", (side, side), 1).save(buffer, "PNG")
    return {"image": base64.b64encode(buffer.getvalue()).decode(), "resolution_m": 1.0}


def typos() -> dict[str, Any]:
    """Return words that are hard to compare with those that may have been meant."""
    kinds = [{**CARRIER, "name": "ab" * 47 + f"{i:02}"} for i in range(60)]
    robots = [{"name": f"m{i}", "type": "ba" * 47 + f"{i:03}", "cell": [5, 5]} for i in range(200)]
    return map_state(robot_types=kinds, robots=robots)


def types(**map_: Any) -> dict[str, Any]:
    """Return as many robot types as there may be, each with a footprint of its own."""
    rover = {**CARRIER, "role": "rover", "dock_s": 1, "undock_s": 1}
    del rover["capacity"]
    kinds = [{**(CARRIER if i % 2 else rover), "name": f"k{i}", "radius_m": 0.01 * i} for i in range(60)]
    return map_state(robot_types=kinds, robots=[{"name": "m", "type": "k1", "cell": [5, 5]}], **map_)


def yaml(text: str) -> dict[str, Any]:
    return map_state(map={"nav2": {"yaml": text, "image": white(10)["image"]}})


def mission(side: int = SIDE, resolution_m: float = 1.0, **changes: Any) -> dict[str, Any]:
    frame = {"width": side, "height": side, "resolution_m": resolution_m}
    team = [{"name": f"m{i}", "type": "carrier", "cell": [5, 5]} for i in range(200)]
    return {"frame": frame, "robot_types": [CARRIER], "team": team, **changes}


def twice() -> bytes:
    names = ",".join(f'"{i}":1' for i in range(6500))
    return f'{{{names},"6499":1}}'.encode()


ATTACKS: dict[str, Attack] = {
    "a robot of 79 million cells": Attack("/v1/jobs", lambda: fine(5), (422,)),
    "one of 31 billion": Attack("/v1/analysis", lambda: fine(100), (422,)),
    "a mission of such robots": Attack(
        "/v1/missions", lambda: mission(10, 0.001, robot_types=[{**CARRIER, "radius_m": 5}]), (422,)
    ),
    "an image of 4 million pixels": Attack(
        "/v1/jobs", lambda: {**map_state(map=white(SIDE)), "budget": {"seconds": 0.1}}, (202,)
    ),
    "one of 36 million": Attack("/v1/analysis", lambda: map_state(map=white(6000)), (413,)),
    "layer upon layer": Attack("/v1/analysis", lambda: types(map=white(SIDE)), (422,)),
    "words that nobody meant": Attack("/v1/jobs", typos, (422,)),
    "a row of characters that are none": Attack(
        "/v1/jobs",
        lambda: map_state(map={"rows": ["".join(map(chr, range(20_000, 40_000)))], "resolution_m": 1}),
        (422,),
    ),
    "a field twice among thousands": Attack("/v1/jobs", twice, (400,)),
    "brackets": Attack("/v1/validations", lambda: b"[" * 60_000, (400,)),
    "digits": Attack("/v1/jobs", lambda: b'{"planner":' + b"9" * 60_000 + b"}", (400,)),
    "a number in base 60": Attack("/v1/analysis", lambda: yaml("resolution: " + "1:" * 30_000 + "1"), (422,)),
    "brackets in YAML": Attack("/v1/analysis", lambda: yaml("[" * 60_000), (422,)),
    "30,000 robots": Attack("/v1/jobs", lambda: map_state(robots=[1] * 30_000), (413,)),
    "a million": Attack("/v1/jobs", lambda: map_state(robots=[1] * 1_000_000), (413,)),
    "wrong numbers": Attack("/v1/missions", lambda: mission(area=["a"] * 15_000), (422,)),
    "a plan of nothing": Attack(
        "/v1/validations",
        lambda: {
            "situation": {"types": [], "robots": [], "targets": [], "meetings": [], "travel_ms": {}},
            "plan": {"ipc": "0.0: (a)[1]\n" * 4500},
        },
        (422,),
    ),
    "a map of 4 million cells": Attack("/v1/missions", lambda: mission(), (201,)),
}


class Watched:
    """A server whose costs are measured."""

    def __init__(self, server: Server) -> None:
        self._process = psutil.Process(server.process.pid)
        self._folder = Path(f"/proc/{server.process.pid}")
        self._port = server.port

    def ask(self, method: str, path: str, body: Any = None) -> Reply:
        """Send a request, and hold what it costs to the limits."""
        (self._folder / "clear_refs").write_text("5")  # the most memory is counted from here
        memory_mb, cpu_s = self._most_mb(), self._cpu_s()
        talk = Talk(self._port, 60)
        reply = talk.ask(method, path, body)
        talk.close()
        assert self._most_mb() - memory_mb <= MOST_MB, (method, path)
        assert self._cpu_s() - cpu_s <= MOST_S, (method, path)
        return reply

    def _cpu_s(self) -> float:
        times = self._process.cpu_times()
        return float(times.user + times.system)

    def _most_mb(self) -> float:
        lines = (self._folder / "status").read_text().splitlines()
        return int(next(line for line in lines if line.startswith("VmHWM")).split()[1]) / 1024


@pytest.fixture(scope="module")
def watched(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Watched]:
    if sys.platform != "linux":
        pytest.skip("the most memory of a process is read from /proc")
    with Server(tmp_path_factory.mktemp("attacked")) as server:
        yield Watched(server)


@pytest.mark.parametrize("name", ATTACKS)
def test_no_small_request_costs_much(watched: Watched, name: str) -> None:
    attack = ATTACKS[name]
    reply = watched.ask("POST", attack.path, attack.body())
    assert reply.status in attack.statuses, reply.document


def test_no_small_report_costs_much(watched: Watched) -> None:
    links = watched.ask("POST", "/v1/missions", mission()).document["links"]
    everything = [{"robot": f"m{i}", "runs": ALL} for i in range(200)]
    refused = watched.ask("POST", links["reports"], {"n": 1, "t_ms": 0, "revealed": everything})
    assert refused.status == 413
    assert refused.document["errors"][0]["pointer"] == "/revealed"
    taken = watched.ask("POST", links["reports"], {"n": 1, "t_ms": 0, "revealed": everything[:1]})
    assert taken.status == 200
    assert watched.ask("GET", f"{links['self']}/map").document["runs"] == ALL
    assert watched.ask("POST", links["cancel"]).status == 200


def test_a_map_of_many_runs_is_read_and_told_by_other_processes(watched: Watched) -> None:
    side = 300
    board = np.arange(side * side) % 2 + 1
    runs = np.stack([np.arange(side * side), np.ones(side * side), board], axis=1).astype(int).ravel().tolist()
    body = json.dumps(mission(side, frame={"width": side, "height": side, "resolution_m": 1.0, "known": runs}))
    made = watched.ask("POST", "/v1/missions", body.encode()).document
    assert watched.ask("GET", f"{made['links']['self']}/map").document["runs"] == runs
    watched.ask("POST", made["links"]["cancel"])
