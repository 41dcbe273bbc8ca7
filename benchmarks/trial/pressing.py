"""Reports as fast as they are taken: ``python -m benchmarks.trial.pressing PRESS``, a process of its own.

Robots rest whatever they are commanded, so nothing is planned anew: what reports themselves cost is what is asked.
"""

from __future__ import annotations

import asyncio
import json
import sys
import time
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from typing import Any

from benchmarks.trial.lines import Line

_SIDE = 200
_PLACES = [[12 * (i % 12) + 10, 20 + 60 * (i // 12)] for i in range(24)]
_NAMES = [f"carrier{i}" for i in range(len(_PLACES))]
ROBOTS = len(_NAMES)


@dataclass(frozen=True, slots=True, kw_only=True)
class Press:
    """What is sent.

    Parameters
    ----------
    missions
        At a time; each has a connection of its own.
    seconds
        For so long; then what was sent is answered.
    batch
        Reports in a request.
    of_team
        Whether a report tells of all robots, or of one.
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
    """Yield reports without end; the first one leaves something to be explored, so that the mission goes on."""
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


async def begun(line: Line) -> str:
    """Begin a mission and return its path."""
    made = await line.post("/v1/missions", brief())
    assert made.status == 201, made.body
    path: str = json.loads(made.body)["links"]["self"]
    return path


async def _press(press: Press, until_s: float) -> int:
    """Send the reports of one mission, and return how many were taken."""
    line = await Line.to(press.port)
    path, told, taken = await begun(line), reports(press.of_team), 0
    while time.monotonic() < until_s:
        await line.report(path, [next(told) for _ in range(press.batch)])
        taken += press.batch
    return taken


async def _all(press: Press) -> int:
    until_s = time.monotonic() + press.seconds
    return sum(await asyncio.gather(*(_press(press, until_s) for _ in range(press.missions))))


def main(text: str) -> None:
    """Send what is described in JSON, and print how many reports were taken, and what this process has used, in s."""
    taken = asyncio.run(_all(Press(**json.loads(text))))
    print(json.dumps({"taken": taken, "cpu_s": time.process_time()}))


if __name__ == "__main__":
    main(sys.argv[1])
