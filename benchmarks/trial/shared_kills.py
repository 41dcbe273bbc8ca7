"""Two servers share a PostgreSQL database; servers, processes below them, and the database are killed.

The database loses all its processes at once, as in a crash of its machine, and is down for some seconds, sometimes
longer than the servers' lease. Clients talk to any server.
"""

from __future__ import annotations

import random
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory

from support.services.databases import NoPostgres, PostgresServer

from benchmarks.trial.client_records import ClientRecords, audit
from benchmarks.trial.client_threads import ClientThreads
from benchmarks.trial.explorers import SEEDS, ExplorerClient, MissionResults, reference_log
from benchmarks.trial.kill_tally import COMMITTING, DATABASE, SERVER, KillTally, report
from benchmarks.trial.kills import OPTIONS, armed, kill_below
from benchmarks.trial.owners import Ownership, keep_account, ownership
from benchmarks.trial.rows import Judgement, TrialRow, none_of
from benchmarks.trial.trial_server import TrialServer, kill_orphans, orphans

PART = "kills, shared"
SERVERS, EXPLORERS = 2, 3
_END_S = 600.0
_GONE_S = 5.0
_PAUSE_S = 3.0
_DOWN_S = 3.0
_STARTING_S = 2.0
_AWAY_S = ((0.0, 1.0), (1.0, 10.0), (10.0, 14.0))
_AWAY_SHARES = (6, 3, 1)
"""Downtimes of the database: mostly its restart alone, sometimes longer than the lease, 10 s."""

_UNREADY = 2
"""The exit code of a server that can't start."""


class SharedServers:
    """A database and the servers on it."""

    def __init__(self, folder: Path, draw: random.Random, tally: KillTally) -> None:
        self.database = PostgresServer()
        self.database.start()
        self.url = self.database.database()
        options = (*OPTIONS, "--store", self.url)
        self.servers = [TrialServer(folder / str(number), *options) for number in range(SERVERS)]
        self._draw = draw
        self._tally = tally
        self._armed: set[int] = set()

    @property
    def ports(self) -> tuple[int, ...]:
        """The ports of the servers."""
        return tuple(server.port for server in self.servers)

    @property
    def pids(self) -> tuple[int, ...]:
        """The ids of the processes started last."""
        return (self.database.pid, *(server.process.pid for server in self.servers))

    def open(self) -> None:
        """Start all servers and the record of owners."""
        for server in self.servers:
            server.launch()
        for server in self.servers:
            server.wait_ready()
        keep_account(self.url)

    def kill_one(self) -> None:
        """Kill a server, a process below one, or the database."""
        (act,) = self._draw.choices((self._kill_server, self._kill_below, self._kill_database), (3, 4, 2))
        act()
        time.sleep(self._draw.uniform(0, _PAUSE_S))
        self._restart_ended()

    def settle(self) -> None:
        """Make all servers run and be ready; kill those that would still be killed at a commit."""
        for server in self.servers:
            if server.runs and server.process.pid in self._armed:
                self._armed.discard(server.process.pid)
                server.kill()
                self._record_kill(SERVER)
        self._restart_ended()
        for server in self.servers:
            server.wait_ready()

    def close(self) -> None:
        """End everything, and count the processes left."""
        for server in self.servers:
            if server.runs:
                server.terminate()
            self._tally.read_log(server.log)
        self._tally.orphans += len(orphans(_GONE_S, self.pids))

    def _kill_server(self) -> None:
        """Kill a server and restart it; sometimes kill it again while it starts, or at one of its first commits."""
        server = self._draw.choice(self.servers)
        if not server.runs:
            return
        server.kill()
        self._record_kill(SERVER)
        time.sleep(self._draw.uniform(0, _DOWN_S))
        fate = self._draw.random()
        server.launch(armed(self._draw) if fate < 1 / 3 else None)
        if fate < 1 / 3:
            self._armed.add(server.process.pid)
        elif fate < 1 / 2:
            time.sleep(self._draw.uniform(0, _STARTING_S))
            if server.runs:
                server.kill()
                self._record_kill(SERVER)

    def _kill_below(self) -> None:
        kill_below(self._draw.choice(self.servers), self._draw, self._tally)

    def _kill_database(self) -> None:
        self.database.crash()
        self._tally.victims[DATABASE] += 1
        (span,) = self._draw.choices(_AWAY_S, _AWAY_SHARES)
        time.sleep(self._draw.uniform(*span))
        self.database.start()

    def _restart_ended(self) -> None:
        """Restart servers that have ended, and record why."""
        for server in self.servers:
            if server.runs:
                continue
            if server.process.pid in self._armed and not server.ended_by_itself:
                self._record_kill(COMMITTING)
            if server.ended_by_itself:
                unready = server.process.returncode == _UNREADY
                self._tally.refused += unready
                self._tally.failed += not unready
            server.launch()

    def _record_kill(self, victim: str) -> None:
        self._tally.victims[victim] += 1
        self._tally.measure_orphans(self.pids)


@contextmanager
def _shared_servers(draw: random.Random, tally: KillTally) -> Iterator[SharedServers]:
    """Yield a database and its servers, in folders of their own; remove all of it afterwards. Raises NoPostgres."""
    with TemporaryDirectory(prefix="marsupial-trial-", ignore_cleanup_errors=True) as folder:
        shared = SharedServers(Path(folder), draw, tally)
        try:
            yield shared
        finally:
            for server in shared.servers:
                server.close(shared.pids)
            shared.database.remove()
            kill_orphans()


def rows(kills: int, seed: int, say: Callable[[str], None]) -> list[TrialRow]:
    """Kill `kills` victims, then check every acknowledged job and mission."""
    draw, tally, records, results = random.Random(seed), KillTally(), ClientRecords(), MissionResults()
    for number in range(1, SEEDS + 1):
        reference_log(number)
    try:
        with _shared_servers(draw, tally) as shared:
            shared.open()
            clients = ClientThreads(shared.ports, records, random.Random(seed))
            explorers = [
                ExplorerClient(shared.ports, results, records.missions.append, first) for first in range(EXPLORERS)
            ]
            while tally.victims.total() < kills:
                shared.kill_one()
                done = f"{tally.victims.total()}/{kills}"
                say(f"{PART}: {done}, {len(records.jobs)} jobs, {results.missions} missions")
            shared.settle()
            clients.stop()
            for explorer in explorers:
                explorer.stop(_END_S)
            say(f"{PART}: looking at {len(records.jobs)} jobs")
            found = audit(shared.ports, records, _END_S)
            owners = ownership(shared.url)
            shared.close()
    except NoPostgres as error:
        return [TrialRow(part=PART, requirement="kills", figure=str(error), judgement=Judgement.NOT_RUN)]
    return [*report(PART, tally, records, found), *_of_shared(tally, owners), *results.rows(PART)]


def _of_shared(tally: KillTally, owners: Ownership) -> list[TrialRow]:
    crashes = tally.victims[DATABASE]
    figure = f"{tally.errors}, {tally.errors / max(1, crashes):.1f} for each time that the database was killed"
    turns = f" of {owners.turns}"
    return [
        none_of(PART, "turns stored by a server that did not own the mission", owners.foreign, turns),
        none_of(PART, "times that a mission had two owners, or none", owners.disputed, f" of {owners.terms}"),
        TrialRow(part=PART, requirement="errors that servers logged", figure=figure, values={"errors": tally.errors}),
        TrialRow(
            part=PART,
            requirement="servers that started while there was no database, and said so",
            figure=str(tally.refused),
            values={"count": tally.refused},
        ),
    ]
