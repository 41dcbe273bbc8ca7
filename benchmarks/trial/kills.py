"""Servers and their processes are killed as by ``kill -9``, at random moments, while clients work.

Clients send, follow and cancel jobs, and one reports to missions. The database is a file (SQLite), used by one server
alone; in `shared_kills` servers share a database.

A server is killed in one of three ways: while it starts; before or after a commit, by a failpoint in its store; or at
work, after some of the processes below it.
"""

from __future__ import annotations

import os
import random
import signal
import subprocess
import time
from collections.abc import Callable
from contextlib import suppress

from support.services.servers import NotStarted

from benchmarks.trial.client_records import ClientRecords, audit
from benchmarks.trial.client_threads import ClientThreads
from benchmarks.trial.explorers import SEEDS, ExplorerClient, MissionResults, reference_log
from benchmarks.trial.failpoints import AFTER_COMMIT, BEFORE_COMMIT, VARIABLE
from benchmarks.trial.kill_tally import COMMITTING, DEPTHS, SERVER, SHARES, KillTally, report
from benchmarks.trial.rows import TrialRow, none_of
from benchmarks.trial.trial_server import TrialServer, new_server, orphans

OPTIONS = ("--limit", "queue=600", "--limit", "kept_jobs=1000000", "--limit", "streams=500")
_GONE_S = 5.0
_END_S = 600.0
_STARTING_S = 3.0
_ARMED_S = 15.0
_LAST_COMMIT = 40
_WORK_S = 1.5
_PAUSE_S = 0.05
_SECOND_SERVERS = 0.1
"""The share of runs in which a second server also tries to open the folder."""

PART = "kills"


def rows(kills: int, seed: int, say: Callable[[str], None]) -> list[TrialRow]:
    """Kill `kills` processes, then check every acknowledged job."""
    draw, tally, records, results = random.Random(seed), KillTally(), ClientRecords(), MissionResults()
    for number in range(1, SEEDS + 1):
        reference_log(number)
    with new_server(OPTIONS) as server:
        ports = (server.port,)
        clients = ClientThreads(ports, records, random.Random(seed))
        explorer = ExplorerClient(ports, results, records.missions.append)
        while tally.victims.total() < kills:
            _KILLS[draw.randrange(len(_KILLS))](server, draw, tally)
            _record_kill(server, tally)
            if len(tally.gone_s) % 10 == 0:
                say(f"{PART}: {tally.victims.total()}/{kills}, {len(records.jobs)} jobs, {results.missions} missions")
        server.launch()
        server.wait_ready()
        clients.stop()
        explorer.stop(_END_S)
        say(f"{PART}: looking at {len(records.jobs)} jobs")
        found = audit(ports, records, _END_S)
        server.terminate()
        tally.orphans += len(orphans(_GONE_S))
        tally.read_log(server.log)
    owners = none_of(
        PART,
        "second servers that got the folder of another",
        tally.second_servers_admitted,
        f" of {tally.second_servers}",
    )
    return [*report(PART, tally, records, found), owners, *results.rows(PART)]


def _starting(server: TrialServer, draw: random.Random, tally: KillTally) -> None:
    """Kill the server while it starts, or soon after."""
    server.launch()
    time.sleep(draw.uniform(0, _STARTING_S))


def _committing(server: TrialServer, draw: random.Random, tally: KillTally) -> None:
    """Have the server killed right before or after a commit."""
    server.launch(armed(draw))
    until = time.monotonic() + _ARMED_S
    while server.runs and time.monotonic() < until:
        time.sleep(_PAUSE_S)


def armed(draw: random.Random) -> dict[str, str]:
    """Return the environment that kills a server right before or after one of its first commits."""
    point = draw.choice((BEFORE_COMMIT, AFTER_COMMIT))
    return {VARIABLE: f"{point}=kill@{draw.randint(1, _LAST_COMMIT)}"}


def _working(server: TrialServer, draw: random.Random, tally: KillTally) -> None:
    """Kill some of the processes below the server, then the server, at random moments of its work."""
    server.launch()
    try:
        server.wait_ready()
    except NotStarted:
        return
    if draw.random() < _SECOND_SERVERS:
        _start_second_server(server, tally)
    for _ in range(draw.randint(0, 4)):
        time.sleep(draw.uniform(0, _WORK_S / 3))
        kill_below(server, draw, tally)
    time.sleep(draw.uniform(0, _WORK_S))


_KILLS = (_starting, _committing, _working)


def kill_below(server: TrialServer, draw: random.Random, tally: KillTally) -> None:
    """Kill one of the processes below a server."""
    (depth,) = draw.choices(list(DEPTHS), SHARES)
    below = server.below(depth)
    if below:
        with suppress(ProcessLookupError):
            os.kill(draw.choice(below), signal.SIGKILL)
            tally.victims[DEPTHS[depth]] += 1


def _start_second_server(server: TrialServer, tally: KillTally) -> None:
    """Start a second server on the folder, which must be refused."""
    second = TrialServer(server.data, *OPTIONS)
    second.launch()
    tally.second_servers += 1
    try:
        tally.second_servers_admitted += second.process.wait(_ARMED_S) == 0
    except subprocess.TimeoutExpired:
        tally.second_servers_admitted += 1
        second.kill()


def _record_kill(server: TrialServer, tally: KillTally) -> None:
    """Kill the server if it still runs, and measure how long its processes stay."""
    tally.failed += server.ended_by_itself
    tally.victims[SERVER if server.runs else COMMITTING] += 1
    server.kill()
    tally.measure_orphans()
