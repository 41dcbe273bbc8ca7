"""Servers and their processes are killed as by ``kill -9``, at random moments, while clients are at work.

They send, follow and cancel jobs, and one reports to missions.

A server lives three kinds of lives: it is killed while it starts; it is killed before or after a commit, by a failpoint
in its store; or it is killed at work, after some of the processes below it were.
"""

from __future__ import annotations

import os
import random
import signal
import threading
import time
import uuid
from collections import Counter
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, field

from talk import ACCEPTED, BROKEN, BUSY, Talk, frames

from marsupial_service.store.failpoints import AFTER_COMMIT, BEFORE_COMMIT, VARIABLE
from trial.explorers import SEEDS, Explorer, Journeys, undisturbed_mission
from trial.house import House, NotStarted, end_strays, strays, unopened
from trial.promises import Findings, Promises, audit
from trial.rows import Judgement, TrialRow, none_of, times
from trial.tasks import short_jobs

OPTIONS = ("--limit", "queue=600", "--limit", "kept_jobs=1000000", "--limit", "streams=500")
SENDERS, FOLLOWERS = 2, 3
_GONE_S = 5.0
_END_S = 600.0
_STARTING_S = 3.0
_ARMED_S = 15.0
_LAST_COMMIT = 40
_WORK_S = 1.5
_PAUSE_S = 0.05
_CANCELLED = 0.1
_DEPTHS = {1: "launcher", 2: "supervisor", 3: "worker"}
_SHARES = (1, 3, 5)
PART = "kills"


@dataclass(slots=True)
class Toll:
    """Kills by victim, processes left behind, and how long the last one stayed after its server, in s.

    `failed` counts servers that ended by themselves.
    """

    victims: Counter[str] = field(default_factory=Counter)
    failed: int = 0
    strays: int = 0
    gone_s: list[float] = field(default_factory=list)


class Crowd:
    """Threads that send, follow and cancel until they are told to stop, whether there is a server or not."""

    def __init__(self, port: int, promises: Promises, draw: random.Random) -> None:
        self.promises = promises
        self._port = port
        self._draw = draw
        self._over = threading.Event()
        acts = [self._send] * SENDERS + [self._follow] * FOLLOWERS
        self._threads = [threading.Thread(target=self._repeat, args=(act,), daemon=True) for act in acts]
        for thread in self._threads:
            thread.start()

    def stop(self) -> None:
        """Have them finish what they are at."""
        self._over.set()
        for thread in self._threads:
            thread.join(_END_S)

    def _repeat(self, act: Callable[[], None]) -> None:
        while not self._over.is_set():
            try:
                act()
            except Exception as error:
                self.promises.note_odd(f"client failed: {error!r}")

    def _send(self) -> None:
        """Send a job, again and again until it is acknowledged; sometimes cancel it."""
        key, body = uuid.uuid4().hex, self._draw.choice(short_jobs())
        talk = Talk(self._port)
        while not self._over.is_set():
            time.sleep(_PAUSE_S)
            with suppress(*BROKEN):
                answer = talk.ask("POST", "/v1/jobs", body, {"Idempotency-Key": key})
                if answer.status in BUSY:
                    continue
                self.promises.acknowledge(key, answer)
                if answer.status in ACCEPTED and self._draw.random() < _CANCELLED:
                    self.promises.look(talk.ask("POST", f"/v1/jobs/{answer.document['id']}/cancel"))
                break
        talk.close()

    def _follow(self) -> None:
        """Follow some job to its end, through all breaks."""
        job = self.promises.any_job(self._draw)
        if job is None or job in self.promises.streams:
            time.sleep(_PAUSE_S)
            return
        told = self.promises.streams.setdefault(job, [])
        while not self._over.is_set() and not (told and told[-1].type == "end"):
            with suppress(*BROKEN):
                for frame in frames(self._port, f"/v1/jobs/{job}/events", after=len(told)):
                    told.append(frame)
                    if self._over.is_set():
                        break
            time.sleep(_PAUSE_S)


def rows(kills: int, seed: int, say: Callable[[str], None]) -> list[TrialRow]:
    """Kill so many processes, then look at every job that was acknowledged."""
    draw, toll, promises, journeys = random.Random(seed), Toll(), Promises(), Journeys()
    for number in range(1, SEEDS + 1):
        undisturbed_mission(number)
    with unopened(OPTIONS) as house:
        crowd, explorer = Crowd(house.port, promises, random.Random(seed)), Explorer(house.port, journeys)
        while toll.victims.total() < kills:
            _LIVES[draw.randrange(len(_LIVES))](house, draw, toll, promises)
            _bury(house, toll)
            if len(toll.gone_s) % 10 == 0:
                say(f"kills: {toll.victims.total()}/{kills}, {len(promises.jobs)} jobs, {journeys.missions} missions")
        house.launch()
        house.wait_ready()
        crowd.stop()
        explorer.stop(_END_S)
        say(f"kills: looking at {len(promises.jobs)} jobs")
        found = audit(house.port, promises, _END_S)
        house.terminate()
        toll.strays += len(strays(_GONE_S))
    return [*_report(toll, promises, found), *journeys.rows(PART)]


def _starting(house: House, draw: random.Random, toll: Toll, promises: Promises) -> None:
    """Kill it while it starts, or soon after."""
    house.launch()
    time.sleep(draw.uniform(0, _STARTING_S))


def _committing(house: House, draw: random.Random, toll: Toll, promises: Promises) -> None:
    """Let it be killed right before or after a commit."""
    point = draw.choice((BEFORE_COMMIT, AFTER_COMMIT))
    house.launch({VARIABLE: f"{point}=kill@{draw.randint(1, _LAST_COMMIT)}"})
    until = time.monotonic() + _ARMED_S
    while house.runs and time.monotonic() < until:
        time.sleep(_PAUSE_S)


def _working(house: House, draw: random.Random, toll: Toll, promises: Promises) -> None:
    """Kill some of the processes below it, then it, at random moments of its work."""
    house.launch()
    try:
        house.wait_ready()
    except NotStarted:
        return
    for _ in range(draw.randint(0, 4)):
        time.sleep(draw.uniform(0, _WORK_S / 3))
        (depth,) = draw.choices(list(_DEPTHS), _SHARES)
        below = house.below(depth)
        if below:
            with suppress(ProcessLookupError):
                os.kill(draw.choice(below), signal.SIGKILL)
                toll.victims[_DEPTHS[depth]] += 1
    time.sleep(draw.uniform(0, _WORK_S))


_LIVES = (_starting, _committing, _working)


def _bury(house: House, toll: Toll) -> None:
    """Kill the server if it still runs, and see how long anything of it stays."""
    toll.failed += house.ended_by_itself
    house.kill()
    toll.victims["server"] += 1
    begun = time.monotonic()
    left = strays(_GONE_S)
    toll.gone_s.append(time.monotonic() - begun)
    toll.strays += len(left)
    if left:
        end_strays()


def _report(toll: Toll, promises: Promises, found: Findings) -> list[TrialRow]:
    of = f" of {len(promises.jobs)}"
    plans = f" of {found.plans} plans"
    kinds = ", ".join(f"{count} {victim}s" for victim, count in toll.victims.most_common())
    outcomes = ", ".join(f"{word} {count}" for word, count in found.outcomes.most_common())
    return [
        TrialRow(part=PART, requirement="killed at random moments", figure=kinds, values=dict(toll.victims)),
        none_of(PART, "acknowledged jobs lost", found.lost, of),
        none_of(PART, "acknowledged jobs that never end", found.unfinished, of),
        none_of(PART, "jobs that ended more than once", found.ended_again, of),
        none_of(PART, "requests with one key that made two jobs", found.made_twice, of),
        none_of(PART, "jobs whose events are not in order", found.bad_events, of),
        none_of(PART, "revisions the checker refuses", found.bad_plans, plans),
        none_of(PART, "jobs with a revision that is not better", found.not_better, of),
        none_of(
            PART, "resumed streams unlike an uninterrupted one", found.streams_differ, f" of {len(promises.streams)}"
        ),
        none_of(PART, "requests answered as they should not be", promises.odd.total(), _words(promises.odd)),
        none_of(PART, "servers that ended by themselves", toll.failed, f" of {toll.victims['server']}"),
        none_of(PART, "processes left 5 s after their server", toll.strays),
        times(PART, "last process gone after its server", toll.gone_s),
        TrialRow(
            part=PART, requirement="how jobs ended", figure=outcomes, judgement=Judgement.NOTED, values=found.outcomes
        ),
    ]


def _words(counts: Counter[str]) -> str:
    return f" ({', '.join(f'{count} {word}' for word, count in counts.most_common())})" if counts else ""
