"""A store after nearly all entries were removed: its size on disk, against the rest of its content."""

from __future__ import annotations

import asyncio
import sqlite3
import time
from collections.abc import Callable, Iterator
from contextlib import closing
from pathlib import Path

from support.services.plain_client import ask

from benchmarks.trial.async_connection import AsyncConnection
from benchmarks.trial.report_flood import reports, start_mission
from benchmarks.trial.rows import TrialRow, judged
from benchmarks.trial.tasks import short_jobs
from benchmarks.trial.trial_server import TrialServer, running_server
from marsupial_service.store.sqlite import FILE

STORE = "store"
MOST_OF_LIVE = 1.2
RETENTION_S = 2.0

_BATCH = 100
_STAYS = 0.1
_WITHIN_S = 120.0
_POLL_S = 0.5


def rows(count: int, say: Callable[[str], None]) -> Iterator[TrialRow]:
    """Send `count` reports to missions, of which one in ten continues; end the others, and wait for their removal."""
    say(f"store: {count} reports, of which one in ten stays")
    with running_server((f"--limit=retention_s={RETENTION_S:g}",)) as server:
        asyncio.run(_fill(server.port, count))
        most = on_disk(server)
        left = _left(server)
        size, live = on_disk(server), _live(server)
    yield TrialRow(
        part=STORE,
        requirement=f"on the disk after retention, beside what is left of {count} reports and {len(short_jobs())} jobs",
        figure=f"{size / 1000:.0f} kB of {most / 1000:.0f} before; {live / 1000:.0f} kB are live; {left} entries",
        goal=f"{MOST_OF_LIVE:.0%} of live",
        judgement=judged(size <= MOST_OF_LIVE * live and left == 1),
        values={"bytes": size, "live_bytes": live, "most_bytes": most},
    )


async def _fill(port: int, count: int) -> None:
    connection = await AsyncConnection.to(port)
    for body in short_jobs():
        await connection.post("/v1/jobs", body)
    for share, stays in ((1 - _STAYS, False), (_STAYS, True)):
        path = await start_mission(connection)
        told = reports(of_team=True)
        for _ in range(round(share * count / _BATCH)):
            await connection.report(path, [next(told) for _ in range(_BATCH)])
        if not stays:
            await connection.post(f"{path}/cancel", b"")
            await connection.report(path, [next(told)])


def _left(server: TrialServer) -> int:
    """Wait until ended entries are removed and disk space is freed; return the number of entries left."""
    until_s, before = time.monotonic() + _WITHIN_S, -1
    while True:
        found = sum(len(ask(server.port, "GET", f"/v1/{kind}").document[kind]) for kind in ("jobs", "missions"))
        size = on_disk(server)
        if (found == 1 and size == before) or time.monotonic() > until_s:
            return found
        before = size
        time.sleep(_POLL_S if found > 1 else 5.0)


def on_disk(server: TrialServer) -> int:
    """Return the size of the store's files."""
    return sum(file.stat().st_size for file in Path(server.data).glob(f"{FILE}*"))


def _live(server: TrialServer) -> int:
    """Return the size of a new store with the same content."""
    copy = Path(server.data) / "live"
    with closing(sqlite3.connect(server.data / FILE)) as connection:
        connection.execute("VACUUM INTO ?", (str(copy),))
    return copy.stat().st_size
