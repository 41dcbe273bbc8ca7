"""One key floods a server with jobs, while another key requests a short plan now and then."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterator
from contextlib import closing

from support.services.plain_client import PlainClient

from benchmarks.trial.rows import TrialRow, none_of, percentile, times
from benchmarks.trial.tasks import LARGEST, body, small_floor, suite_body
from benchmarks.trial.trial_server import TrialServer, new_server
from marsupial_service.keys import KeyFile

FAIR = "fair between keys"
DONE_GOAL_S = 3.0

_OPTIONS = ("--require-keys", "--limit=key_queue=200")
_SHORT_S = 0.2
_FLOODS_S = (1.0, 30.0)
"""The search times of the flood's jobs; others wait for these jobs to end."""

_WAIT_S = 30
_SPREAD_S = 0.02
_LONGEST_S = 120.0


def rows(jobs: int, say: Callable[[str], None]) -> Iterator[TrialRow]:
    """Flood with short jobs, then with long ones, and time `jobs` jobs of another key."""
    for flood_s in _FLOODS_S:
        say(f"fair between keys: {jobs} jobs beside a flood of {flood_s:g} s each")
        with new_server(_OPTIONS) as server:
            keys = KeyFile(server.data)
            secrets = [keys.add(name, ["plan"], 1, now_s=time.time()) for name in ("flooding", "calm")]
            server.launch()
            server.wait_ready()
            yield from _beside(server, jobs, flood_s, *({"Authorization": f"Bearer {one}"} for one in secrets))


def _beside(
    server: TrialServer, jobs: int, flood_s: float, flooding: dict[str, str], calm: dict[str, str]
) -> Iterator[TrialRow]:
    over, full = threading.Event(), threading.Event()
    posts: list[int] = []
    flood = threading.Thread(target=_flood, args=(server.port, flooding, flood_s, over, full, posts))
    flood.start()
    try:
        full.wait(_LONGEST_S)
        found = [_done(server.port, calm, seed) for seed in range(jobs)]
    finally:
        over.set()
        flood.join()
    seconds = [one for one in found if one is not None]
    refused = f", {posts.count(429)} of {len(posts)} jobs of the flood refused"
    whose = f"a job of {_SHORT_S:g} s is done while another key floods with jobs of {flood_s:g} s"
    late = f", {sum(one > DONE_GOAL_S for one in seconds)} late" if percentile(seconds, 1.0) > DONE_GOAL_S else ""
    yield times(FAIR, whose, seconds, DONE_GOAL_S, late + refused)
    yield none_of(FAIR, "of them refused, failed or never done", jobs - len(seconds), f" of {jobs}")


def _flood(
    port: int, key: dict[str, str], flood_s: float, over: threading.Event, full: threading.Event, posts: list[int]
) -> None:
    """Post jobs until the key's queue is full, and then keep trying."""
    large = suite_body(LARGEST[0], "anytime", flood_s)
    with closing(PlainClient(port)) as client:
        while not over.is_set():
            posts.append(client.ask("POST", "/v1/jobs", large, key).status)
            if posts[-1] == 429:
                full.set()
                over.wait(_SPREAD_S)


def _done(port: int, key: dict[str, str], seed: int) -> float | None:
    """Post a short job and return the time until it is done; None if it does not finish."""
    begun = time.monotonic()
    with closing(PlainClient(port, _WAIT_S + 10.0)) as client:
        short = body(small_floor(seed % 10), "anytime", _SHORT_S)
        answer = client.ask("POST", "/v1/jobs", short, {**key, "Prefer": f"wait={_WAIT_S}"})
        if answer.status not in (200, 202):
            return None
        path = answer.document["links"]["self"]
        while answer.document["state"] in ("queued", "running") and time.monotonic() < begun + _LONGEST_S:
            answer = client.ask("GET", path, headers=key)
            time.sleep(_SPREAD_S)
    return time.monotonic() - begun if answer.document["state"] == "succeeded" else None
