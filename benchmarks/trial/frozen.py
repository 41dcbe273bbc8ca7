"""A server cut off from the database after each statement of each of its transactions, beside a healthy one.

``python -m benchmarks.trial.frozen`` starts two servers on one PostgreSQL database. The first reaches it through a
proxy (`freezing`), as do operators: whenever a transaction reaches a statement that was not tried yet, the proxy cuts
it off right after that. Meanwhile clients and operators of the second server perform every kind of write; the time of
the slowest is the row of the table. Then the proxy breaks all connections, they reconnect, and the next statement is
tried. Clients and operators of the first server do the same; now and then the first server is terminated or killed,
and restarted.

Rare writes, such as the first start on a database, are tried one by one before that (`rare_writes`).
"""

from __future__ import annotations

import argparse
import json
import random
import sys
import threading
import time
import uuid
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import asdict
from itertools import chain
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from support.services.databases import PostgresServer
from support.services.plain_client import ACCEPTED, BROKEN, PlainClient

from benchmarks.trial import rare_writes
from benchmarks.trial.explorers import ExplorerClient, MissionResults, reference_log
from benchmarks.trial.freezing import FrozenRow, Proxy
from benchmarks.trial.tasks import short_jobs
from benchmarks.trial.trial_server import TrialServer, kill_orphans
from marsupial_service.keys import KeyRow, open_keys
from marsupial_service.operations.upkeep import retain
from marsupial_service.store import StoreError, open_store

GOAL_S = 3.0
_HOLD_S = 2.5
"""Least time that a server stays frozen: longer than the database lets it hold locks."""

_LONGEST_S = 60.0
_GRANTED = (*ACCEPTED, 201)
_LIVES_S = 90.0
"""Lifetime of the first server before it is terminated or killed."""

_OPTIONS = (
    "--require-keys",
    *("--limit=key_planning_s=600", "--limit=slots=1"),
    *("--limit=kept_jobs=20", "--limit=kept_missions=3", "--limit=simulations=20"),
)


class Users:
    """Clients of one server, and operators of its store `place`: each repeats one action, in a thread.

    Attributes
    ----------
    failures
        Unexpected answers.
    """

    def __init__(self, port: int, place: str, secrets: tuple[str, str]) -> None:
        self.failures: list[str] = []
        self._port, self._place, self._secrets = port, place, secrets
        self._store = open_store(place)
        self._keys = KeyRow(self._store)
        self._over = threading.Event()
        self._lock = threading.Lock()
        self._done: list[tuple[str, float, float]] = []
        self._under_way: dict[int, float] = {}
        acts = ((self._job, 0.1), (self._mission, 0.1), (self._key, 1.0), (self._retain, 0.5), (self._ready, 4.0))
        self._threads = [threading.Thread(target=self._repeat, args=act) for act in acts]
        for thread in self._threads:
            thread.start()

    def close(self) -> None:
        """Stop all threads."""
        self._over.set()
        for thread in self._threads:
            thread.join()
        self._store.close()

    def are_done(self, began_s: float, until_s: float) -> bool:
        """Return whether every frequent action was done since `began_s`, and all that began by `until_s` are done."""
        with self._lock:
            often = {"_job", "_mission", "_key"} <= {name for name, at, _ in self._done if at > began_s}
            return often and all(at > until_s for at in self._under_way.values())

    def slowest_since(self, began_s: float) -> float:
        """Return the time of the slowest action that ended since then or still runs."""
        with self._lock:
            under_way = [time.monotonic() - at for at in self._under_way.values()]
            return max([took for _, at, took in self._done if at + took > began_s] + under_way, default=0.0)

    def _repeat(self, act: Callable[[], None], pause_s: float) -> None:
        while not self._over.wait(pause_s):
            try:
                act()
            except (*BROKEN, StoreError) as error:
                self.failures.append(f"{act.__name__}: {error!r}")

    def _timed(self, name: str, write: Callable[[], Any]) -> Any:
        began_s = self._under_way[threading.get_ident()] = time.monotonic()
        try:
            return write()
        finally:
            with self._lock:
                del self._under_way[threading.get_ident()]
                self._done.append((name, began_s, time.monotonic() - began_s))

    def _ask(self, name: str, method: str, path: str, body: object = None, secret: str = "", **headers: str) -> Any:
        """Send a request, and return the document of a successful answer, else an empty one."""
        client = PlainClient(self._port)
        headers = {"Authorization": f"Bearer {secret or self._secrets[0]}", **headers}
        try:
            reply = self._timed(name, lambda: client.ask(method, path, body, headers))
        finally:
            client.close()
        if reply.status not in (*_GRANTED, 429, 404, 409):
            self.failures.append(f"{name}: {reply.status}")
        return reply.document if reply.status in _GRANTED else {}

    def _job(self) -> None:
        """Create a job, sometimes twice, and cancel some job of either server."""
        sent, again = random.choice(short_jobs()), {"Idempotency-Key": uuid.uuid4().hex}
        for _ in range(random.choice((1, 1, 1, 2))):
            self._ask("_job", "POST", "/v1/jobs", sent, **again)
        jobs = self._ask("_list", "GET", "/v1/jobs?limit=6").get("jobs", ())
        if jobs and random.random() < 0.9:
            self._ask("_job", "POST", f"/v1/jobs/{random.choice(jobs)['id']}/cancel")

    def _mission(self) -> None:
        """Pause, resume or cancel one of the last missions of either server; sometimes start a new one."""
        if random.random() < 0.15:
            speed, seconds = random.choice((5.0, 20.0, 1000.0)), {"seconds": 0.5}
            wanted = {"scenario": "lobby", "planner": "greedy", "speed": speed, "budget": seconds}
            self._ask("_mission", "POST", "/v1/simulations", wanted, self._secrets[random.randrange(2)])
        for secret in self._secrets:
            for mission in self._ask("_list", "GET", "/v1/missions?limit=3", secret=secret).get("missions", ()):
                wish = random.choice(("pause", "resume", "resume", "resume", "cancel"))
                if random.random() < 0.3:
                    self._ask("_mission", "POST", f"/v1/missions/{mission['id']}/{wish}", secret=secret)

    def _key(self) -> None:
        """Create a key, start a mission with it, and revoke it, which cancels the mission."""
        name = uuid.uuid4().hex[:8]
        secret = self._timed("_key", lambda: self._keys.add(name, ["mission"], 1, time.time()))
        if random.random() < 0.2:
            time.sleep(0.5)
            wanted = {"scenario": "lobby", "planner": "greedy", "speed": 1.0}
            self._ask("_mission", "POST", "/v1/simulations", wanted, secret)
        self._timed("_key", lambda: self._keys.revoke(name, time.time()))

    def _ready(self) -> None:
        """Request the server's readiness, which writes."""
        self._ask("_ready", "GET", "/readyz")

    def _retain(self) -> None:
        """Remove finished entries."""
        kept = random.choice((10, 30))
        self._timed("_retain", lambda: retain(self._place, days=None, kept=kept, now_ms=round(1000 * time.time())))


class ServerRestarts(threading.Thread):
    """Terminates or kills a server now and then, and restarts it."""

    def __init__(self, server: TrialServer) -> None:
        super().__init__()
        self._server = server
        self._over = threading.Event()
        self.start()

    def close(self) -> None:
        """Stop the thread; leave the server as it is."""
        self._over.set()
        self.join()

    def run(self) -> None:
        """Terminate or kill the server again and again."""
        until_s = time.monotonic() + _LIVES_S
        while not self._over.wait(0.5):
            if self._server.runs and time.monotonic() > until_s:
                until_s = time.monotonic() + _LIVES_S
                if random.random() < 0.7:
                    self._server.terminate()
                if self._server.runs:
                    self._server.kill()
            if not self._server.runs:
                self._server.launch()


def freezes(database: PostgresServer, proxy: Proxy, folder: Path, seconds: float) -> Iterator[FrozenRow]:
    """Freeze a server at each statement that passes, for `seconds` in all."""
    url = database.database()
    with open_keys(url) as keys:
        one, other = (keys.add(name, ["plan", "mission"], 1, time.time()) for name in ("one", "other"))
    places = (proxy.through(url), url)
    servers = [TrialServer(folder / f"server{i}", *_OPTIONS, "--store", place) for i, place in enumerate(places)]
    busy: list[Users | ServerRestarts] = []
    try:
        for server in servers:
            server.launch()
            server.wait_ready()
        users = [Users(server.port, place, (one, other)) for server, place in zip(servers, places, strict=True)]
        ExplorerClient([servers[0].port], MissionResults(), lambda _: None, key=one)
        busy += [*users, ServerRestarts(servers[0])]
        until_s = time.monotonic() + seconds
        while time.monotonic() < until_s:
            proxy.arm()
            if proxy.frozen.wait(_LONGEST_S):
                yield _freeze(proxy, users[1])
    finally:
        proxy.free()
        for these in busy:
            these.close()
        for server in servers:
            server.close((database.pid,))


def _freeze(proxy: Proxy, healthy: Users) -> FrozenRow:
    began_s, failed = time.monotonic(), len(healthy.failures)
    while (now_s := time.monotonic()) < began_s + _LONGEST_S:
        if now_s > began_s + _HOLD_S and healthy.are_done(began_s, began_s + _HOLD_S):
            break
        time.sleep(0.05)
    failures = sorted(set(healthy.failures[failed:]))
    row = FrozenRow(point=proxy.tried[-1], slowest_s=healthy.slowest_since(began_s), failed=", ".join(failures))
    proxy.free()
    return row


@contextmanager
def cut_off() -> Iterator[tuple[PostgresServer, Proxy, Path]]:
    """Yield a database, its proxy and a folder; remove all of them afterwards."""
    with TemporaryDirectory(prefix="marsupial-frozen-") as name:
        folder = Path(name)
        (folder / "proxy").mkdir()
        database = PostgresServer()
        database.start()
        try:
            yield database, Proxy(folder / "proxy", database.folder), folder
        finally:
            database.remove()
            kill_orphans()


def main() -> int:
    """Print the table; exit with 1 if a write took longer than the goal, or failed."""
    parser = argparse.ArgumentParser(description="Cut a server off after each statement of its transactions.")
    parser.add_argument("--seconds", type=float, default=3000.0, help="at most (default %(default)s)")
    parser.add_argument("--json", type=Path, help="write all rows here too, and go on after those that are there")
    parser.add_argument("--seed", type=int, default=1, help="draws what is done (default %(default)s)")
    wanted = parser.parse_args()
    random.seed(wanted.seed)
    reference_log(1)
    rows: list[FrozenRow] = []
    if wanted.json and wanted.json.exists():
        rows = [FrozenRow(**{**row, "point": tuple(row["point"])}) for row in json.loads(wanted.json.read_text())]
    with cut_off() as (database, proxy, folder):
        proxy.tried += [row.point for row in rows]
        for row in chain(rare_writes.rows(database, proxy), freezes(database, proxy, folder, wanted.seconds)):
            print(row, flush=True)
            rows.append(row)
            if wanted.json:
                wanted.json.write_text(json.dumps([asdict(one) for one in rows], indent=1))
    slow = [row for row in rows if row.slowest_s > GOAL_S]
    failed = [row for row in rows if row.failed]
    worst_s = max((row.slowest_s for row in rows), default=0.0)
    untried = proxy.seen.difference(proxy.tried)
    print(f"{len(rows)} statements of transactions, {len(untried)} more were seen; the slowest write beside one took")
    print(f"{worst_s:.2f} s, {len(slow)} took longer than {GOAL_S:g} s, and beside {len(failed)} something failed")
    for point in sorted(untried):
        print("not tried:", len(point), point[-1])
    return 1 if slow or failed or not rows else 0


if __name__ == "__main__":
    sys.exit(main())
