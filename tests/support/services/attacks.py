"""The most expensive small request of each route, and a measurement of its cost to the server.

Time is the processor time of the server's process, memory the growth of the most it had at a time; what a worker does
has limits of its own.
"""

import base64
import io
from collections.abc import Callable
from contextlib import closing
from pathlib import Path
from typing import Any, NamedTuple

import psutil
from PIL import Image
from support.services.plain_client import PlainClient, Reply
from support.services.servers import Server

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
SMALL = 1450  # the most that a small compressed image may have
ALL = [0, SIDE * SIDE, 1]


class Attack(NamedTuple):
    """A request, and the allowed statuses of its answer."""

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
    return map_state(map={"rows": ROWS, "resolution_m": 0.001}, robot_types=[{**CARRIER, "radius_m": radius_m}])


def white(side: int) -> dict[str, Any]:
    """Return a large map in few bytes."""
    buffer = io.BytesIO()
    Image.new("1", (side, side), 1).save(buffer, "PNG")
    return {"image": base64.b64encode(buffer.getvalue()).decode(), "resolution_m": 1.0}


def typos() -> dict[str, Any]:
    """Return typos for which suggestions are expensive to compute."""
    kinds = [{**CARRIER, "name": "ab" * 47 + f"{i:02}"} for i in range(60)]
    robots = [{"name": f"m{i}", "type": "ba" * 47 + f"{i:03}", "cell": [5, 5]} for i in range(200)]
    return map_state(robot_types=kinds, robots=robots)


def types(**map_: Any) -> dict[str, Any]:
    """Return the largest number of robot types, each with a different footprint."""
    rover = {**CARRIER, "role": "rover", "dock_s": 1, "undock_s": 1}
    del rover["capacity"]
    kinds = [{**(CARRIER if i % 2 else rover), "name": f"k{i}", "radius_m": 0.01 * i} for i in range(60)]
    return map_state(robot_types=kinds, robots=[{"name": "m", "type": "k1", "cell": [5, 5]}], **map_)


def yaml(text: str) -> dict[str, Any]:
    return map_state(map={"nav2": {"yaml": text, "image": white(10)["image"]}})


def simulation(side: int, resolution: str = "1.0") -> dict[str, Any]:
    """Return a simulation on a large map, with the largest number of robots."""
    yaml = f"image: m\nresolution: {resolution}\norigin: [0, 0, 0]\nnegate: 0\noccupied_thresh: 0.6\nfree_thresh: 0.2\n"
    uploaded = {"yaml": yaml, "image_base64": white(side)["image"]}
    return {"map": uploaded, "carriers": 100, "rovers": 1, "planner": "greedy", "budget": {"steps": 1}, "speed": 0.1}


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
    "an image of 2 million pixels": Attack(
        "/v1/jobs", lambda: {**map_state(map=white(SMALL)), "budget": {"seconds": 0.1}}, (202,)
    ),
    "one of 4 million in 2 kB": Attack("/v1/jobs", lambda: map_state(map=white(SIDE)), (422,)),
    "one of 36 million": Attack("/v1/analysis", lambda: map_state(map=white(6000)), (413,)),
    "layer upon layer": Attack("/v1/analysis", lambda: types(map=white(SMALL)), (422,)),
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
    "2 million cells to be explored": Attack("/v1/simulations", lambda: simulation(SMALL), (201,)),
    "fine cells to be explored": Attack("/v1/simulations", lambda: simulation(SIDE, "0.001"), (422,)),
    "36 million to be explored": Attack("/v1/simulations", lambda: simulation(6000), (413,)),
    "a million robots to be simulated": Attack(
        "/v1/simulations", lambda: {"scenario": "maze", "carriers": 1000, "rovers": 1000}, (413,)
    ),
    "a map of 4 million cells": Attack("/v1/missions", lambda: mission(), (201,)),
}


REPORTS: dict[str, tuple[Any, int]] = {
    "a report in which each of 200 robots sees 4 million cells": (
        {"n": 1, "t_ms": 0, "revealed": [{"robot": f"m{i}", "runs": ALL} for i in range(200)]},
        413,
    ),
    "one in which one of them does": ({"n": 1, "t_ms": 0, "revealed": [{"robot": "m0", "runs": ALL}]}, 200),
}
"""Consecutive reports of `mission()`, and the status of each answer."""


class Cost(NamedTuple):
    """The cost of a request to the server's process: CPU seconds, and growth of its peak memory."""

    reply: Reply
    cpu_s: float
    memory_mb: float


def cost_of(server: Server, method: str, path: str, body: Any = None) -> Cost:
    """Send a request and return what it costs; for Linux."""
    pid = server.process.pid
    Path(f"/proc/{pid}/clear_refs").write_text("5")  # resets the peak memory
    memory_mb, cpu_s = _most_mb(pid), _cpu_s(pid)
    with closing(PlainClient(server.port, 60)) as client:
        reply = client.ask(method, path, body)
    return Cost(reply, _cpu_s(pid) - cpu_s, _most_mb(pid) - memory_mb)


def _cpu_s(pid: int) -> float:
    times = psutil.Process(pid).cpu_times()
    return float(times.user + times.system)


def _most_mb(pid: int) -> float:
    lines = Path(f"/proc/{pid}/status").read_text().splitlines()
    return int(next(line for line in lines if line.startswith("VmHWM")).split()[1]) / 1024
