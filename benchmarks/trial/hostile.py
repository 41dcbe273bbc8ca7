"""Jobs for planners that misbehave: the time limit is enforced, the outcome is right, no process remains."""

from __future__ import annotations

import json
import shlex
import sys
import threading
import time
from collections import Counter
from collections.abc import Callable, Mapping
from contextlib import suppress
from datetime import datetime
from pathlib import Path
from typing import Any

import psutil
from support.services.plain_client import PlainClient, ask

from benchmarks.trial import hostile_planner
from benchmarks.trial.client_records import FINAL
from benchmarks.trial.rows import TrialRow, none_of, times
from benchmarks.trial.tasks import body, tiny
from benchmarks.trial.trial_server import TrialServer, orphans, running_server

PART = "hostile planners"
LIMIT_S = 1.0
GOAL_S = 1.0
_MEMORY_BYTES = 512 << 20
_WATCH_S = 0.05
_PATIENCE_S = 60.0
_GONE_S = 5.0

OUTCOMES: Mapping[str, frozenset[str]] = {
    **dict.fromkeys(hostile_planner.KINDS, frozenset({"timeout"})),
    "allocate": frozenset({"out_of_memory", "timeout"}),
    "leave-behind": frozenset({"no_plan"}),
    "leave": frozenset({"no_plan"}),
    "fail": frozenset({"engine_failed"}),
    "crash": frozenset({"engine_failed"}),
}
"""Allowed outcomes of a job by kind of planner. On a slow machine time may run out before memory."""


def options() -> list[str]:
    """Return the options of a server with these planners."""
    command = shlex.join([sys.executable, "-S", "-E", str(Path(hostile_planner.__file__))])
    planners = [f"--planner={kind}={command} {kind} {{domain}} {{problem}}" for kind in hostile_planner.KINDS]
    return [*planners, f"--limit=memory_bytes={_MEMORY_BYTES}", "--limit=queue=10000"]


def rows(runs: int, say: Callable[[str], None]) -> list[TrialRow]:
    """Run `runs` of them, two or more at a time as the service does, and watch their processes."""
    with running_server(options()) as server:
        before = server.resident_bytes()
        watch = ServerWatch(server)
        kinds = [kind for _, kind in zip(range(runs), _round_and_round(), strict=False)]
        done = _results(server, kinds, say)
        left_below = _below_after(server)
        watch.stop()
        grown = server.resident_bytes() - before
        server.terminate()
        left = orphans(_GONE_S)
    wrong = Counter(
        f"{kind}: {job['outcome']}"
        for kind, job in zip(kinds, done, strict=True)
        if job["outcome"] not in OUTCOMES[kind]
    )
    said = ", ".join(f"{count} {what}" for what, count in wrong.most_common())
    over = [
        (max(0.0, _ran_s(job) - LIMIT_S), kind) for kind, job in zip(kinds, done, strict=True) if job["finished_at"]
    ]
    worst = f", the last {max(over)[1]}" if over else ""
    return [
        times(PART, f"ended after their limit of {LIMIT_S:g} s, says the service", [s for s, _ in over], GOAL_S, worst),
        times(PART, "last process gone after that limit, seen from outside", watch.over_s(), GOAL_S),
        none_of(PART, "outcomes that are wrong", wrong.total(), f" of {runs}" + (f" ({said})" if said else "")),
        none_of(PART, "processes left after the last job, and after the server", len(left_below) + len(left)),
        TrialRow(
            part=PART,
            requirement="memory the server has gained",
            figure=f"{grown / 2**20:.0f} MiB",
            values={"bytes": grown},
        ),
    ]


class ServerWatch:
    """Polls the processes of hostile planners, and records when each group was last seen."""

    def __init__(self, server: TrialServer) -> None:
        self._server = server
        self._seen: dict[str, tuple[float, float]] = {}
        self._over = threading.Event()
        self._thread = threading.Thread(target=self._look_on, daemon=True)
        self._thread.start()

    def stop(self) -> None:
        """Stop polling."""
        self._over.set()
        self._thread.join()

    def over_s(self) -> list[float]:
        """Return for each planner how long its last process outlived the limit."""
        return [max(0.0, last - first - LIMIT_S) for first, last in self._seen.values()]

    def _look_on(self) -> None:
        while not self._over.wait(_WATCH_S):
            for pid in self._server.below():
                with suppress(psutil.Error):
                    self._note(psutil.Process(pid))

    def _note(self, process: psutil.Process) -> None:
        words = process.cmdline()
        if len(words) >= 2 and "hostile_planner.py" in " ".join(words):
            folder = words[-1]
            first, _ = self._seen.get(folder, (process.create_time(), 0.0))
            self._seen[folder] = (min(first, process.create_time()), time.time())


def _round_and_round() -> Any:
    while True:
        yield from hostile_planner.KINDS


def _results(server: TrialServer, kinds: list[str], say: Callable[[str], None]) -> list[Any]:
    """Submit all jobs at once; return their documents when all have ended or time is up."""
    client = PlainClient(server.port)
    paths = [client.ask("POST", "/v1/jobs", _body(kind)).document["links"]["self"] for kind in kinds]
    found: list[Any] = []
    for path in paths:
        until = time.monotonic() + _PATIENCE_S
        while (job := client.ask("GET", path).document)["state"] not in FINAL and time.monotonic() < until:
            time.sleep(_WATCH_S)
        found.append(job)
        if len(found) % 20 == 0:
            say(f"hostile planners: {len(found)}/{len(kinds)}")
    client.close()
    return found


def _body(kind: str) -> bytes:
    return json.dumps({**json.loads(body(tiny(), "auto", LIMIT_S)), "planner": kind}).encode()


def _below_after(server: TrialServer) -> list[int]:
    """Return the processes left below the launcher after one more, harmless job."""
    job = json.loads(body(tiny(), "greedy", LIMIT_S))
    path = ask(server.port, "POST", "/v1/jobs", json.dumps(job).encode()).document["links"]["self"]
    until = time.monotonic() + _PATIENCE_S
    while ask(server.port, "GET", path).document["state"] not in FINAL and time.monotonic() < until:
        time.sleep(_WATCH_S)
    return [pid for depth in (2, 3, 4, 5) for pid in server.below(depth)]


def _ran_s(job: Any) -> float:
    began, ended = (datetime.fromisoformat(job[key]) for key in ("started_at", "finished_at"))
    return (ended - began).total_seconds()
