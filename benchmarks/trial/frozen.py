"""A server that is cut off from the database after each statement of each of its transactions, beside a healthy one.

``python -m trial.frozen``, run in the folder ``tests``, starts two servers on one PostgreSQL database. The first
reaches it through a proxy, which reads the statements that pass. Whenever one passes inside a transaction that writes,
and it is one that was not tried yet, the proxy hands it on and then swallows every byte in both directions: to the
database and to the other server this is a server that froze, or whose network is gone, while it holds what it has
locked. The second server meanwhile creates a job every 0.1 s; how long the slowest of them takes is the row of the
table. Then the proxy breaks all connections, the first server connects again, which is a transaction too, and the next
statement is tried. Jobs and missions of all kinds, their removal and checks of readiness go through the first server.
"""

from __future__ import annotations

import argparse
import asyncio
import random
import struct
import sys
import threading
import time
from contextlib import suppress
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from databases import PostgresServer
from talk import ACCEPTED, BROKEN, Talk

from benchmarks.trial.crowd import Crowd
from benchmarks.trial.explorers import Explorer, Journeys, undisturbed_mission
from benchmarks.trial.house import House, end_strays
from benchmarks.trial.promises import Promises
from benchmarks.trial.tasks import short_jobs

GOAL_S = 3.0
_PAUSE_S = 0.1
_AFTERWARDS = 3
"""Jobs that the healthy server has to take before the other one is freed."""

_DONE = "nothing new was seen"
_LONGEST_S = 60.0


class Proxy:
    """Stands before a database's socket in `folder`; `tried` has the statements after which all was swallowed.

    Attributes
    ----------
    frozen
        Set while bytes are swallowed.
    """

    def __init__(self, folder: Path, database: Path) -> None:
        self.tried: list[str] = []
        self.frozen = threading.Event()
        self._armed = False
        self._folder, self._database = folder, database
        self._writers: set[asyncio.StreamWriter] = set()
        self._loop = asyncio.new_event_loop()
        threading.Thread(target=self._loop.run_forever, daemon=True).start()
        asyncio.run_coroutine_threadsafe(self._listen(), self._loop).result()

    def arm(self) -> None:
        """Freeze at the next statement that was not tried yet."""
        self._armed = True

    def free(self) -> None:
        """Break all connections, and relay again."""
        self._armed = False
        asyncio.run_coroutine_threadsafe(self._break(), self._loop).result()

    async def _listen(self) -> None:
        await asyncio.start_unix_server(self._serve, self._folder / ".s.PGSQL.5432")

    async def _break(self) -> None:
        for writer in self._writers:
            writer.transport.abort()
        self._writers.clear()
        self.frozen.clear()

    async def _serve(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        there, back = await asyncio.open_unix_connection(str(self._database / ".s.PGSQL.5432"))
        self._writers |= {writer, back}
        with suppress(OSError, asyncio.IncompleteReadError):
            await asyncio.gather(self._statements(reader, back), self._answers(there, writer))
        for one in (writer, back):
            one.transport.abort()

    async def _answers(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        while data := await reader.read(65536):
            if not self.frozen.is_set():
                writer.write(data)
        writer.transport.abort()

    async def _statements(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        """Hand messages of the client on, see "Message Flow" and "Message Formats" of the PostgreSQL documentation."""
        head = await reader.readexactly(4)
        writer.write(head + await reader.readexactly(struct.unpack("!i", head)[0] - 4))  # the start-up message
        prepared: dict[bytes, str] = {}
        sql, writes = "", False
        while True:
            head = await reader.readexactly(5)
            body = await reader.readexactly(struct.unpack("!i", head[1:])[0] - 4)
            if self.frozen.is_set():
                continue
            writer.write(head + body)
            kind = head[:1]
            if kind == b"Q":
                sql = body.rstrip(b"\0").decode()
            elif kind == b"P":
                name, text = body.split(b"\0")[:2]
                sql = prepared[name] = text.decode()
            elif kind == b"B":
                sql = prepared.get(body.split(b"\0")[1], sql)
            if kind not in (b"Q", b"S"):
                continue
            if sql.startswith("BEGIN"):
                writes = "READ ONLY" not in sql
            if writes and self._armed and sql not in self.tried:
                self._armed = False
                self.tried.append(sql)
                self.frozen.set()
            if sql in ("COMMIT", "ROLLBACK"):
                writes = False


class Prober:
    """Creates jobs on a healthy server, one after the other, and remembers when each began and how long it took."""

    def __init__(self, port: int) -> None:
        self.taken: list[tuple[float, float]] = []
        self.failures: list[str] = []
        self.asking_since_s = time.monotonic()
        self._port = port
        self._over = threading.Event()
        self._thread = threading.Thread(target=self._run)
        self._thread.start()

    def stop(self) -> None:
        """End."""
        self._over.set()
        self._thread.join()

    def _run(self) -> None:
        jobs = short_jobs()
        while not self._over.wait(_PAUSE_S):
            self.asking_since_s = began = time.monotonic()
            talk = Talk(self._port)
            try:
                status = talk.ask("POST", "/v1/jobs", random.choice(jobs)).status
            except BROKEN as error:
                status = 0
                self.failures.append(repr(error))
            finally:
                talk.close()
            if status in ACCEPTED:
                self.taken.append((began, time.monotonic() - began))
            elif status not in (0, 429):
                self.failures.append(f"status {status}")


class Visitor:
    """Begins simulated missions, pauses, resumes and cancels some of them, and asks whether the server is ready."""

    def __init__(self, port: int) -> None:
        self._port = port
        threading.Thread(target=self._run, daemon=True).start()

    def _run(self) -> None:
        while True:
            with suppress(*BROKEN):
                self._ask("GET", "/readyz")
                wanted = {"scenario": "lobby", "planner": "greedy", "speed": random.choice([20.0, 1000.0])}
                begun = self._ask("POST", "/v1/simulations", wanted)
                for wish in random.choice([(), ("pause", "resume"), ("cancel",), ("pause", "resume", "cancel")]):
                    time.sleep(_PAUSE_S)
                    self._ask("POST", f"/v1/missions/{begun.get('id')}/{wish}")
            time.sleep(1.0)

    def _ask(self, method: str, path: str, body: object = None) -> dict[str, Any]:
        talk = Talk(self._port)
        try:
            found: dict[str, Any] = talk.ask(method, path, body).document
            return found
        finally:
            talk.close()


def table(seconds: float) -> list[tuple[str, float, str]]:
    """Return each statement tried, how long the slowest job beside it took in s, and what failed."""
    rows: list[tuple[str, float, str]] = []
    undisturbed_mission(1)
    with TemporaryDirectory(prefix="marsupial-frozen-") as name:
        folder = Path(name)
        (folder / "database").mkdir()
        (folder / "proxy").mkdir()
        database = PostgresServer(folder / "database")
        database.start()
        direct = database.database()
        proxy = Proxy(folder / "proxy", folder / "database")
        through = direct.replace(str(folder / "database"), str(folder / "proxy"))
        limits = ("queue=100000", "kept_jobs=20", "kept_missions=3", "simulations=20")
        options = [word for limit in limits for word in ("--limit", limit)]
        houses = [House(folder / f"server{i}", *options, "--store", url) for i, url in enumerate((through, direct))]
        try:
            for house in houses:
                house.launch()
                house.wait_ready()
            ports = [house.port for house in houses[:1]]
            crowd = Crowd(ports, Promises(), random.Random(1))
            Explorer(ports, Journeys(), lambda _: None, 0)
            Visitor(ports[0])
            prober = Prober(houses[1].port)
            until_s = time.monotonic() + seconds
            while time.monotonic() < until_s:
                rows += _freeze(proxy, prober)
                if rows and rows[-1][0] == _DONE:
                    break
            prober.stop()
            del crowd
        finally:
            for house in houses:
                house.close((database.pid,))
            database.crash()
            end_strays()
    return rows


def _freeze(proxy: Proxy, prober: Prober) -> list[tuple[str, float, str]]:
    proxy.arm()
    if not proxy.frozen.wait(_LONGEST_S):
        return [(_DONE, 0.0, "")]
    began_s, failed = time.monotonic(), len(prober.failures)

    def since() -> list[tuple[float, float]]:
        return [(at, took) for at, took in prober.taken if at + took > began_s]

    while len(since()) < _AFTERWARDS and time.monotonic() - began_s < _LONGEST_S:
        time.sleep(0.05)
    slowest = max([took for _, took in since()], default=time.monotonic() - began_s)
    row = (" ".join(proxy.tried[-1].split()), slowest, ", ".join(sorted(set(prober.failures[failed:]))))
    print(f"{row[1]:6.2f} s  {row[2]:24s}{row[0][:100]}", flush=True)
    proxy.free()
    return [row]


def main() -> int:
    """Print the table; exit with 1 if a job took longer than the goal."""
    parser = argparse.ArgumentParser(description="Cut a server off after each statement of its transactions.")
    parser.add_argument("--seconds", type=float, default=900.0, help="at most (default %(default)s)")
    rows = table(parser.parse_args().seconds)
    tried = [row for row in rows if row[0] != _DONE]
    slow = [row for row in tried if row[1] > GOAL_S]
    failed = [row for row in tried if row[2]]
    worst = max((row[1] for row in tried), default=0.0)
    print(f"{len(tried)} statements; the slowest write beside one took {worst:.2f} s, {len(slow)} took longer than")
    print(f"{GOAL_S:g} s, and beside {len(failed)} something failed")
    return 1 if slow or failed or not tried else 0


if __name__ == "__main__":
    sys.exit(main())
