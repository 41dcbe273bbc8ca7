"""Rare writes of servers: one server is frozen after each of its statements while another does the same write.

So both compete for the same rows and locks. Each attempt has new entries; the frozen server retries when it wakes,
after the other one has finished.
"""

from __future__ import annotations

import uuid
from collections.abc import Callable, Iterator
from functools import partial

from support.services.databases import PostgresServer

from benchmarks.trial.freezing import Act, FrozenRow, Proxy, rows_of
from marsupial.model.planning import Budget
from marsupial_service.entries.capacity import StoreCapacity
from marsupial_service.entries.quota import Quota
from marsupial_service.entries.records import NewEntry
from marsupial_service.jobs import table as jobs
from marsupial_service.jobs.records import JobSettings, PackedRequest
from marsupial_service.missions import table as missions
from marsupial_service.missions.table import MISSIONS
from marsupial_service.schemas.enums import MissionPhase
from marsupial_service.settings import ServiceLimits
from marsupial_service.store import Store, Transaction, open_store

Write = Callable[[Transaction], object]


_SETTINGS = JobSettings(max_attempts=1, limits=ServiceLimits(key_planning_s=10_000, steps_s=10))
_MADE_MS, _NOW_MS = 1_000_000, 1_100_000


def rows(database: PostgresServer, proxy: Proxy) -> Iterator[FrozenRow]:
    """Freeze a server at each statement of each of these writes, and of the first start on a database."""
    yield from rows_of(proxy, partial(_first_start, database, proxy))
    url = database.database()
    frozen, healthy = open_store(proxy.through(url)), open_store(url)
    try:
        for made in (charged, given_back, given_up, recovered, makes_way, left, taken_up, called_off, waits):
            yield from rows_of(proxy, partial(_both, made, frozen, healthy))
    finally:
        proxy.free()
        frozen.close()
        healthy.close()


def _first_start(database: PostgresServer, proxy: Proxy) -> tuple[Act, Act]:
    """Return two acts: a server creates the tables of an empty database through the proxy, another one without it."""
    url = database.database()
    return lambda: open_store(proxy.through(url)).close(), lambda: open_store(url).close()


def _both(made: Callable[[Store], Write], frozen: Store, healthy: Store) -> tuple[Act, Act]:
    """Return a write as done by one server, and by the other."""
    healthy.write(_clear).result()
    write = made(frozen)
    return lambda: frozen.write(write).result(), lambda: healthy.write(write).result()


def _clear(tx: Transaction) -> None:
    for name in ("jobs", "missions", "documents"):
        tx.execute(f"DELETE FROM {name}")


def charged(store: Store) -> Write:
    """Charge an owner who has a quota."""
    return lambda tx: Quota(_SETTINGS.limits).charge(tx, "ann", 500, _NOW_MS)


def given_back(store: Store) -> Write:
    """Give up a claim, for the end of the server or for a mission."""
    claim = _claim(store, "ann")
    return lambda tx: jobs.requeue(tx, claim, "", _SETTINGS, _NOW_MS, 500)


def given_up(store: Store) -> Write:
    """End a job whose last attempt was lost."""
    claim = _claim(store, "ann")
    return lambda tx: jobs.requeue(tx, claim, "it was killed", _SETTINGS, _NOW_MS, 500)


def recovered(store: Store) -> Write:
    """Requeue jobs whose server has died."""
    _claim(store, "ann")
    _claim(store, "bob")
    store.write(lambda tx: tx.execute("UPDATE jobs SET holder = 'dead', attempts = 0")).result()
    return lambda tx: jobs.recover(tx, _SETTINGS, _NOW_MS, frozenset())


def makes_way(store: Store) -> Write:
    """Preempt a job for another owner's job."""
    for _ in range(2):
        _claim(store, "ann")
    _job(store, "bob")
    return lambda tx: jobs.preempt(tx, _SETTINGS, _NOW_MS)


def left(store: Store) -> Write:
    """Leave missions to other servers, as a server does when it ends."""
    _mission(store)
    return missions.release_all


def taken_up(store: Store) -> Write:
    """Take up missions that another server has left."""
    for _ in range(2):
        _mission(store)
    store.write(missions.release_all).result()
    return lambda tx: missions.take_over_orphans(tx, 4, frozenset(), frozenset())


def called_off(store: Store) -> Write:
    """Cancel a mission without reports."""
    mission, _ = _mission(store)
    return lambda tx: missions.cancel_abandoned(tx, mission, "no report came", _NOW_MS)


def waits(store: Store) -> Write:
    """Record that a mission waits for its owner's quota."""
    mission, term = _mission(store)
    return lambda tx: missions.add_quota_event(tx, mission, term, "your planning time is used up", 5.0, _NOW_MS)


def _job(store: Store, owner: str) -> None:
    new = jobs.NewJob(
        id=uuid.uuid4().hex,
        owner=owner,
        key=None,
        digest=b"",
        request=PackedRequest(planner="greedy", budget=Budget(seconds=1.0), digest=b"", source=b"source"),
    )
    store.write(lambda tx: jobs.insert(tx, new, _SETTINGS, StoreCapacity(), _MADE_MS)).result()


def _claim(store: Store, owner: str) -> jobs.Claim:
    _job(store, owner)
    claim = store.write(lambda tx: jobs.claim(tx, _SETTINGS, _MADE_MS)).result()
    assert claim is not None
    return claim


def _mission(store: Store) -> tuple[str, int]:
    """Create a mission owned by a server; return its id and term."""
    new = NewEntry(id=uuid.uuid4().hex, owner="ann", key=None, digest=b"")

    def make(tx: Transaction) -> int:
        described = {"name": "hall", "strategy": "temporal", "planner": "greedy"}
        return MISSIONS.take_over(tx, MISSIONS.add(tx, new, MissionPhase.RUNNING, _MADE_MS, **described))

    return new.id, store.write(make).result()
