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

from databases import NoPostgres, PostgresServer

from benchmarks.trial.crowd import Crowd
from benchmarks.trial.explorers import SEEDS, ExplorerClient, Journeys, undisturbed_mission
from benchmarks.trial.house import House, end_strays, strays
from benchmarks.trial.kills import OPTIONS, armed, kill_below
from benchmarks.trial.owners import Ownership, keep_account, ownership
from benchmarks.trial.promises import Promises, audit
from benchmarks.trial.rows import Judgement, TrialRow, none_of
from benchmarks.trial.toll import COMMITTING, DATABASE, SERVER, Toll, report

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


class Estate:
    """A database and the servers on it."""

    def __init__(self, folder: Path, draw: random.Random, toll: Toll) -> None:
        (folder / "database").mkdir()
        self.database = PostgresServer(folder / "database")
        self.database.start()
        self.url = self.database.database()
        options = (*OPTIONS, "--store", self.url)
        self.houses = [House(folder / str(number), *options) for number in range(SERVERS)]
        self._draw = draw
        self._toll = toll
        self._armed: set[int] = set()

    @property
    def ports(self) -> tuple[int, ...]:
        """The ports of the servers."""
        return tuple(house.port for house in self.houses)

    @property
    def pids(self) -> tuple[int, ...]:
        """The ids of the processes started last."""
        return (self.database.pid, *(house.process.pid for house in self.houses))

    def open(self) -> None:
        """Start all servers and the record of owners."""
        for house in self.houses:
            house.launch()
        for house in self.houses:
            house.wait_ready()
        keep_account(self.url)

    def kill_one(self) -> None:
        """Kill a random victim."""
        (act,) = self._draw.choices((self._kill_server, self._kill_below, self._kill_database), (3, 4, 2))
        act()
        time.sleep(self._draw.uniform(0, _PAUSE_S))
        self._revive()

    def settle(self) -> None:
        """Make all servers run and be ready; kill one now that would still be killed at a commit."""
        for house in self.houses:
            if house.runs and house.process.pid in self._armed:
                self._armed.discard(house.process.pid)
                house.kill()
                self._bury(SERVER)
        self._revive()
        for house in self.houses:
            house.wait_ready()

    def close(self) -> None:
        """End everything, and count the processes left."""
        for house in self.houses:
            if house.runs:
                house.terminate()
            self._toll.read_log(house.log)
        self._toll.strays += len(strays(_GONE_S, self.pids))

    def _kill_server(self) -> None:
        """Kill a server and restart it; sometimes kill it again while it starts, or at one of its first commits."""
        house = self._draw.choice(self.houses)
        if not house.runs:
            return
        house.kill()
        self._bury(SERVER)
        time.sleep(self._draw.uniform(0, _DOWN_S))
        fate = self._draw.random()
        house.launch(armed(self._draw) if fate < 1 / 3 else None)
        if fate < 1 / 3:
            self._armed.add(house.process.pid)
        elif fate < 1 / 2:
            time.sleep(self._draw.uniform(0, _STARTING_S))
            if house.runs:
                house.kill()
                self._bury(SERVER)

    def _kill_below(self) -> None:
        kill_below(self._draw.choice(self.houses), self._draw, self._toll)

    def _kill_database(self) -> None:
        self.database.crash()
        self._toll.victims[DATABASE] += 1
        (span,) = self._draw.choices(_AWAY_S, _AWAY_SHARES)
        time.sleep(self._draw.uniform(*span))
        self.database.start()

    def _revive(self) -> None:
        """Restart servers that have ended, and record why."""
        for house in self.houses:
            if house.runs:
                continue
            if house.process.pid in self._armed and not house.ended_by_itself:
                self._bury(COMMITTING)
            if house.ended_by_itself:
                unready = house.process.returncode == _UNREADY
                self._toll.refused += unready
                self._toll.failed += not unready
            house.launch()

    def _bury(self, victim: str) -> None:
        self._toll.victims[victim] += 1
        self._toll.look_for_strays(self.pids)


@contextmanager
def _estate(draw: random.Random, toll: Toll) -> Iterator[Estate]:
    """Yield an estate in its own folder, and remove all of it afterwards. Raises NoPostgres."""
    with TemporaryDirectory(prefix="marsupial-trial-", ignore_cleanup_errors=True) as folder:
        estate = Estate(Path(folder), draw, toll)
        try:
            yield estate
        finally:
            for house in estate.houses:
                house.close(estate.pids)
            estate.database.crash()
            end_strays()


def rows(kills: int, seed: int, say: Callable[[str], None]) -> list[TrialRow]:
    """Kill `kills` victims, then check every acknowledged job and mission."""
    draw, toll, promises, journeys = random.Random(seed), Toll(), Promises(), Journeys()
    for number in range(1, SEEDS + 1):
        undisturbed_mission(number)
    try:
        with _estate(draw, toll) as estate:
            estate.open()
            crowd = Crowd(estate.ports, promises, random.Random(seed))
            explorers = [
                ExplorerClient(estate.ports, journeys, promises.missions.append, first) for first in range(EXPLORERS)
            ]
            while toll.victims.total() < kills:
                estate.kill_one()
                done = f"{toll.victims.total()}/{kills}"
                say(f"{PART}: {done}, {len(promises.jobs)} jobs, {journeys.missions} missions")
            estate.settle()
            crowd.stop()
            for explorer in explorers:
                explorer.stop(_END_S)
            say(f"{PART}: looking at {len(promises.jobs)} jobs")
            found = audit(estate.ports, promises, _END_S)
            owners = ownership(estate.url)
            estate.close()
    except NoPostgres as error:
        return [TrialRow(part=PART, requirement="kills", figure=str(error), judgement=Judgement.NOT_RUN)]
    return [*report(PART, toll, promises, found), *_of_shared(toll, owners), *journeys.rows(PART)]


def _of_shared(toll: Toll, owners: Ownership) -> list[TrialRow]:
    crashes = toll.victims[DATABASE]
    figure = f"{toll.errors}, {toll.errors / max(1, crashes):.1f} for each time that the database was killed"
    turns = f" of {owners.turns}"
    return [
        none_of(PART, "turns stored by a server that did not own the mission", owners.foreign, turns),
        none_of(PART, "times that a mission had two owners, or none", owners.disputed, f" of {owners.terms}"),
        TrialRow(part=PART, requirement="errors that servers logged", figure=figure, values={"errors": toll.errors}),
        TrialRow(
            part=PART,
            requirement="servers that started while there was no database, and said so",
            figure=str(toll.refused),
            values={"count": toll.refused},
        ),
    ]
