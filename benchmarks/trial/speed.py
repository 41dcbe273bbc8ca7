"""How soon a service answers, plans and ends with many jobs and clients, against the machine's own delays."""

from __future__ import annotations

import json
import os
import threading
import time
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from tempfile import TemporaryFile
from typing import Any

from support.services.plain_client import ACCEPTED, BROKEN, PlainClient, ask, frames

from benchmarks.trial.client_records import improving
from benchmarks.trial.rows import TrialRow, judged, none_of, percentile, times
from benchmarks.trial.tasks import LARGEST, body, read_situation, scored, small_floor, suite_body
from benchmarks.trial.trial_server import TrialServer, orphans, running_server
from marsupial.model.situation import Situation

ANSWER, FIRST, CONCURRENT, END, FLOOD = "answer", "first plan", "clients at once", "end", "full queue"
ANSWER_GOAL_S, FIRST_GOAL_S, END_GOAL_S = 0.05, 0.15, 3.0
GROWTH_GOAL_BYTES = 64 << 20
OPTIONS = ("--limit=queue=100000", "--limit=streams=1000")

_WAITING = 100
_LONG_S = 30.0
_CONCURRENT_S = 0.2
_QUEUE = 100
_GONE_S = 5.0
_SPREAD_S = 0.01


def answer_rows(posts: int, say: Callable[[str], None]) -> list[TrialRow]:
    """Post jobs while a hundred wait and the slots are taken; between them, send no-op requests, and write to disk."""
    say(f"answer: {posts} jobs while {_WAITING} wait")
    with running_server(OPTIONS) as server:
        client = PlainClient(server.port)
        long = suite_body(LARGEST[0], "anytime", _LONG_S)
        for _ in range(_WAITING + _slots(client)):
            client.ask("POST", "/v1/jobs", long)
        taken, bare, synced = [], [], []
        small = [body(small_floor(seed), "anytime", _LONG_S) for seed in range(10)]
        with TemporaryFile(dir=server.data) as file:
            for number in range(posts):
                taken.append(_timed(partial(client.ask, "POST", "/v1/jobs", small[number % len(small)])))
                bare.append(_timed(partial(client.ask, "GET", "/healthz")))
                synced.append(_timed(partial(_sync, file)))
                time.sleep(_SPREAD_S)
        client.close()
    ratio = percentile(taken, 0.5) / percentile(bare, 0.5)
    more = f", {ratio:.1f} x a bare request at p50"
    return [
        times(ANSWER, f"a job is acknowledged while {_WAITING} wait", taken, ANSWER_GOAL_S, more),
        times(ANSWER, "beside it: a bare request", bare),
        times(ANSWER, "beside it: 4 KiB written and synced", synced),
    ]


def first_plan_rows(runs: int, say: Callable[[str], None]) -> list[TrialRow]:
    """Post situations of the largest team, one at a time, and follow each until its first plan."""
    say(f"first plan: {runs} jobs")
    with running_server(OPTIONS) as server:
        took = [_first_plan(server, LARGEST[n % len(LARGEST)]) for n in range(-len(LARGEST), runs)][len(LARGEST) :]
    found = [arrival.seconds for arrival in took if arrival.valid]
    return [
        times(FIRST, "of a 6x3 team with 20 targets, posted to received", found, FIRST_GOAL_S),
        times(FIRST, "of that, until the job was acknowledged", [arrival.acknowledged_s for arrival in took]),
        none_of(FIRST, "jobs without a valid first plan", len(took) - len(found), f" of {len(took)}"),
    ]


def concurrent_rows(clients: int, say: Callable[[str], None]) -> list[TrialRow]:
    """Have many clients post different jobs at once, follow their jobs and check every plan."""
    say(f"clients at once: {clients}")
    with running_server(OPTIONS) as server:
        slots = _slots(PlainClient(server.port))
        together = threading.Barrier(clients)
        with ThreadPoolExecutor(clients) as pool:
            visits = list(pool.map(lambda seed: _visit(server.port, seed, together), range(clients)))
    first_s = [visit.first_s for visit in visits if visit.first_s is not None]
    more = f", {_CONCURRENT_S:g} s of search each, {slots} at a time"
    return [
        none_of(CONCURRENT, "clients without a valid plan", clients - len(first_s), f" of {clients}"),
        none_of(CONCURRENT, "plans that are refused or not better", sum(visit.bad for visit in visits)),
        times(CONCURRENT, "first plan, posted to received", first_s, more=more),
    ]


def end_rows(streams: int, say: Callable[[str], None]) -> list[TrialRow]:
    """Terminate a server with `streams` open streams, on running and on waiting jobs."""
    say(f"end: {streams} streams")
    with running_server(OPTIONS) as server:
        client = PlainClient(server.port)
        long = suite_body(LARGEST[0], "anytime", _LONG_S)
        jobs = [client.ask("POST", "/v1/jobs", long).document["id"] for _ in range(max(2, streams // 10))]
        client.close()
        began = threading.Barrier(streams + 1)
        with ThreadPoolExecutor(streams) as pool:
            ends = [pool.submit(_hold, server.port, jobs[n % len(jobs)], began) for n in range(streams)]
            began.wait(60)
            seconds = server.terminate()
            clean = sum(one.result() for one in ends)
        left = orphans(_GONE_S)
    figure = f"{1000 * seconds:.0f} ms until nothing runs, {clean} of {streams} streams ended in order"
    held = seconds <= END_GOAL_S and clean == streams
    return [
        TrialRow(
            part=END,
            requirement=f"SIGTERM with {streams} streams open",
            figure=figure,
            goal=f"{1000 * END_GOAL_S:.0f} ms",
            judgement=judged(held),
            values={"seconds": seconds, "clean": clean, "streams": streams},
        ),
        none_of(END, "processes left", len(left)),
    ]


def flood_rows(say: Callable[[str], None]) -> list[TrialRow]:
    """Post ten times as many jobs as may wait: the rest must be refused, and the server must not grow."""
    say(f"full queue: {10 * _QUEUE} jobs where {_QUEUE} may wait")
    with running_server((f"--limit=queue={_QUEUE}",)) as server:
        client = PlainClient(server.port)
        large = suite_body(LARGEST[0], "anytime", _LONG_S)
        for _ in range(_QUEUE + _slots(client)):
            client.ask("POST", "/v1/jobs", large)
        before = server.resident_bytes()
        refused = [client.ask("POST", "/v1/jobs", large).status for _ in range(9 * _QUEUE)]
        grown = server.resident_bytes() - before
        client.close()
    taken = sum(status in ACCEPTED for status in refused)
    odd = len(refused) - taken - refused.count(429)
    return [
        TrialRow(
            part=FLOOD,
            requirement=f"memory gained by {len(refused)} jobs too many",
            figure=f"{grown / 2**20:.0f} MiB",
            goal=f"{GROWTH_GOAL_BYTES >> 20} MiB",
            judgement=judged(grown <= GROWTH_GOAL_BYTES),
            values={"bytes": grown, "taken": taken},
        ),
        none_of(FLOOD, "answers other than 429", odd + taken, f" of {len(refused)}"),
    ]


@dataclass(frozen=True, slots=True)
class _Arrival:
    acknowledged_s: float
    seconds: float
    valid: bool


@dataclass(frozen=True, slots=True)
class _Visit:
    first_s: float | None
    bad: int


def _first_plan(server: TrialServer, name: str) -> _Arrival:
    sent = suite_body(name, "auto", 5.0)
    situation = _situation(sent)
    begun = time.monotonic()
    path = ask(server.port, "POST", "/v1/jobs", sent).document["links"]["self"]
    acknowledged_s = time.monotonic() - begun
    data = next((frame.data for frame in frames(server.port, f"{path}/events") if frame.type == "plan"), None)
    seconds = time.monotonic() - begun
    ask(server.port, "POST", f"{path}/cancel")
    while server.below(2):
        time.sleep(_SPREAD_S)
    valid = data is not None and scored(situation, json.loads(data)["actions"]) is not None
    return _Arrival(acknowledged_s, seconds, valid)


def _situation(sent: bytes) -> Situation:
    return read_situation(json.loads(sent)["situation"])


def _visit(port: int, seed: int, together: threading.Barrier) -> _Visit:
    situation = small_floor(100 + seed)
    sent = body(situation, "anytime", _CONCURRENT_S)
    together.wait(60)
    begun = time.monotonic()
    first_s, scores = None, []
    with suppress(*BROKEN):
        path = ask(port, "POST", "/v1/jobs", sent).document["links"]["self"]
        for frame in frames(port, f"{path}/events"):
            if frame.type == "plan":
                first_s = first_s or time.monotonic() - begun
                scores.append(json.loads(frame.data)["actions"])
    found = [scored(situation, actions) for actions in scores]
    bad = sum(one is None for one in found) + (not improving(found))
    return _Visit(first_s if found and found[0] is not None else None, bad)


def _hold(port: int, job: str, began: threading.Barrier) -> bool:
    """Follow a job from before to after the server's end; return whether the stream ended properly."""
    told = _lines(port, job)
    try:
        next(told)
        began.wait(60)
        for _ in told:
            pass
    except BROKEN:
        return False
    return True


def _lines(port: int, job: str) -> Iterator[str]:
    for frame in frames(port, f"/v1/jobs/{job}/events"):
        yield frame.data


def _slots(client: PlainClient) -> int:
    slots: int = client.ask("GET", "/v1/limits").document["limits"]["slots"]["value"]
    return slots


def _timed(act: Callable[[], object]) -> float:
    begun = time.perf_counter()
    act()
    return time.perf_counter() - begun


def _sync(file: Any) -> None:
    file.write(b"x" * 4096)
    file.flush()
    os.fdatasync(file.fileno())
