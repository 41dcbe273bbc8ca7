"""Reports and missions under load: how many answers come in time, and their cost.

The load runs on the same processors as the server. So CPU seconds are given beside all wall-clock times, which mean
less on a busy machine.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import psutil
from support.services.plain_client import PlainClient

from benchmarks.trial.fleets import Load, Speaker
from benchmarks.trial.report_flood import ROBOTS, ReportFlood
from benchmarks.trial.rows import TrialRow, judged, none_of, times
from benchmarks.trial.trial_server import TrialServer, running_server

PRESS, ONE, MANY = "reports", "one mission", "missions at once"
RATE_GOAL_HZ, LAG_GOAL_S = 1000.0, 0.3
MANY_FLEETS, MANY_HZ = 50, 2.0
MANY_LAG_GOAL_S = 1 / MANY_HZ
"""Nothing queues up if each report is answered before the next one is sent."""

OPTIONS = ("--limit=missions=100", "--limit=streams=1000")

_ROOT = Path(__file__).resolve().parents[2]
_SLACK_S = 240.0
_LATE_S = 60.0
_MISSIONS = 4
_POLL_S = 0.02


@dataclass(frozen=True, slots=True)
class Used:
    """CPU seconds of the server's process, and of all processes below it."""

    server: float
    below: float

    def since(self, before: Used) -> Used:
        """Return the CPU seconds used in between."""
        return Used(self.server - before.server, self.below - before.below)

    def text(self, reports: int, by_load_s: float, seconds: float) -> str:
        """Return the cost of each report, and the number of busy processors."""
        a_report = f"{1000 * self.server / reports:.2f} + {1000 * self.below / reports:.2f} ms of a processor each"
        busy, load = (self.server + self.below + by_load_s) / seconds, os.getloadavg()[0]
        with_sending = f"{by_load_s / seconds:.2f} with sending"
        return f"{a_report}; {busy:.2f} of {os.cpu_count()} processors busy, {with_sending}; load {load:.1f}"


def used(server: TrialServer) -> Used:
    """Return a server's CPU seconds so far, including its processes that have ended."""
    process = psutil.Process(server.process.pid)
    below = sum(sum(one.cpu_times()[:4]) for one in process.children(recursive=True))
    return Used(sum(process.cpu_times()[:2]), below)


def report_rows(seconds: float, say: Callable[[str], None]) -> Iterator[TrialRow]:
    """Send reports as fast as they are accepted: of a whole team each, then of a robot each."""
    for of_team, batch in ((True, 25), (False, 96)):
        whose = f"of {ROBOTS} robots" if of_team else "of a robot"
        say(f"reports {whose} each, as fast as they are taken: {seconds:g} s")
        with running_server(OPTIONS) as server:
            flood = ReportFlood(port=server.port, missions=_MISSIONS, seconds=seconds, batch=batch, of_team=of_team)
            before, begun_s = used(server), time.monotonic()
            found = _run("report_flood", flood.text, seconds)
            _wait_for_answers(server)
            took_s, cost = time.monotonic() - begun_s, used(server).since(before)
        rate = found["taken"] / took_s
        yield TrialRow(
            part=PRESS,
            requirement=f"{whose} each, {batch} in a request, answered",
            figure=f"{rate:.0f} a second; {cost.text(found['taken'], found['cpu_s'], took_s)}",
            goal=f"{RATE_GOAL_HZ:.0f} a second",
            judgement=judged(rate >= RATE_GOAL_HZ),
            values={"rate_hz": rate, "server_s": cost.server, "below_s": cost.below, "reports": found["taken"]},
        )


def mission_rows(seconds: float, say: Callable[[str], None]) -> Iterator[TrialRow]:
    """Have each robot of one fleet report at 10 Hz, with the others or alone; planning time is charged."""
    for speaker in (Speaker.ROBOTS_TOGETHER, Speaker.ROBOTS):
        say(f"one mission, {speaker} at 10 Hz: {seconds:g} s")
        how: dict[str, Any] = {"fleets": 1, "hz": 10.0, "planner": "anytime", "budget_s": 0.1}
        yield from _fleet_rows(ONE, seconds, speaker, LAG_GOAL_S, how)


def missions_rows(seconds: float, say: Callable[[str], None]) -> Iterator[TrialRow]:
    """Have many fleets report at the same time, each in one report of all its robots."""
    say(f"missions at once: {MANY_FLEETS} at {MANY_HZ:g} Hz, {seconds:g} s")
    yield from _fleet_rows(MANY, seconds, Speaker.TEAM, MANY_LAG_GOAL_S, {"fleets": MANY_FLEETS, "hz": MANY_HZ})


def _fleet_rows(part: str, seconds: float, speaker: Speaker, goal_s: float, how: dict[str, Any]) -> Iterator[TrialRow]:
    with running_server(OPTIONS) as server:
        load = Load(port=server.port, seconds=seconds, speaker=speaker, **how)
        before, begun_s = used(server), time.monotonic()
        found = _run("fleets", load.text, seconds)
        took_s, cost = time.monotonic() - begun_s, used(server).since(before)
    sent, lags_s = found["sent"], found["lags_s"]
    hz = load.fleets * load.hz * (1 if speaker is Speaker.TEAM else load.robots)
    fleets = "" if load.fleets == 1 else f"{load.fleets} x "
    more = f", {found['plans']} plans, {found['commands']} commands; {cost.text(sent, found['cpu_s'], took_s)}"
    yield times(part, f"{fleets}{load.robots} robots, {hz:g} reports a second ({speaker}): lag", lags_s, goal_s, more)
    missing = found["due"] - sent + sent - len(lags_s) + sum(found["odd"].values())
    odd = "".join(f"; {status}" for status in list(found["odd"])[:3])
    yield none_of(part, "reports not sent in time, refused or not answered", missing, f" of {found['due']}{odd}")


def _run(module: str, text: str, seconds: float) -> Any:
    done = subprocess.run(
        [sys.executable, "-m", f"benchmarks.trial.{module}", text],
        cwd=_ROOT,
        stdout=subprocess.PIPE,
        timeout=seconds + _SLACK_S,
        check=True,
    )
    return json.loads(done.stdout)


def _wait_for_answers(server: TrialServer) -> None:
    client = PlainClient(server.port)
    until_s = time.monotonic() + _LATE_S
    while time.monotonic() < until_s:
        lines = client.ask("GET", "/metrics").document.splitlines()
        if next(float(line.split()[1]) for line in lines if line.startswith("marsupial_backlog ")) <= 0:
            break
        time.sleep(_POLL_S)
    client.close()
