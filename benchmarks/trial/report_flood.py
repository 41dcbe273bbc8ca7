"""Reports as fast as they are accepted: ``python -m benchmarks.trial.report_flood FLOOD``, in its own process.

Robots ignore commands and stand still, so nothing is replanned: this measures the cost of reports alone.
"""

from __future__ import annotations

import asyncio
import json
import sys
import time
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from typing import Any

from benchmarks.trial.async_connection import AsyncConnection

_SIDE = 200
_PLACES = [[12 * (i % 12) + 10, 20 + 60 * (i // 12)] for i in range(24)]
_NAMES = [f"carrier{i}" for i in range(len(_PLACES))]
ROBOTS = len(_NAMES)


@dataclass(frozen=True, slots=True, kw_only=True)
class ReportFlood:
    """The reports to send.

    Parameters
    ----------
    missions
        Number of concurrent missions, each with its own connection.
    seconds
        Time to send; then only answers are awaited.
    batch
        Reports per request.
    of_team
        Whether a report covers all robots, or one.
    """

    port: int
    missions: int
    seconds: float
    batch: int
    of_team: bool

    @property
    def text(self) -> str:
        """The same as JSON."""
        return json.dumps(asdict(self))


def brief() -> bytes:
    """Return the body that asks for a mission of robots on a bare floor."""
    kind: dict[str, Any] = {"name": "carrier", "role": "carrier", "terrains": ["floor"], "capacity": 0}
    kind |= {"speed_mps": 1.0, "sensor_range_m": 6.0, "radius_m": 0.4}
    team = [{"name": name, "type": "carrier", "cell": at} for name, at in zip(_NAMES, _PLACES, strict=True)]
    frame = {"width": _SIDE, "height": _SIDE, "resolution_m": 0.25}
    return json.dumps(
        {"frame": frame, "robot_types": [kind], "team": team, "strategy": "heuristic", "planner": "none"}
        | {"time_limit_ms": 360_000_000}
    ).encode()


def reports(of_team: bool) -> Iterator[dict[str, Any]]:
    """Yield reports without end; the first one leaves something to explore, so that the mission continues."""
    notes = [{"name": name, "cell": at} for name, at in zip(_NAMES, _PLACES, strict=True)]
    seen = [{"robot": _NAMES[0], "runs": [0, _SIDE * (_SIDE - 10), 1]}]
    yield {"n": 1, "t_ms": 0, "revealed": seen, "robots": notes}
    n = 1
    while True:
        n += 1
        if of_team:
            yield {"n": n, "t_ms": 100 * n, "robots": notes}
            continue
        for note in notes:
            yield {"n": n - 1, "robot": note["name"], "t_ms": 100 * n, "robots": [note]}


async def start_mission(connection: AsyncConnection) -> str:
    """Begin a mission and return its path."""
    made = await connection.post("/v1/missions", brief())
    assert made.status == 201, made.body
    path: str = json.loads(made.body)["links"]["self"]
    return path


async def _send_reports(flood: ReportFlood, until_s: float) -> int:
    """Send the reports of one mission, and return the number accepted."""
    connection = await AsyncConnection.to(flood.port)
    path, told, taken = await start_mission(connection), reports(flood.of_team), 0
    while time.monotonic() < until_s:
        await connection.report(path, [next(told) for _ in range(flood.batch)])
        taken += flood.batch
    return taken


async def _all(flood: ReportFlood) -> int:
    until_s = time.monotonic() + flood.seconds
    return sum(await asyncio.gather(*(_send_reports(flood, until_s) for _ in range(flood.missions))))


def main(text: str) -> None:
    """Send the reports described in JSON; print the number accepted, and this process's CPU seconds."""
    taken = asyncio.run(_all(ReportFlood(**json.loads(text))))
    print(json.dumps({"taken": taken, "cpu_s": time.process_time()}))


if __name__ == "__main__":
    main(sys.argv[1])
