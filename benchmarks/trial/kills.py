"""Servers and their processes are killed as by ``kill -9``, at random moments, while clients work.

Clients send, follow and cancel jobs, and one reports to missions. The database is a file (SQLite), used by one server
alone; in `shared_kills` servers share a database.

A server lives three kinds of lives: it is killed while it starts; it is killed before or after a commit, by a failpoint
in its store; or it is killed at work, after some of the processes below it.
"""

from __future__ import annotations

import os
import random
import signal
import subprocess
import time
from collections.abc import Callable
from contextlib import suppress

from servers import NotStarted

from benchmarks.trial.crowd import Crowd
from benchmarks.trial.explorers import SEEDS, ExplorerClient, Journeys, undisturbed_mission
from benchmarks.trial.failpoints import AFTER_COMMIT, BEFORE_COMMIT, VARIABLE
from benchmarks.trial.house import House, strays, unopened
from benchmarks.trial.promises import Promises, audit
from benchmarks.trial.rows import TrialRow, none_of
from benchmarks.trial.toll import COMMITTING, DEPTHS, SERVER, SHARES, Toll, report

OPTIONS = ("--limit", "queue=600", "--limit", "kept_jobs=1000000", "--limit", "streams=500")
_GONE_S = 5.0
_END_S = 600.0
_STARTING_S = 3.0
_ARMED_S = 15.0
_LAST_COMMIT = 40
_WORK_S = 1.5
_PAUSE_S = 0.05
_RIVALS = 0.1
"""The share of lives in which a second server also tries to open the folder."""

PART = "kills"


def rows(kills: int, seed: int, say: Callable[[str], None]) -> list[TrialRow]:
    """Kill `kills` processes, then check every acknowledged job."""
    draw, toll, promises, journeys = random.Random(seed), Toll(), Promises(), Journeys()
    for number in range(1, SEEDS + 1):
        undisturbed_mission(number)
    with unopened(OPTIONS) as house:
        ports = (house.port,)
        crowd = Crowd(ports, promises, random.Random(seed))
        explorer = ExplorerClient(ports, journeys, promises.missions.append)
        while toll.victims.total() < kills:
            _LIVES[draw.randrange(len(_LIVES))](house, draw, toll)
            _bury(house, toll)
            if len(toll.gone_s) % 10 == 0:
                say(f"{PART}: {toll.victims.total()}/{kills}, {len(promises.jobs)} jobs, {journeys.missions} missions")
        house.launch()
        house.wait_ready()
        crowd.stop()
        explorer.stop(_END_S)
        say(f"{PART}: looking at {len(promises.jobs)} jobs")
        found = audit(ports, promises, _END_S)
        house.terminate()
        toll.strays += len(strays(_GONE_S))
        toll.read_log(house.log)
    owners = none_of(PART, "second servers that got the folder of another", toll.rivals_let_in, f" of {toll.rivals}")
    return [*report(PART, toll, promises, found), owners, *journeys.rows(PART)]


def _starting(house: House, draw: random.Random, toll: Toll) -> None:
    """Kill the server while it starts, or soon after."""
    house.launch()
    time.sleep(draw.uniform(0, _STARTING_S))


def _committing(house: House, draw: random.Random, toll: Toll) -> None:
    """Have the server killed right before or after a commit."""
    house.launch(armed(draw))
    until = time.monotonic() + _ARMED_S
    while house.runs and time.monotonic() < until:
        time.sleep(_PAUSE_S)


def armed(draw: random.Random) -> dict[str, str]:
    """Return the environment that kills a server right before or after one of its first commits."""
    point = draw.choice((BEFORE_COMMIT, AFTER_COMMIT))
    return {VARIABLE: f"{point}=kill@{draw.randint(1, _LAST_COMMIT)}"}


def _working(house: House, draw: random.Random, toll: Toll) -> None:
    """Kill some of the processes below the server, then the server, at random moments of its work."""
    house.launch()
    try:
        house.wait_ready()
    except NotStarted:
        return
    if draw.random() < _RIVALS:
        _rival(house, toll)
    for _ in range(draw.randint(0, 4)):
        time.sleep(draw.uniform(0, _WORK_S / 3))
        kill_below(house, draw, toll)
    time.sleep(draw.uniform(0, _WORK_S))


_LIVES = (_starting, _committing, _working)


def kill_below(house: House, draw: random.Random, toll: Toll) -> None:
    """Kill one of the processes below a server."""
    (depth,) = draw.choices(list(DEPTHS), SHARES)
    below = house.below(depth)
    if below:
        with suppress(ProcessLookupError):
            os.kill(draw.choice(below), signal.SIGKILL)
            toll.victims[DEPTHS[depth]] += 1


def _rival(house: House, toll: Toll) -> None:
    """Start a second server on the folder, which must be refused."""
    rival = House(house.data, *OPTIONS)
    rival.launch()
    toll.rivals += 1
    try:
        toll.rivals_let_in += rival.process.wait(_ARMED_S) == 0
    except subprocess.TimeoutExpired:
        toll.rivals_let_in += 1
        rival.kill()


def _bury(house: House, toll: Toll) -> None:
    """Kill the server if it still runs, and measure how long its processes stay."""
    toll.failed += house.ended_by_itself
    toll.victims[SERVER if house.runs else COMMITTING] += 1
    house.kill()
    toll.look_for_strays()
